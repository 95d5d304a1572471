//! The public seam: one file, one mechanism.
//!
//! A mechanism is a struct that is at once its JSON block, the resource its systems read, and the law itself. It adds
//! *rates*: pulls, speed factors, heading diffusion, spin. It never moves a cone and never sees Δt, so that the method
//! stays a choice of the scenario. A mechanism that is absent costs nothing: it is not installed.

use super::adaptive::AdaptiveSteps;
use super::components::GrowthCone;
use super::health::Health;
use super::keep::Keep;
use super::kept::KeptState;
use super::material_law::{MaterialLaw, Materials};
use super::mesh_extent::MeshExtent;
use super::plan::Plan;
use super::random::Stream;
use super::schedule::{Motion, Phase, Schedules, Slot, Term};
use super::tissue::Tissue;
use super::violation::{Violation, Violations};
use bevy_ecs::component::Mutable;
use bevy_ecs::prelude::{Component, IntoScheduleConfigs, Resource, World};
use bevy_ecs::schedule::SystemSet;
use bevy_ecs::system::ScheduleSystem;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Deref;

use super::shape::Shape;

/// A guidance mechanism, or a provider of a field.
///
/// The type's doc comment and those of its fields are its reference; JSON-Schema keywords on the fields
/// (`minimum`, `exclusiveMaximum`, `x-typical`, …) are its ranges, in base units.
pub trait Mechanism: DeserializeOwned + JsonSchema + Send + Sync + 'static {
    /// JSON key of its block, word for `--without`, name of its random stream.
    const NAME: &'static str;

    /// Checks what a schema cannot say: relations between keys, names that must exist in the scene.
    fn check(&self, _facts: &Facts) -> Violations {
        Violations::new()
    }

    /// Shapes that the mesh must be fitted to, by name.
    fn outlines(&self) -> Vec<(String, Shape)> {
        Vec::new()
    }

    /// Growth cones that each axon may need besides its own, for branches.
    fn spare_cones(&self) -> u32 {
        0
    }

    /// How wrong what it solves on the mesh of a tissue at rest is estimated to be, one number a cell; none where it solves nothing.
    /// Asked only by a scene that refines its mesh.
    ///
    /// # Errors
    /// What cannot be solved.
    fn mesh_errors(&self, _tissue: &Tissue) -> Result<Vec<f64>, InstallError> {
        Ok(Vec::new())
    }

    /// Puts systems, resources and components in place.
    ///
    /// # Errors
    /// What keeps the mechanism from working in this scene.
    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError>;
}

/// Why a mechanism could not be installed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InstallError {
    /// The scenario is at fault, at a place relative to the mechanism's block.
    #[error("{0}")]
    Scenario(Violation),
    /// A solve failed.
    #[error("{0}")]
    Solve(String),
    /// What is solved takes more memory than there is.
    #[error("{0}")]
    NoRoom(String),
}

/// What a mechanism's check may know of the scene.
#[derive(Debug, Clone, Default)]
pub struct Facts {
    /// Names of the populations.
    pub populations: Vec<String>,
    /// Names of the tissue's edges; none if the tissue itself is wrong: they are not known then.
    pub edges: Vec<String>,
    /// The blocks of all mechanisms in the scene, as JSON.
    pub blocks: serde_json::Map<String, Value>,
    /// Length of the run (h).
    pub duration: f64,
    /// How large a mesh of the tissue may be.
    pub mesh_extent: MeshExtent,
    /// The laws of material the program has.
    pub materials: Materials,
}

impl Facts {
    /// Keys inside another mechanism's key, e.g. the names of the cues in `cues`.
    pub fn names_in(&self, block: &str) -> Vec<String> {
        match self.blocks.get(block) {
            Some(Value::Object(keys)) => keys.keys().cloned().collect(),
            _ => Vec::new(),
        }
    }
}

