//! Retraction: growth cones that collapse at a repellent draw back and set out again; those that find no target are withdrawn.
//!
//! A cone draws back along its own shaft with speed v_r,
//!
//! ```text
//! ds/dt = −v_r,
//! ```
//!
//! which strikes out what it had laid. Collapse: where a cue exceeds a concentration, by a distance (Luo, Raible and Raper, Cell 75, 1993,
//! doi:10.1016/0092-8674(93)80064-L, collapse by collapsin; the distance is ours). Pruning: a cone that has not arrived a given time after its birth
//! draws back until it is gone (Luo and O'Leary, Annu. Rev. Neurosci. 28, 2005, doi:10.1146/annurev.neuro.28.061604.135632; the rule is ours).
//! A fork whose branch still stands holds the cone, which stalls there: a trunk does not leave its branches behind.

use super::cue_fields::Cues;
use crate::prelude::*;

keys! {
    /// Drawing back along the own shaft; ds/dt = −v_r.
    pub struct Retraction {
        /// Speed v_r. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [10.0, 200.0]))]
        pub speed: Speed = Speed(60.0),
        /// How long after its birth a cone is withdrawn that has not arrived; without it none is.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 100.0]))]
        pub prune_after: Option<Time> = None,
        /// Where cones collapse; without it they do not.
        pub collapse: Option<Collapse> = None,
    }
}

keys! {
    /// Collapse at a cue.
    pub struct Collapse {
        /// The cue.
        pub cue: String = String::new(),
        /// Concentration above which a cone collapses.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [1.0, 100.0]))]
        pub above: Concentration = Concentration(20.0),
        /// How far it draws back before it sets out again. Ours.
        #[schemars(extend("exclusiveMinimum" = 0.0, "x-typical" = [5.0, 100.0]))]
        pub distance: Length = Length(20.0),
    }
}

/// How far (µm) a cone has yet to draw back.
#[derive(Debug, Clone, Copy, Default, Component)]
struct Retreat {
    left: f64,
}

kept! { struct Retreat { left } }

/// When cones last drew back (h).
#[derive(Debug, Clone, Copy, Default, Resource)]
struct Retreats {
    last: f64,
}

kept! { struct Retreats { last } }

/// The number of the cue at which cones collapse, if they do.
#[derive(Debug, Clone, Copy, Resource)]
struct CollapseCue(Option<usize>);

impl Mechanism for Retraction {
    const NAME: &'static str = "retraction";

    fn check(&self, facts: &Facts) -> Violations {
        let mut wrong = Violations::new();
        wrong.demand(self.prune_after.is_some() || self.collapse.is_some(), "", || {
            "give `prune_after`, such as \"30 h\", or `collapse`, such as {\"cue\": \"repellent\"}; else nothing draws back".into()
        });
        if let Some(collapse) = &self.collapse {
            Cues::demand_known(facts, &mut wrong, &collapse.cue, "/collapse/cue");
        }
        wrong
    }

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        let cue = self.collapse.as_ref().map(|collapse| collapse.cue.clone());
        if let Some(cue) = &cue {
            CueFields::demand(model, cue);
        }
        model.attach(|_: &GrowthCone| Retreat::default());
        model.insert(Retreats::default()).keep_of_cones::<Retreat>().keep::<Retreats>();
        model.sound_if::<Retreats>(|world| {
            let now = world.resource::<Clock>().hours();
            world.get_resource::<Retreats>().is_some_and(|retreats| (0.0..=now).contains(&retreats.last))
        });
        model.at_end(move |world| {
            let cue = cue.map(|cue| CueFields::number(world, &cue, "/collapse/cue")).transpose()?;
            world.insert_resource(CollapseCue(cue));
            Ok(())
        });
        model.insert_law(self).phase(Phase::Remodel, retract);
        Ok(())
    }
}

/// What becomes of a cone at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Course {
    /// It goes on with what it does.
    On,
    /// It begins to draw back, this far (µm).
    Back(f64),
}

impl Retraction {
    /// Whether a cone that has not arrived at an age (h) is withdrawn.
    fn is_lost(&self, age: f64) -> bool {
        self.prune_after.is_some_and(|after| age >= after.0)
    }
}

/// What a standing cone does next: `age` (h) since its birth, `concentration` (nM) of the cue of collapse where it is.
fn course(law: &Retraction, status: Status, age: f64, concentration: f64) -> Course {
    match status {
        Status::Growing | Status::Stalled if law.is_lost(age) => Course::Back(f64::INFINITY),
        Status::Growing => match &law.collapse {
            Some(collapse) if concentration > collapse.above.0 => Course::Back(collapse.distance.0),
            _ => Course::On,
        },
        _ => Course::On,
    }
}

fn retract(
    law: Res<Law<Retraction>>,
    mut retreats: ResMut<Retreats>,
    (fields, cue): (Option<Res<CueFields>>, Res<CollapseCue>),
    mut retreating: Query<&mut Retreat>,
    mut remodelling: Remodelling,
) {
    let now = remodelling.clock.hours();
    let step = law.speed.0 * (now - std::mem::replace(&mut retreats.last, now));
    let Ok(mut tables) = retreating.contiguous_iter_mut() else { return };
    let Some(mut retreat) = tables.next() else { return };
    for (i, cone) in remodelling.standing().iter().enumerate() {
        let concentration = match (&fields, cue.0) {
            (Some(fields), Some(cue)) if cone.status == Status::Growing => {
                fields.sample(&remodelling.tissue.mesh, cue, cone.site).concentration
            }
            _ => 0.0,
        };
        let age = now - cone.identity.birth_time(&remodelling.clock.grid);
        if cone.status == Status::Retracting {
            retreat[i].left = draw_back(&mut remodelling, cone, (retreat[i].left, step));
        } else if let Course::Back(by) = course(&law, cone.status, age, concentration)
            && !(cone.status == Status::Stalled && remodelling.is_held(i as u32))
        {
            retreat[i].left = by;
            remodelling.set_status(i as u32, Status::Retracting);
            remodelling.unrest.0 = true;
        }
        let waits = cone.status == Status::Stalled && law.prune_after.is_some() && !law.is_lost(age);
        remodelling.unrest.0 |= waits || matches!(cone.status, Status::Growing | Status::Retracting);
    }
}

/// Draws a cone back by a step (µm) of what is left; returns what is left then. One that has come as far as it was to sets out again; one
/// that is to go and has come to its origin is gone.
fn draw_back(remodelling: &mut Remodelling, cone: &Standing, (left, step): (f64, f64)) -> f64 {
    let number = cone.identity.axon;
    let by = left.min(step);
    let short = remodelling.draw_back(number, by);
    let rest = left - by;
    if left.is_infinite() {
        if short > 0.0 {
            let gone = remodelling.is_at_origin(number);
            remodelling.set_status(number, if gone { Status::Withdrawn } else { Status::Stalled });
        }
    } else if rest <= 0.0 || short > 0.0 {
        remodelling.set_status(number, Status::Growing);
    }
    rest
}
