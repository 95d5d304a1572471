//! Ablation as a kind of run: which arms there are, what they say, and what they share.

mod common;

use common::{Folder, hash_of_states, loaded, observed, recorded, to_end, try_load};
use serde_json::{Value, json};
use tropism::model::health::Counters;
use tropism::prelude::*;
use tropism::scenario::load::Loaded;
use tropism::simulation::Simulation;
use tropism::study::ablation::{Ablation, Arm, Extent, FULL, ablate, report};
use tropism::study::report::Asked;
use tropism::systems;

fn scene() -> Value {
    json!({
        "seed": 5,
        "tissue": { "outline": { "rectangle": { "width": 200, "height": 150 } }, "mesh_size": 25 },
        "time": { "duration": 4, "step": "6 min" },
        "populations": { "axons": { "count": 8, "births": { "uniform": { "from": 0, "to": 1 } } } },
        "targets": { "bulb": { "disc": { "centre": [100, 50], "radius": 25 } } },
        "matrix": { "motion": { "top": { "outward": 0.1 }, "bottom": { "outward": 0.1 } } },
        "cues": { "attractant": { "sources": [{ "disc": { "centre": [100, 110], "radius": 20 } }] } },
        "chemotaxis": { "receptors": { "attractant": {} } },
        "borders": {}
    })
}

fn arms_of(scene: &Value, roster: &Roster, seeds: u64, pairs: bool) -> Ablation {
    of_loaded(&loaded(scene, roster), roster, Extent { seeds, pairs })
}

fn of_loaded(loaded: &Loaded, roster: &Roster, extent: Extent) -> Ablation {
    ablate(loaded, roster, "scene.json".as_ref(), extent, (|_| {}, || None)).unwrap_or_else(|error| panic!("{error}"))
}

fn arm<'a>(ablation: &'a Ablation, name: &str) -> &'a Arm {
    let names = || ablation.arms.iter().map(|arm| arm.name.as_str()).collect::<Vec<_>>();
    ablation.arms.iter().find(|arm| arm.name == name).unwrap_or_else(|| panic!("no arm {name} among {:?}", names()))
}

fn lengths(arm: &Arm) -> Vec<f64> {
    arm.values["length_um.mean"].iter().map(|value| value.unwrap()).collect()
}

#[test]
fn the_arms_are_the_blocks_of_the_scene_in_the_order_of_the_roster_and_then_their_pairs() {
    let roster = systems::standard();
    let found = arms_of(&scene(), &roster, 1, true);
    let off: Vec<_> = found.arms.iter().map(|arm| arm.off.join("+")).collect();
    let expected = [
        "",
        "matrix",
        "cues",
        "chemotaxis",
        "borders",
        "matrix+cues",
        "matrix+chemotaxis",
        "matrix+borders",
        "cues+chemotaxis",
        "cues+borders",
        "chemotaxis+borders",
    ];
    assert_eq!(off, expected);
    assert_eq!(found.arms[0].name, FULL);
    assert_eq!(found.arms[8].name, "without cues and chemotaxis");
    // What another block needs cannot go alone, and goes with it.
    for arm in &found.arms {
        let lost = arm.off.contains(&"cues".to_owned()) && !arm.off.contains(&"chemotaxis".to_owned());
        assert_eq!(arm.skipped.is_some(), lost, "{}", arm.name);
        assert_eq!(arm.complete, !lost, "{}", arm.name);
    }
    let reason = arm(&found, "without cues").skipped.clone().unwrap();
    assert!(reason.starts_with("/chemotaxis: the scene has no cues"), "{reason}");
    assert!(found.complete, "an arm that is skipped is no failure");
    // One seed has differences, but no interval.
    let difference = arm(&found, "without matrix").differences["length_um.mean"];
    assert!(difference.mean != 0.0 && difference.low.is_none() && difference.high.is_none());
    assert!(!arm(&found, "without matrix").differs("length_um.mean"));
    let single = arms_of(&scene(), &roster, 1, false);
    let names = |ablation: &Ablation| ablation.arms.iter().map(|arm| arm.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&single), names(&found)[..5]);
}

#[test]
fn an_arm_has_the_measures_of_a_plain_run_without_the_mechanism() {
    let roster = systems::standard();
    let found = arms_of(&scene(), &roster, 2, false);
    for (name, off) in [(FULL, vec![]), ("without matrix", vec!["matrix"]), ("without borders", vec!["borders"])] {
        for (place, seed) in ["/seed=5", "/seed=6"].into_iter().enumerate() {
            let plain = recorded(&try_load(&scene(), &roster, &off, &[seed]).unwrap(), &roster).summary;
            let of = |measure: &str| arm(&found, name).values[measure][place].unwrap();
            let height = &plain.morphology.heights[0];
            assert_eq!(of("length_um.mean"), plain.morphology.length_um.unwrap().mean, "{name}");
            assert_eq!(of("turning_angle_deg.sd"), plain.morphology.turning_angle_deg.unwrap().sd.unwrap(), "{name}");
            assert_eq!(of("heights.0.spread_um"), height.spread_um.unwrap(), "{name}");
            assert_eq!(of("hits.fraction"), plain.morphology.hits.fraction.unwrap(), "{name}");
            assert_eq!(of("counts.arrived"), plain.counts.arrived as f64, "{name}");
        }
    }
    let full = lengths(&found.arms[0]);
    let own = lengths(arm(&found, "without matrix"));
    let mean = (own[0] - full[0] + own[1] - full[1]) / 2.0;
    let difference = arm(&found, "without matrix").differences["length_um.mean"];
    assert!((difference.mean - mean).abs() < 1e-12 && difference.n == 2, "{difference:?}");
    assert!(difference.low.unwrap() <= mean && mean <= difference.high.unwrap());
}