/// The sentence for a name that does not exist.
pub fn unknown_name(kind: &str, name: &str, valid: &[String]) -> String {
    match valid {
        [] => format!("there is no {kind} called `{name}`; the scene has none"),
        _ => format!("there is no {kind} called `{name}`; there are: {}", valid.join(", ")),
    }
}

/// The law of a mechanism as a resource: `Res<Law<Borders>>` reads the block of the scenario.
#[derive(Debug, Resource)]
pub struct Law<M: Send + Sync + 'static>(pub M);

impl<M: Send + Sync + 'static> Deref for Law<M> {
    type Target = M;

    fn deref(&self) -> &M {
        &self.0
    }
}

/// What mechanisms ask of providers: provider name → keys (a cue's name, say).
#[derive(Debug, Clone, Default, Resource)]
pub struct Demands(BTreeMap<String, BTreeSet<String>>);

impl Demands {
    /// The keys asked of a provider, in order.
    pub fn of(&self, provider: &str) -> Vec<String> {
        self.0.get(provider).map(|keys| keys.iter().cloned().collect()).unwrap_or_default()
    }
}

type Finisher = Box<dyn FnOnce(&mut World) -> Result<(), InstallError>>;
type Attacher = Box<dyn Fn(&mut World, &[bevy_ecs::entity::Entity])>;

/// Takes what a mechanism installs.
pub struct ModelBuilder<'a> {
    /// The world, with tissue, populations, growth and clock already in it.
    pub world: &'a mut World,
    schedules: &'a mut Schedules,
    slot: u32,
    name: &'static str,
    seed: u64,
    pub(crate) finishers: Vec<(&'static str, Finisher)>,
    pub(crate) attachers: Vec<Attacher>,
}

impl<'a> ModelBuilder<'a> {
    /// A builder over a world and its schedules.
    pub(crate) fn new(world: &'a mut World, schedules: &'a mut Schedules, seed: u64) -> Self {
        world.init_resource::<Demands>();
        world.init_resource::<Health>();
        world.init_resource::<Plan>();
        let kept = KeptState::of_core(world);
        world.insert_resource(kept);
        Self { world, schedules, slot: 0, name: "", seed, finishers: Vec::new(), attachers: Vec::new() }
    }

    /// Turns to the next mechanism of the roster.
    pub(crate) fn turn_to(&mut self, slot: u32, name: &'static str) {
        (self.slot, self.name) = (slot, name);
    }

    /// Inserts the law of the mechanism, to be read as `Res<Law<M>>`.
    pub fn insert_law<M: Mechanism>(&mut self, law: M) -> &mut Self {
        self.world.insert_resource(Law(law));
        self
    }

    /// Inserts a resource of the mechanism's own.
    pub fn insert<R: Resource>(&mut self, resource: R) -> &mut Self {
        self.world.insert_resource(resource);
        self
    }

    /// Runs a system in a term of the right-hand side, after those of the mechanisms before it in the roster.
    pub fn term<Marker>(&mut self, term: Term, system: impl IntoScheduleConfigs<ScheduleSystem, Marker>) -> &mut Self {
        let slot = Slot::Term(term, self.slot);
        let schedule = &mut self.schedules.right_hand_side;
        schedule.configure_sets(after(slot, (0..self.slot).map(|s| Slot::Term(term, s))).in_set(term));
        schedule.add_systems(system.in_set(slot));
        self
    }

    /// Runs a system in a phase of the step, after those of the mechanisms before it in the roster.
    pub fn phase<Marker>(
        &mut self,
        phase: Phase,
        system: impl IntoScheduleConfigs<ScheduleSystem, Marker>,
    ) -> &mut Self {
        let slot = Slot::Phase(phase, self.slot);
        let schedule = &mut self.schedules.step;
        schedule.configure_sets(after(slot, (0..self.slot).map(|s| Slot::Phase(phase, s))).in_set(phase));
        schedule.add_systems(system.in_set(slot));
        self
    }

    /// As [`Self::motion`], for a system that is known to turn no cell over: nobody looks after it.
    pub(crate) fn upright_motion<Marker>(
        &mut self,
        system: impl IntoScheduleConfigs<ScheduleSystem, Marker>,
    ) -> &mut Self {
        self.moved_by(system)
    }

