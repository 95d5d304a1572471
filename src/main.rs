//! The program: the standard roster on the command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    tropism::run(std::env::args_os(), tropism::standard())
}
