//! Terminal manners: progress, silence, colours, completions, the man page, and where in its file a scene is wrong.
//!
//! Progress is drawn on standard error, only where that is a terminal. Colours come only there, and never with `NO_COLOR` (no-color.org).

use super::voice::is_quiet;
use crate::scenario::excerpt::excerpt;
use crate::scenario::load::ScenarioErrors;
use crate::scenario::read::read_text;
use clap::Command;
use clap_complete::Shell;
use indicatif::{ProgressBar, ProgressFinish, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::{IsTerminal, stderr};
use std::time::Duration;

/// A bar of a thousand parts on standard error, drawn only on a terminal: share, rate and remaining time of work that is `amount` of
/// `unit` in all.
pub fn progress_bar(amount: f64, unit: &'static str) -> ProgressBar {
    if is_quiet() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(1000).with_finish(ProgressFinish::AndClear);
    let rate = move |state: &ProgressState, text: &mut dyn Write| {
        // A terminal that is gone is no fault of the run.
        let _ = write!(text, "{:.3} {unit}/s", state.per_sec() * amount / 1000.0);
    };
    let template = "{bar:40} {percent}% in {elapsed}, {rate}, {eta} to go";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("rate", rate));
    }
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

/// Whether standard error takes colours.
fn has_colours() -> bool {
    stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// A word in bold red where there are colours.
pub fn alarming(word: &str) -> String {
    if has_colours() { format!("\u{1b}[1;31m{word}\u{1b}[0m") } else { word.to_owned() }
}

/// All that is wrong with a scene, each drawn at its place in the file if it has one there.
pub fn drawn(errors: &ScenarioErrors) -> String {
    let Ok(text) = read_text(&errors.path) else { return errors.to_string() };
    let count = errors.problems.len();
    let mut said = format!("{}: {count} problem{}", errors.path.display(), if count == 1 { "" } else { "s" });
    for (index, problem) in errors.problems.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(said, "\n  {}. {problem}", index + 1);
        let Some(excerpt) = excerpt(&text, problem) else { continue };
        let (line, column, marks) = (excerpt.line, excerpt.column, alarming(&"^".repeat(excerpt.width)));
        let margin = " ".repeat(line.to_string().len());
        let _ = write!(said, "\n     {margin}--> {}:{line}:{column}", errors.path.display());
        let _ = write!(said, "\n     {line} | {}\n     {margin} | {}{marks}", excerpt.text, " ".repeat(excerpt.indent));
    }
    said
}

/// The completions of a shell.
pub fn completions(mut command: Command, shell: Shell) -> Vec<u8> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut command, "tropism", &mut text);
    text
}

/// The man page, in roff; that of each command stands in it.
pub fn man_page(mut command: Command) -> Vec<u8> {
    command.build();
    let mut text = Vec::new();
    // Writing to memory cannot fail.
    let _ = clap_mangen::Man::new(command.clone()).render(&mut text);
    for inner in command.get_subcommands().filter(|inner| inner.get_name() != "help") {
        let page = clap_mangen::Man::new(inner.clone());
        text.extend_from_slice(format!(".SH \"TROPISM {}\"\n", inner.get_name().to_uppercase()).as_bytes());
        let _ = page.render_description_section(&mut text);
        let _ = page.render_synopsis_section(&mut text);
        let _ = page.render_options_section(&mut text);
    }
    text
}