    /// Runs a system that brings the tissue to the [stage time](super::clock::StageTime).
    pub fn motion<Marker>(&mut self, system: impl IntoScheduleConfigs<ScheduleSystem, Marker>) -> &mut Self {
        self.schedules.cells_may_turn_over = true;
        self.moved_by(system)
    }

    fn moved_by<Marker>(&mut self, system: impl IntoScheduleConfigs<ScheduleSystem, Marker>) -> &mut Self {
        let slot = Slot::Motion(self.slot);
        let schedule = &mut self.schedules.motion;
        schedule.configure_sets(after(slot, (0..self.slot).map(Slot::Motion)).in_set(Motion::Matrix));
        schedule.add_systems(system.in_set(slot));
        self
    }

    /// Tells that cones act on one another within a step, not by their shafts alone: where a tolerance chooses steps, they then
    /// take steps of one size.
    pub fn acts_between_cones(&mut self) -> &mut Self {
        if let Some(mut steps) = self.world.get_resource_mut::<AdaptiveSteps>() {
            steps.together = true;
        }
        self
    }

    /// Gives every growth cone a component of the mechanism's own, made from what the cone is.
    pub fn attach<C: Component>(&mut self, make: impl Fn(&GrowthCone) -> C + 'static) -> &mut Self {
        self.attachers.push(Box::new(move |world, cones| {
            for &cone in cones {
                let Some(own) = world.get::<GrowthCone>(cone).map(&make) else { continue };
                world.entity_mut(cone).insert(own);
            }
        }));
        self
    }

    /// Keeps a resource of the mechanism's own in checkpoints: needed where it depends on what happened before in the run. Types say
    /// how by [`kept!`](crate::kept!).
    pub fn keep<R: Resource<Mutability = Mutable> + Keep>(&mut self) -> &mut Self {
        let name = self.kept_name::<R>();
        self.world.resource_mut::<KeptState>().resource::<R>(&name);
        self
    }

    /// The same for a component that the mechanism has [attached](Self::attach) to growth cones.
    pub fn keep_of_cones<C: Component<Mutability = Mutable> + Keep>(&mut self) -> &mut Self {
        let name = self.kept_name::<C>();
        self.world.resource_mut::<KeptState>().of_cones::<C>(&name);
        self
    }

    /// Refuses a checkpoint unless `fits` says that a run of the scene may come to what was [kept](Self::keep) of `R`: for numbers of
    /// cells, shafts and the like, which are used without a further look. The core's own state has been looked at by then.
    pub fn sound_if<R>(&mut self, fits: fn(&World) -> bool) -> &mut Self {
        let name = self.kept_name::<R>();
        self.world.resource_mut::<KeptState>().sound_if(&name, fits);
        self
    }

    /// Runs `rebuild` when a run is resumed, once all that is kept has been read back: for what follows from it.
    pub fn rebuild(&mut self, rebuild: fn(&mut World)) -> &mut Self {
        self.world.resource_mut::<KeptState>().rebuilt_by(rebuild);
        self
    }

    fn kept_name<T>(&self) -> String {
        let path = std::any::type_name::<T>();
        format!("{}/{}", self.name, path.rsplit("::").next().unwrap_or(path))
    }

    /// Asks a provider (by its name) for one of its keys, so that it computes it; what nobody asks for is not computed.
    pub fn demand(&mut self, provider: &str, key: &str) -> &mut Self {
        let mut demands = self.world.resource_mut::<Demands>();
        demands.0.entry(provider.to_owned()).or_default().insert(key.to_owned());
        self
    }