#[test]
fn a_key_that_is_set_does_not_bring_a_mechanism_back() {
    let roster = systems::standard();
    let set = try_load(&scene(), &roster, &[], &["/borders/weight=3"]).unwrap();
    let found = of_loaded(&set, &roster, Extent { seeds: 1, pairs: false });
    let plain = arms_of(&scene(), &roster, 1, false);
    assert_eq!(lengths(arm(&found, "without borders")), lengths(arm(&plain, "without borders")));
    assert_ne!(lengths(&found.arms[0]), lengths(&plain.arms[0]), "the key must matter where the block is on");
}

#[test]
fn an_arm_that_is_the_full_model_differs_by_exactly_nothing() {
    let roster = systems::standard();
    let mut scene = scene();
    scene["matrix"] = json!({ "motion": { "top": { "outward": 0.0 } } });
    let found = arms_of(&scene, &roster, 3, false);
    let same = arm(&found, "without matrix");
    assert!(same.differences.len() > 20);
    for (measure, difference) in &same.differences {
        // Not every run has every measure: one fascicle at a height in one seed has a mean size and no interval.
        let end = (difference.n > 1).then_some(0.0);
        assert_eq!((difference.mean, difference.low, difference.high), (0.0, end, end), "{measure}");
        assert!(!same.differs(measure));
    }
    assert!(found.arms[0].differences.is_empty(), "the full model is the control");
    let told = |arm: &Arm| arm.differences.keys().any(|measure| arm.differs(measure));
    assert!(told(arm(&found, "without chemotaxis")), "the scene is too mild to tell anything");
    let table = found.to_string();
    assert!(table.contains("  0.0 [0.0, 0.0]  "), "{table}");
}

keys! {
    /// Holds `fragile` together.
    pub struct Prop {}

    /// Fails without `prop`.
    pub struct Fragile {
        /// Whether it fails while running; otherwise when it is put together.
        pub late: bool = false,
    }
}

impl Mechanism for Prop {
    const NAME: &'static str = "prop";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        model.insert_law(self);
        Ok(())
    }
}

impl Mechanism for Fragile {
    const NAME: &'static str = "fragile";

    fn install(self, model: &mut ModelBuilder) -> Result<(), InstallError> {
        if model.world.contains_resource::<Law<Prop>>() {
            return Ok(());
        }
        if !self.late {
            return Err(InstallError::Solve("nothing holds it".into()));
        }
        model.phase(Phase::Remodel, |clock: Res<Clock>, mut health: ResMut<Health>| {
            if clock.hours() > 2.0 {
                health.report(clock.hours(), "it broke");
            }
        });
        Ok(())
    }
}

#[test]
fn an_arm_that_fails_is_reported_while_the_others_finish() {
    let roster = systems::standard().with::<Prop>().with::<Fragile>();
    for (late, account) in [(false, "nothing holds it"), (true, "it broke")] {
        let mut scene = scene();
        scene["prop"] = json!({});
        scene["fragile"] = json!({ "late": late });
        let found = arms_of(&scene, &roster, 2, false);
        assert!(!found.complete);
        let failed = arm(&found, "without prop");
        assert_eq!((failed.complete, failed.status(), failed.failures.len()), (false, "failed", 2));
        assert!(failed.failures[1].account.contains(account) && failed.failures[1].seed == 6, "{:?}", failed.failures);
        assert!(failed.measures.is_empty() && failed.end.is_none(), "a run cut short is not compared");
        for name in [FULL, "without matrix", "without fragile"] {
            assert!(arm(&found, name).complete && arm(&found, name).measures["length_um.mean"].n == 2, "{name}");
        }
        let table = found.to_string();
        assert!(table.contains("without prop failed for 2 of 2 seeds; seed 5: ") && table.contains(account), "{table}");
        let folder = Folder::new();
        report::write(&folder.0, Asked { loaded: &loaded(&scene, &roster), command: "" }, &found).unwrap();
        let rows = std::fs::read_to_string(folder.0.join("ablation.csv")).unwrap();
        assert!(rows.contains("\nwithout prop,failed,,,,,,,,,,,\n"), "{rows}");
    }
}

