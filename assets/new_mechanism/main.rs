//! tropism with one more mechanism: `steady_pull`.

mod steady_pull;

use std::process::ExitCode;
use tropism::prelude::Roster;

fn roster() -> Roster {
    tropism::standard().with::<steady_pull::SteadyPull>()
}

fn main() -> ExitCode {
    tropism::run(std::env::args_os(), roster())
}

#[cfg(test)]
mod tests {
    use super::roster;
    use std::path::Path;
    use std::process::ExitCode;

    /// The trajectories of the scenario with some arguments more.
    fn trajectories(name: &str, more: &[&str]) -> String {
        let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/steady_pull.json");
        let folder = format!("steady_pull-{}-{name}", std::process::id());
        let out = std::env::temp_dir().join(folder);
        let shortened = ["--set", "/time/duration=4", "--out"];
        let arguments = ["steady_pull", scenario].into_iter().chain(shortened).map(Path::new);
        let arguments = arguments.chain([out.as_path()]).chain(more.iter().map(Path::new));
        let code = tropism::run(arguments, roster());
        assert_eq!(format!("{code:?}"), format!("{:?}", ExitCode::SUCCESS));
        let table = std::fs::read_to_string(out.join("trajectories.csv")).unwrap();
        std::fs::remove_dir_all(out).unwrap();
        table
    }

    #[test]
    fn a_weight_of_zero_gives_the_bits_of_absence_and_any_other_does_not() {
        let absent = trajectories("absent", &["--without", "steady_pull"]);
        assert!(trajectories("zero", &["--set", "/steady_pull/weight=0"]) == absent);
        assert!(trajectories("default", &[]) != absent);
    }
}