    /// The plan of the scene, to say what is kept or left out, and how near limits are.
    pub fn plan(&mut self) -> bevy_ecs::prelude::Mut<'_, Plan> {
        self.world.resource_mut::<Plan>()
    }

    /// Says how strong a pull |L̂| the mechanism adds at most; the plan judges explicit methods by the sum.
    pub fn pulls_up_to(&mut self, strongest: f64) -> &mut Self {
        self.plan().strongest_pull += strongest;
        self
    }

    /// Runs `finish` when every mechanism is installed: when a provider knows what is asked of it.
    pub fn at_end(&mut self, finish: impl FnOnce(&mut World) -> Result<(), InstallError> + 'static) -> &mut Self {
        self.finishers.push((self.name, Box::new(finish)));
        self
    }

    /// The mechanism's own random stream.
    pub fn stream(&self) -> Stream {
        Stream::named(self.name)
    }

    /// The seed of the run.
    pub fn seed(&self) -> u64 {
        self.seed
    }
}

fn after<S: SystemSet + Copy>(
    slot: S,
    earlier: impl Iterator<Item = S>,
) -> bevy_ecs::schedule::ScheduleConfigs<bevy_ecs::schedule::InternedSystemSet> {
    earlier.fold(slot.into_configs(), |configs, earlier| configs.after(earlier))
}

/// A mechanism read from a scenario, ready to be installed.
pub(crate) trait Installable {
    fn check(&self, facts: &Facts) -> Violations;
    fn outlines(&self) -> Vec<(String, Shape)>;
    fn spare_cones(&self) -> u32;
    fn mesh_errors(&self, tissue: &Tissue) -> Result<Vec<f64>, InstallError>;
    fn install(self: Box<Self>, model: &mut ModelBuilder) -> Result<(), InstallError>;
}

impl<M: Mechanism> Installable for M {
    fn check(&self, facts: &Facts) -> Violations {
        Mechanism::check(self, facts)
    }

    fn outlines(&self) -> Vec<(String, Shape)> {
        Mechanism::outlines(self)
    }

    fn spare_cones(&self) -> u32 {
        Mechanism::spare_cones(self)
    }

    fn mesh_errors(&self, tissue: &Tissue) -> Result<Vec<f64>, InstallError> {
        Mechanism::mesh_errors(self, tissue)
    }

    fn install(self: Box<Self>, model: &mut ModelBuilder) -> Result<(), InstallError> {
        Mechanism::install(*self, model)
    }
}

type Reader = fn(&Value) -> Result<Box<dyn Installable>, String>;

/// One line of the roster.
#[derive(Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) name: &'static str,
    pub(crate) schema: fn() -> Value,
    pub(crate) read: Reader,
}

/// The mechanisms a program has, in order of summation, and its laws of material. The roster is the only list of them.
#[derive(Clone, Default)]
pub struct Roster {
    pub(crate) entries: Vec<Entry>,
    materials: Materials,
}

impl Roster {
    /// An empty roster.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a mechanism at the end. One that has the name of an earlier one takes its place.
    pub fn with<M: Mechanism>(mut self) -> Self {
        let entry = Entry {
            name: M::NAME,
            schema: || schemars::schema_for!(M).into(),
            read: |value| {
                serde_path_to_error::deserialize::<_, M>(value)
                    .map(|law| Box::new(law) as Box<dyn Installable>)
                    .map_err(|error| error.to_string())
            },
        };
        match self.entries.iter_mut().find(|other| other.name == M::NAME) {
            Some(other) => *other = entry,
            None => self.entries.push(entry),
        }
        self
    }

    /// Adds a law that `matrix.material` may name. One that has the name of an earlier one takes its place.
    pub fn with_material<M: MaterialLaw>(mut self) -> Self {
        self.materials.add::<M>();
        self
    }

    /// Names of the mechanisms, in order.
    pub fn names(&self) -> Vec<&'static str> {
        self.entries.iter().map(|entry| entry.name).collect()
    }

    /// The laws of material.
    pub fn materials(&self) -> &Materials {
        &self.materials
    }

    /// The schema of a mechanism's block, with the laws of material in it.
    pub(crate) fn schema(&self, entry: &Entry) -> Value {
        let mut schema = (entry.schema)();
        self.materials.complete(&mut schema);
        schema
    }
}