#[test]
fn the_files_say_what_the_arms_are() {
    let roster = systems::standard();
    let loaded = loaded(&scene(), &roster);
    let found = of_loaded(&loaded, &roster, Extent { seeds: 2, pairs: false });
    let folder = Folder::new();
    report::write(&folder.0, Asked { loaded: &loaded, command: "" }, &found).unwrap();
    let read = |name: &str| std::fs::read_to_string(folder.0.join(name)).unwrap();
    let document: Value = serde_json::from_str(&read("ablation.json")).unwrap();
    assert_eq!((&document["seeds"], &document["complete"]), (&json!([5, 6]), &json!(true)));
    let without = &document["arms"][1];
    assert_eq!((&without["name"], &without["off"]), (&json!("without matrix"), &json!(["matrix"])));
    for (part, keys) in [("measures", ["mean", "low", "high"]), ("differences", ["mean", "low", "high"])] {
        assert!(keys.iter().all(|key| without[part]["length_um.mean"][key].is_f64()), "{part}");
    }
    assert_eq!(without["values"]["length_um.mean"].as_array().unwrap().len(), 2);
    assert!(document["arms"][2]["skipped"].is_string() && document["arms"][2]["failures"] == json!([]));
    let table = read("ablation.csv");
    let head = table.lines().next().unwrap();
    assert!(head.starts_with("arm,status,measure,unit,n [seeds],mean [unit],"), "{head}");
    assert!(table.contains("\nwithout matrix,complete,length_um.mean,um,2,") && !table.contains("NaN"));
    assert!(table.lines().all(|line| line.split(',').count() == 13));
    let page = read("report.html");
    assert!(
        page.contains("id=\"recording-1\" data-label=\"without matrix\"") && page.contains("\"kind\":\"ablation\"")
    );
    assert_eq!(page.matches("application/octet-stream").count(), found.arms.iter().filter(|arm| arm.complete).count());
    let figure = read("figure.svg");
    assert!(figure.contains("without matrix") && !figure.contains("without cues"), "one panel an arm that ran");
    assert_eq!(&std::fs::read(folder.0.join("figure.png")).unwrap()[..8], b"\x89PNG\r\n\x1a\n");
    assert!(folder.0.join("manifest.json").exists());
}

fn put_together(shelf: &Shelf, without: &[&str], set: &[&str]) -> Simulation {
    let roster = systems::standard();
    let loaded = try_load(&scene(), &roster, without, set).unwrap();
    Simulation::assemble_from(&loaded, &roster, shelf).unwrap_or_else(|error| panic!("{error}"))
}

fn solves(simulation: &Simulation) -> (u64, u64) {
    let Counters { matrix_solves, cue_solves, .. } = simulation.counters();
    (matrix_solves, cue_solves)
}

#[test]
fn equal_inputs_are_solved_once_and_give_the_same_bits() {
    let shelf = Shelf::default();
    let first = solves(&put_together(&shelf, &[], &[]));
    assert!(first.0 > 0 && first.1 > 0);
    for (without, set) in
        [(vec![], "/seed=6"), (vec!["borders"], "/time/step=0.05"), (vec![], "/growth/turning_rate=1")]
    {
        assert_eq!(solves(&put_together(&shelf, &without, &[set])), (0, 0), "{without:?} {set}");
    }
    // A field at rest is another field; a mesh fitted to other shapes, or of another size, is another tissue.
    assert_eq!(solves(&put_together(&shelf, &["matrix"], &[])), (0, 1));
    assert_eq!(solves(&put_together(&shelf, &["chemotaxis"], &[])), (0, 0));
    assert_eq!(solves(&put_together(&shelf, &[], &["/cues/attractant/degradation=2"])).0, 0);
    for set in ["/targets/bulb/disc/radius=24", "/tissue/mesh_size=24", "/matrix/poisson_ratio=0.2"] {
        let (equilibria, fields) = solves(&put_together(&shelf, &[], &[set]));
        assert!(equilibria > 0 && fields > 0, "{set}");
    }
    let roster = systems::standard();
    let (_, alone) = observed(&loaded(&scene(), &roster), &roster);
    let mut shared = put_together(&shelf, &[], &[]);
    to_end(&mut shared);
    assert_eq!(hash_of_states(shared.world()), hash_of_states(alone.world()));
    let plans = [&shared, &alone].map(|run| serde_json::to_string(run.world().resource::<Plan>()).unwrap());
    assert_eq!(plans[0], plans[1], "what is shared is told as if it were the run's own");
}

#[test]
fn all_seeds_and_arms_share_what_is_solved() {
    let roster = systems::standard();
    let one = solves(&put_together(&Shelf::default(), &[], &[]));
    let found = arms_of(&scene(), &roster, 3, false);
    assert_eq!(found.runs, 12);
    assert_eq!(found.solved.matrix_solves, one.0, "one path for all arms that have a matrix");
    assert_eq!(found.solved.cue_solves, one.1 + 1, "one path, and one field at rest");
}
