//! The command line: arguments in, exit code out.
//!
//! Exit codes: 0 done; 1 a fault while solving, running or writing; 2 a bad scenario or bad arguments; 130 and 143 stopped by SIGINT
//! and SIGTERM, with what there was written.
//!
//! | question | file |
//! |---|---|
//! | Which commands and options are there? | [`arguments`], [`pictures`]; what stands below the help: [`examples`] |
//! | What does a command do? | [`commands`]; one run, watched and resumed: [`running`] |
//! | What is said, and where? | [`voice`], [`manners`] |
//! | What does Ctrl-C do? | [`interrupt`] |

mod arguments;
mod commands;
mod examples;
mod interrupt;
mod manners;
mod pictures;
mod running;
mod voice;

use crate::model::mechanism::Roster;
use crate::record::output::prepare_folder;
use crate::scenario::editor_schema::editor_schema;
use crate::study::ablation::Extent;
use crate::study::laboratory::Laboratory;
use crate::study::report::Asked;
use crate::study::run::{RunError, block_schemas, folder_of};
use arguments::{Cli, Command};
use clap::{CommandFactory, Parser};
use commands::{
    list_mechanisms, new_mechanism, print_bytes, print_json, run_ablation, run_bench, run_chart, run_plan, run_seeds,
    run_stability,
};
use examples::words;
use interrupt::end_at_once;
use manners::{alarming, completions, drawn, man_page};
use running::{resume, run_once};
use std::ffi::OsString;
use std::process::ExitCode;
use voice::{alarm, printed, set_voice, unsaid};

/// Runs the program with a roster of mechanisms: the whole of `main`, also for programs that add their own.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>, roster: Roster) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let words = words(&arguments);
    let cli = match Cli::try_parse_from(manners_last(arguments)) {
        Ok(cli) => Cli { words, ..cli },
        Err(error) if error.use_stderr() => {
            let _ = error.print();
            return ExitCode::from(2);
        }
        Err(help) => {
            printed(help.print());
            return told(ExitCode::SUCCESS);
        }
    };
    set_voice(cli.quiet, cli.verbose);
    let code = on_threads(&cli, || execute(&cli, &roster)).unwrap_or_else(|error| {
        let account = if let RunError::Scenario(errors) = &error { drawn(errors) } else { error.to_string() };
        alarm!("{} {account}", alarming("error:"));
        ExitCode::from(if matches!(error, RunError::Scenario(_) | RunError::Arguments(_)) { 2 } else { 1 })
    });
    told(code)
}

/// The exit code of what ended with one, which is no success if standard output did not take what was said.
fn told(code: ExitCode) -> ExitCode {
    match unsaid() {
        Some(reason) if code == ExitCode::SUCCESS => {
            alarm!("{} standard output: {reason}", alarming("error:"));
            ExitCode::FAILURE
        }
        _ => code,
    }
}

/// The same arguments with those of manners at the end, if they stood before a command: a command takes none before it.
fn manners_last(mut arguments: Vec<OsString>) -> Vec<OsString> {
    let is_manner = |word: &&OsString| ["-q", "--quiet", "-v", "--verbose"].iter().any(|manner| *word == manner);
    let leading = arguments.iter().skip(1).take_while(is_manner).count();
    if leading > 0 && !arguments.iter().any(|word| word == "--") {
        arguments[1..].rotate_left(leading);
    }
    arguments
}

fn on_threads<T: Send>(cli: &Cli, work: impl FnOnce() -> Result<T, RunError> + Send) -> Result<T, RunError> {
    let own = match &cli.command {
        Some(Command::Plan { threads, .. } | Command::Chart { threads, .. } | Command::Ablate { threads, .. }) => {
            *threads
        }
        Some(Command::Bench { threads, .. }) => Some(*threads),
        Some(Command::Resume { threads, .. }) => *threads,
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
    let writes_at_its_end = matches!(
        &cli.command,
        Some(Command::Chart { .. } | Command::Bench { .. } | Command::Movie(_) | Command::Stability { .. })
    );
    if writes_at_its_end {
        end_at_once().map_err(|error| RunError::Internal(error.to_string()))?;
    }
    match &cli.command {
        Some(Command::Plan { scene, json, .. }) => return run_plan(scene, *json, roster),
        Some(Command::Ablate { scene, out, seeds, pairs, .. }) => {
            return run_ablation(cli, scene, out.as_ref(), Extent { seeds: *seeds, pairs: *pairs }, roster);
        }
        Some(Command::Chart { scene, out, only, repetitions, seeds, .. }) => {
            let (request, _) = scene.settled(roster)?;
            let (repetitions, room) = (*repetitions as usize, scene.memory);
            let laboratory = Laboratory { request: &request, roster, repetitions, seeds: *seeds, room };
            return run_chart(cli, &laboratory, out.as_ref(), only);
        }
        Some(Command::Bench { scene, out, axons, repetitions, .. }) => {
            let (request, _) = scene.settled(roster)?;
            let (repetitions, room) = (*repetitions as usize, scene.memory);
            let laboratory = Laboratory { request: &request, roster, repetitions, seeds: 1, room };
            return run_bench(&laboratory, out.as_ref(), axons);
        }
        Some(Command::Resume { folder, checkpoint, memory, .. }) => {
            return resume((folder, *memory), roster, *checkpoint);
        }
        Some(Command::Figure(arguments)) => return arguments.draw(),
        Some(Command::Movie(arguments)) => return arguments.make(),
        Some(Command::Stability { out }) => return run_stability(out, roster),
        Some(Command::Mechanisms { name, json }) => return list_mechanisms(name.as_deref(), *json, roster),
        Some(Command::Schema) => return print_json(&editor_schema(&block_schemas(roster))),
        Some(Command::Completions { shell }) => return print_bytes(&completions(Cli::command(), *shell)),
        Some(Command::Man) => return print_bytes(&man_page(Cli::command())),
        Some(Command::NewMechanism { name, path, tropism }) => {
            return new_mechanism(name, path, tropism.as_deref(), roster);
        }
        None => {}
    }
    let loaded = cli.scene.load(roster)?;
    let folder = folder_of(cli.out.as_ref(), &loaded.scene.name);
    let _claim = prepare_folder(&folder)?;
    match cli.seeds {
        None => run_once(
            (Asked { loaded: &loaded, command: &cli.words }, &cli.scene.path()),
            roster,
            (&folder, cli.scene.memory),
            cli.checkpoint,
        ),
        Some(count) => run_seeds(cli, roster, &loaded, &folder, count),
    }
}
