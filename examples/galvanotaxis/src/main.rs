//! tropism with one more mechanism: `galvanotaxis`.

mod galvanotaxis;

use std::process::ExitCode;
use tropism::prelude::Roster;

fn roster() -> Roster {
    tropism::standard().with::<galvanotaxis::Galvanotaxis>()
}

fn main() -> ExitCode {
    tropism::run(std::env::args_os(), roster())
}

#[cfg(test)]
mod tests {
    use super::roster;
    use std::path::Path;
    use std::process::ExitCode;

    /// The trajectories of a scenario with some arguments more.
    fn trajectories(scenario: &str, name: &str, more: &[&str]) -> String {
        let scenario = format!("{}/scenarios/{scenario}.json", env!("CARGO_MANIFEST_DIR"));
        let folder = format!("galvanotaxis-{}-{name}", std::process::id());
        let out = std::env::temp_dir().join(folder);
        let shortened = ["--set", "/time/duration=4", "--out"];
        let arguments = ["galvanotaxis", &scenario].into_iter().chain(shortened).map(Path::new);
        let arguments = arguments.chain([out.as_path()]).chain(more.iter().map(Path::new));
        let code = tropism::run(arguments, roster());
        assert_eq!(format!("{code:?}"), format!("{:?}", ExitCode::SUCCESS));
        let table = std::fs::read_to_string(out.join("trajectories.csv")).unwrap();
        std::fs::remove_dir_all(out).unwrap();
        table
    }

    #[test]
    fn a_weight_of_zero_or_a_field_too_weak_gives_the_bits_of_absence_and_any_other_does_not() {
        let run = |name: &str, more: &[&str]| trajectories("galvanotaxis", name, more);
        let absent = run("absent", &["--without", "galvanotaxis"]);
        assert!(run("zero", &["--set", "/galvanotaxis/weight=0"]) == absent);
        assert!(run("weak", &["--set", "/galvanotaxis/field=6.9"]) == absent);
        assert!(run("felt", &["--set", "/galvanotaxis/field=7"]) != absent);
    }

    /// Positions (um) of the one axon of the scenario `one_axon`, relative to its birth place, and headings (degrees).
    fn path(name: &str, heading: f64, cathode: f64) -> Vec<[f64; 3]> {
        let set = [format!("/populations/axon/heading={heading}"), format!("/galvanotaxis/cathode={cathode}")];
        let table = trajectories("one_axon", name, &["--set", &set[0], "--set", &set[1]]);
        let number = |entry: &str| entry.parse::<f64>().unwrap();
        let row = |line: &str| {
            let entries: Vec<&str> = line.split(',').collect();
            [number(entries[3]) - 200.0, number(entries[4]) - 200.0, number(entries[5])]
        };
        table.lines().skip(1).map(row).collect()
    }

    #[test]
    fn turning_field_and_heading_turns_the_path() {
        let (plain, turned) = (path("plain", 120.0, 10.0), path("turned", 157.0, 47.0));
        let (sine, cosine) = 37f64.to_radians().sin_cos();
        assert!(plain.len() == turned.len() && plain.len() > 20);
        for (a, b) in plain.iter().zip(&turned) {
            let expected = [cosine * a[0] - sine * a[1], sine * a[0] + cosine * a[1]];
            assert!((expected[0] - b[0]).hypot(expected[1] - b[1]) < 0.01, "{a:?} {b:?}");
            assert!(((b[2] - a[2] - 37.0 + 180.0).rem_euclid(360.0) - 180.0).abs() < 0.01);
        }
        let last = plain[plain.len() - 1];
        assert!(last[0].hypot(last[1]) > 50.0, "the path must be long enough to tell");
    }

    /// The derive macros name `bevy_ecs`, which comes with the prelude.
    mod own {
        use tropism::prelude::*;

        #[derive(Debug, PartialEq, Resource)]
        pub struct Amplifier(pub f64);

        #[derive(Debug, PartialEq, Component)]
        pub struct Reading(pub f64);
    }

    #[test]
    fn a_resource_and_a_component_of_its_own_take_no_other_dependency() {
        let mut world = tropism::prelude::World::new();
        world.insert_resource(own::Amplifier(1.0));
        let cone = world.spawn(own::Reading(2.0)).id();
        assert_eq!(world.resource::<own::Amplifier>(), &own::Amplifier(1.0));
        assert_eq!(world.get::<own::Reading>(cone), Some(&own::Reading(2.0)));
    }
}
