//! The command line: arguments in, exit code out.
//!
//! Exit codes: 0 done; 1 a fault while solving, running or writing; 2 a bad scenario or bad arguments.

use crate::model::mechanism::Roster;
use crate::new_mechanism::{NewMechanism, NewMechanismError};
use crate::record::manifest::Manifest;
use crate::record::output::prepare_folder;
use crate::scenario::catalogue::Catalogue;
use crate::scenario::editor_schema::editor_schema;
use crate::scenario::load::{Loaded, Request};
use crate::scenario::schema::top_keys;
use crate::study::ablation::{self, Extent};
use crate::study::accuracy;
use crate::study::bench;
use crate::study::chart;
use crate::study::laboratory::Laboratory;
use crate::study::plan::plan;
use crate::study::run::{RunError, block_schemas, folder_of, simulate, write_figure, write_json, write_results};
use crate::study::seeds::{over_seeds, summarise};
use crate::study::stability::Stability;
use clap::{Args, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Simulates how axons find their way: runs a scenario and writes its results into out/<scene>/.
#[derive(Debug, Parser)]
#[command(name = "tropism", version, after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
#[command(subcommand_negates_reqs = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Folder of the results [default: out/<scene>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run N seeds, from the scenario's seed on, and report means with bootstrap intervals
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    seeds: Option<u64>,
    /// Threads to use; results do not depend on it [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Says what a scene needs and what it does not, and how near its limits are; takes no step
    Plan {
        #[command(flatten)]
        scene: SceneArguments,
        /// Print the plan as JSON
        #[arg(long)]
        json: bool,
        /// Threads to use; the plan does not depend on it [default: all]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
        threads: Option<u32>,
    },
    /// Runs the scene without each of its mechanisms, with the same random numbers, and tables what that changes
    Ablate {
        #[command(flatten)]
        scene: SceneArguments,
        /// Folder of the results [default: out/<scene>-ablation]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Seeds of each arm, from the scenario's seed on
        #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=100_000))]
        seeds: u64,
        /// Leave out each pair of mechanisms too
        #[arg(long)]
        pairs: bool,
        /// Threads to use; results do not depend on it [default: all]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
        threads: Option<u32>,
    },
    /// Charts error against time for every choice a scene offers
    Chart {
        #[command(flatten)]
        scene: SceneArguments,
        /// Folder of the results [default: out/<scene>-chart]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Only this factor (repeatable)
        #[arg(long, value_name = "FACTOR", value_parser = chart::FACTORS)]
        only: Vec<String>,
        /// How often each setting is timed
        #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
        repetitions: u32,
        /// Seeds for the measures of the whole scene
        #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(2..=1000))]
        seeds: u64,
        /// Threads to use [default: all]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
        threads: Option<u32>,
    },
    /// Times a scene that scales by the key parameters/axons, beside a plain loop over arrays of the same mathematics
    Bench {
        #[command(flatten)]
        scene: SceneArguments,
        /// Folder of the results [default: out/<scene>-bench]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Numbers of axons
        #[arg(long, value_name = "N,N,…", value_delimiter = ',', default_values_t = [1000, 10_000, 100_000], value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
        axons: Vec<u64>,
        /// How often each is timed, up to 50 000 axons
        #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
        repetitions: u32,
        /// Threads of the simulation; the plain loop has one
        #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
        threads: u32,
    },
    /// Maps where methods fail, and what the program then does: numbers and a figure a map
    Stability {
        /// Folder of the results
        #[arg(long, value_name = "DIR", default_value = "out/stability")]
        out: PathBuf,
    },
    /// Lists the mechanisms of this program, each with its equation and its keys: unit, ranges, default
    Mechanisms {
        /// Only this one; `scene` for the keys that belong to no mechanism
        name: Option<String>,
        /// Print the list as JSON
        #[arg(long)]
        json: bool,
    },
    /// Prints the JSON Schema of a scenario, with every mechanism in it, for editors to complete and check by
    Schema,
    /// Writes a crate with a mechanism of your own, which builds, runs and is tested as it is
    NewMechanism {
        /// Name of the mechanism and its crate: small letters, digits, underscores
        name: String,
        /// Folder in which the crate's folder is made
        #[arg(long, value_name = "DIR", default_value = ".")]
        path: PathBuf,
        /// Sources of tropism [default: those that this program was built from]
        #[arg(long, value_name = "PATH")]
        tropism: Option<PathBuf>,
    },
}

