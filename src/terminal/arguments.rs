//! The arguments of the command line.

use super::examples::EXAMPLES;
use super::pictures::{FigureArguments, MovieArguments};
use super::running::seconds;
use super::voice::note;
use crate::model::mechanism::Roster;
use crate::scenario::load::{Loaded, Request};
use crate::study::accuracy;
use crate::study::chart;
use crate::study::room::Room;
use crate::study::run::RunError;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Simulates how axons find their way: runs a scenario and writes its results into out/<scene>/.
#[derive(Debug, Parser)]
#[command(name = "tropism", version, after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
#[command(subcommand_negates_reqs = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Folder of the results [default: out/<scene>]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Run N seeds, from the scenario's seed on, and report means with bootstrap intervals
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub seeds: Option<u64>,
    /// Write a checkpoint every so often, e.g. 10min, from which `tropism resume DIR` goes on
    #[arg(long, value_name = "TIME", value_parser = seconds, conflicts_with = "seeds")]
    pub checkpoint: Option<f64>,
    /// Threads to use; results do not depend on it [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Say nothing but what is asked for, and errors
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Say more: the seconds of each phase
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    pub verbose: bool,
    /// What was typed.
    #[arg(skip)]
    pub words: String,
}

#[derive(Debug, Subcommand)]
pub enum Command {
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
    /// Goes on with a run that was stopped or died, from its newest checkpoint
    Resume {
        /// The folder of its results
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Write a checkpoint every so often, e.g. 10min [default: as before]
        #[arg(long, value_name = "TIME", value_parser = seconds)]
        checkpoint: Option<f64>,
        /// Threads to use; results do not depend on it [default: all]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
        threads: Option<u32>,
        /// Refuse a run that needs more memory than this, e.g. 8GB, or than is `free`; `any` refuses none
        #[arg(long, value_name = "SIZE", default_value = "free", value_parser = Room::parse)]
        memory: Room,
    },
    /// Draws finished runs from their recordings, at any time or side by side, without running them again
    Figure(FigureArguments),
    /// Makes a movie of a finished run that a slide deck plays
    Movie(MovieArguments),
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
    /// Prints what a shell completes by
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Prints the man page
    Man,
    /// Writes a crate with a mechanism of your own, which builds, runs and is tested as it is
    NewMechanism {
        /// Name of the mechanism and its crate: small letters, digits, underscores
        name: String,
        /// Folder in which the crate's folder is made
        #[arg(long, value_name = "DIR", default_value = ".")]
        path: PathBuf,
        /// Sources of tropism [default: the nearest above this program or the current folder]
        #[arg(long, value_name = "PATH")]
        tropism: Option<PathBuf>,
    },
}

/// A scenario and what is changed in it.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// The scenario, a JSON file
    #[arg(required = true)]
    pub scenario: Option<PathBuf>,
    /// Leave a mechanism out, as if the scenario had no such block (repeatable)
    #[arg(long, value_name = "NAME")]
    pub without: Vec<String>,
    /// Set one key, named by its JSON pointer (repeatable)
    #[arg(long, value_name = "/POINTER=VALUE")]
    pub set: Vec<String>,
    /// Refuse a scene that needs more memory than this, e.g. 8GB, or than is `free`; `any` refuses none
    #[arg(long, value_name = "SIZE", default_value = "free", value_parser = Room::parse)]
    pub memory: Room,
}

impl SceneArguments {
    /// The file of the scenario.
    pub fn path(&self) -> PathBuf {
        self.scenario.clone().unwrap_or_default()
    }

    /// The scene with the keys that its accuracy asks for, and the request that gives it.
    pub fn settled(&self, roster: &Roster) -> Result<(Request, Loaded), RunError> {
        let request = Request { path: self.path(), without: self.without.clone(), set: self.set.clone() };
        let (request, mut loaded) = accuracy::settled(&request, roster, |read| self.memory.admit_outlook(&read.scene))?;
        for hint in &loaded.hints {
            note!("hint: {hint}");
        }
        loaded.room = self.memory.beside(&loaded.scene);
        Ok((request, loaded))
    }

    /// The scene with the keys that its accuracy asks for.
    pub fn load(&self, roster: &Roster) -> Result<Loaded, RunError> {
        Ok(self.settled(roster)?.1)
    }
}