/// A scenario and what is changed in it.
#[derive(Debug, Args)]
struct SceneArguments {
    /// The scenario, a JSON file
    #[arg(required = true)]
    scenario: Option<PathBuf>,
    /// Leave a mechanism out, as if the scenario had no such block (repeatable)
    #[arg(long, value_name = "NAME")]
    without: Vec<String>,
    /// Set one key, named by its JSON pointer (repeatable)
    #[arg(long, value_name = "/POINTER=VALUE")]
    set: Vec<String>,
}

impl SceneArguments {
    fn path(&self) -> PathBuf {
        self.scenario.clone().unwrap_or_default()
    }

    /// The scene with the keys that its accuracy asks for, and the request that gives it.
    fn settled(&self, roster: &Roster) -> Result<(Request, Loaded), RunError> {
        let request = Request { path: self.path(), without: self.without.clone(), set: self.set.clone() };
        let (request, loaded) = accuracy::settled(&request, roster)?;
        for hint in &loaded.hints {
            eprintln!("hint: {hint}");
        }
        Ok((request, loaded))
    }

    fn load(&self, roster: &Roster) -> Result<Loaded, RunError> {
        Ok(self.settled(roster)?.1)
    }
}

const EXAMPLES: &str = "Examples:
  tropism scenarios/olfactory.json                       the complete model
  tropism scenarios/olfactory.json --without chemotaxis  an ablation
  tropism scenarios/olfactory.json --set /seed=7 --set /populations/olfactory/count=50
  tropism scenarios/olfactory.json --seeds 20 --out out/olfactory-20
  tropism plan scenarios/olfactory.json                  what it needs, before it runs
  tropism ablate scenarios/olfactory.json --seeds 4      without each mechanism in turn
  tropism chart scenarios/olfactory.json --only cue_field  error against time
  tropism bench scenarios/load.json --axons 1000,10000   growth cones a second
  tropism stability                                      where methods fail, into out/stability
  tropism mechanisms fasciculation                       its equation and its keys
  tropism schema > scene.schema.json                     for editors; a scene says \"$schema\": \"scene.schema.json\"
  tropism new-mechanism galvanotaxis                     a crate with a mechanism of your own";

/// A line on standard output. A reader that has gone (`| head`) is no fault of the run.
macro_rules! say {
    ($($words:tt)*) => {{
        let _ = writeln!(std::io::stdout(), $($words)*);
    }};
}

/// Runs the program with a roster of mechanisms: the whole of `main`, also for programs that add their own.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>, roster: Roster) -> ExitCode {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Nothing can be done about a standard output that is gone.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    match on_threads(&cli, || execute(&cli, &roster)) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(if matches!(error, RunError::Scenario(_) | RunError::Arguments(_)) { 2 } else { 1 })
        }
    }
}

fn on_threads<T: Send>(cli: &Cli, work: impl FnOnce() -> Result<T, RunError> + Send) -> Result<T, RunError> {
    let own = match &cli.command {
        Some(Command::Plan { threads, .. } | Command::Chart { threads, .. } | Command::Ablate { threads, .. }) => {
            *threads
        }
        Some(Command::Bench { threads, .. }) => Some(*threads),
        _ => None,
    };
    let threads = own.or(cli.threads).unwrap_or(0) as usize;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| RunError::Internal(error.to_string()))?;
    pool.install(work)
}

fn execute(cli: &Cli, roster: &Roster) -> Result<ExitCode, RunError> {
    match &cli.command {
        Some(Command::Plan { scene, json, .. }) => return run_plan(scene, *json, roster),
        Some(Command::Ablate { scene, out, seeds, pairs, .. }) => {
            return run_ablation(scene, out.as_ref(), Extent { seeds: *seeds, pairs: *pairs }, roster);
        }
        Some(Command::Chart { scene, out, only, repetitions, seeds, .. }) => {
            let (request, _) = scene.settled(roster)?;
            let laboratory =
                Laboratory { request: &request, roster, repetitions: *repetitions as usize, seeds: *seeds };
            return run_chart(&laboratory, out.as_ref(), only);
        }
        Some(Command::Bench { scene, out, axons, repetitions, .. }) => {
            let (request, _) = scene.settled(roster)?;
            let laboratory = Laboratory { request: &request, roster, repetitions: *repetitions as usize, seeds: 1 };
            return run_bench(&laboratory, out.as_ref(), axons);
        }
        Some(Command::Stability { out }) => return run_stability(out, roster),
        Some(Command::Mechanisms { name, json }) => return list_mechanisms(name.as_deref(), *json, roster),
        Some(Command::Schema) => return print_json(&editor_schema(&block_schemas(roster))),
        Some(Command::NewMechanism { name, path, tropism }) => {
            return new_mechanism(name, path, tropism.as_deref(), roster);
        }
        None => {}
    }
    let loaded = cli.scene.load(roster)?;
    let folder = folder_of(cli.out.as_ref(), &loaded.scene.name);
    prepare_folder(&folder)?;
    let complete = match cli.seeds {
        None => run_once(cli, roster, &loaded, &folder)?,
        Some(count) => run_seeds(cli, roster, &loaded, &folder, count)?,
    };
    say!("results in {}", folder.display());
    Ok(ExitCode::from(u8::from(!complete)))
}

fn run_plan(scene: &SceneArguments, json: bool, roster: &Roster) -> Result<ExitCode, RunError> {
    let found = plan(&scene.load(roster)?, roster, &scene.path())?;
    if json {
        return print_json(&found);
    }
    say!("{}", found.to_string().trim_end());
    found.notes.iter().for_each(|note| eprintln!("note: {note}"));
    Ok(ExitCode::SUCCESS)
}

fn print_json(value: &impl Serialize) -> Result<ExitCode, RunError> {
    let text = serde_json::to_string_pretty(value).map_err(|error| RunError::Internal(error.to_string()))?;
    say!("{text}");
    Ok(ExitCode::SUCCESS)
}

fn list_mechanisms(name: Option<&str>, json: bool, roster: &Roster) -> Result<ExitCode, RunError> {
    let mut found = Catalogue::of(&block_schemas(roster));
    if let Some(name) = name {
        found = found.only(name).map_err(RunError::Arguments)?;
    }
    if json {
        return print_json(&found);
    }
    say!("{}", found.to_string().trim_end());
    Ok(ExitCode::SUCCESS)
}

fn new_mechanism(name: &str, parent: &Path, sources: Option<&Path>, roster: &Roster) -> Result<ExitCode, RunError> {
    let taken = top_keys(&block_schemas(roster));
    let sources = sources.unwrap_or(Path::new(env!("CARGO_MANIFEST_DIR")));
    let written = NewMechanism { name, parent, sources, taken: &taken }.write().map_err(|error| match error {
        NewMechanismError::Refused(message) => RunError::Arguments(message),
        NewMechanismError::Write(error) => RunError::Write(error),
    })?;
    let folder = written.folder.display();
    say!("{folder}: {}", written.files.join(", "));
    say!("It depends on tropism in {}, and shares the dependencies compiled there.", written.sources.display());
    say!("\nNext:\n  cd {folder}\n  cargo test --release");
    say!("  cargo run --release -- scenarios/{name}.json      draws out/{name}/figure.png");
    say!("  cargo run --release -- ablate scenarios/{name}.json --seeds 4\nThen change src/{name}.rs.");
    Ok(ExitCode::SUCCESS)
}

fn run_ablation(
    scene: &SceneArguments,
    out: Option<&PathBuf>,
    extent: Extent,
    roster: &Roster,
) -> Result<ExitCode, RunError> {
    let loaded = scene.load(roster)?;
    let folder = folder_of(out, &format!("{}-ablation", loaded.scene.name));
    prepare_folder(&folder)?;
    let bar = progress_bar();
    let tick = |share| bar.set_position((share * 1000.0) as u64);
    let found = ablation::ablate(&loaded, roster, &scene.path(), extent, tick)?;
    bar.finish_and_clear();
    ablation::report::write(&folder, &loaded, &found)?;
    say!("{}", found.to_string().trim_end());
    say!("results in {}", folder.display());
    Ok(ExitCode::from(u8::from(!found.complete)))
}

fn run_chart(laboratory: &Laboratory, out: Option<&PathBuf>, only: &[String]) -> Result<ExitCode, RunError> {
    let name = format!("{}-chart", laboratory.scene()?.scene.name);
    let folder = folder_of(out, &name);
    prepare_folder(&folder)?;
    let bar = progress_bar();
    let chart = chart::chart(laboratory, only, &|share| bar.set_position((share * 1000.0) as u64))?;
    bar.finish_and_clear();
    chart::report::write(&folder, &chart)?;
    for factor in &chart.factors {
        say!("{}\n  {}", factor.title, factor.advice);
        for power in factor.growth().iter().filter(|_| factor.errors.is_empty()) {
            say!("  time grows with the power {:.2} ({}, {} points)", power.order, power.method, power.points);
        }
        for error in &factor.errors {
            for slope in factor.slopes(error) {
                say!("  {}: order {:.2} ({}, {} points)", error.name, slope.order, slope.method, slope.points);
            }
        }
    }
    say!("results in {}", folder.display());
    Ok(ExitCode::SUCCESS)
}

fn run_bench(laboratory: &Laboratory, out: Option<&PathBuf>, axons: &[u64]) -> Result<ExitCode, RunError> {
    let folder = folder_of(out, &format!("{}-bench", laboratory.scene()?.scene.name));
    prepare_folder(&folder)?;
    let bar = progress_bar();
    let found = bench::bench(laboratory, axons, &|share| bar.set_position((share * 1000.0) as u64))?;
    bar.finish_and_clear();
    bench::report::write(&folder, &found)?;
    say!("{}", found.to_string().trim_end());
    say!("results in {}", folder.display());
    Ok(ExitCode::SUCCESS)
}

fn run_stability(folder: &Path, roster: &Roster) -> Result<ExitCode, RunError> {
    prepare_folder(folder)?;
    let bar = progress_bar();
    let maps = Stability::compute(roster, |share| bar.set_position((share * 1000.0) as u64))?;
    bar.finish_and_clear();
    maps.write(folder)?;
    say!("results in {}", folder.display());
    Ok(ExitCode::SUCCESS)
}

fn run_once(cli: &Cli, roster: &Roster, loaded: &Loaded, folder: &Path) -> Result<bool, RunError> {
    let bar = progress_bar();
    let finished =
        simulate(loaded, roster, &cli.scene.path(), true, |share| bar.set_position((share * 1000.0) as u64))?;
    bar.finish_and_clear();
    write_results(folder, loaded, &finished)?;
    let summary = &finished.summary;
    let hits = &summary.morphology.hits;
    say!("{}: t = {} h; {}", summary.scene, (summary.time * 1e6).round() / 1e6, summary.counts);
    if let Some(fraction) = hits.fraction {
        say!("hit fraction {fraction:.3}");
    }
    for note in &summary.notes {
        eprintln!("note: {note}");
    }
    if let Some(fault) = &summary.fault {
        eprintln!("error: the run ended {fault}");
    }
    Ok(summary.complete)
}

fn run_seeds(cli: &Cli, roster: &Roster, loaded: &Loaded, folder: &Path, count: u64) -> Result<bool, RunError> {
    let bar = progress_bar();
    let runs = over_seeds(loaded, roster, &cli.scene.path(), count, |share| bar.set_position((share * 1000.0) as u64))?;
    bar.finish_and_clear();
    let summary = summarise(loaded, &runs)?;
    write_json(&folder.join("summary.json"), &summary)?;
    write_json(&folder.join("manifest.json"), &Manifest::of(loaded))?;
    if let Some(first) = runs.first() {
        first.recorder.trajectories.write(&folder.join("trajectories.csv"))?;
        write_figure(folder, loaded, &first.recorder.snapshots)?;
    }
    say!("{}: {count} seeds; mean [95 % bootstrap interval]", summary.scene);
    for (name, value) in &summary.measures {
        let interval = value.low.zip(value.high).map_or(String::new(), |(l, h)| format!(" [{l:.4}, {h:.4}]"));
        say!("  {name}: {:.4}{interval}", value.mean);
    }
    Ok(summary.complete)
}

/// A bar on standard error, drawn only on a terminal.
fn progress_bar() -> ProgressBar {
    let bar = ProgressBar::new(1000);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent}% {elapsed} (remaining {eta})") {
        bar.set_style(style);
    }
    bar
}
