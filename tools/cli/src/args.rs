//! The command line.

mod arm;
mod bench;
mod case;
mod dynamics;
mod identify;
mod lab;
mod ports;
mod robot;
mod scale;
mod shell;
mod sweep;
mod trial;

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use trueup_cosim::system::{Algorithm, ComponentInterface};

pub(crate) use arm::{ArmCommand, ArmMap};
pub(crate) use bench::{BenchCommand, BenchMake, BenchRun, BenchScore, BenchSubmit};
pub(crate) use case::{Check, Init, Schema, SchemaOf};
pub(crate) use dynamics::{Gearbox, Inverse};
pub(crate) use identify::{Identify, Statics};
pub(crate) use lab::{LabCommand, LabNew, LabRun};
pub(crate) use ports::PortsCommand;
pub(crate) use robot::{JointWay, RobotArgument};
pub(crate) use scale::ScaleCommand;
pub(crate) use shell::{Completions, Man};
pub(crate) use sweep::{Merge, ReportMap, SweepCommand, SweepFollowUp};
pub(crate) use trial::{Trial, TrialCompare, TrialCorpus, TrialGenerate, TrialRun, TrialScore};

/// Flexible manipulators as FMUs, and what separates a simulation from recordings of the real system
#[derive(Debug, Parser)]
#[command(name = "trueup", version)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: CliCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CliCommand {
    /// Pack, show and check FMUs
    #[command(subcommand)]
    Fmu(FmuCommand),
    /// Run an FMU, or a system of FMUs, and write its outputs as CSV or Parquet
    Simulate(Simulate),
    /// Bring parameters, a system or a recording to another size by the laws of scaling, and back
    Scale(ScaleCommand),
    /// Run a system many times with values that are varied, resumable and in shares
    Sweep(SweepCommand),
    /// Draft a case.toml from logs: columns, units, clock, recordings at rest; guesses are marked
    Init(Init),
    /// Report what recordings, sensors and excitation can determine, and what is wrong with them, before any fit
    Check(Check),
    /// Draft and check what the variables of anybody's FMU mean, and which effects can act where
    Ports(PortsCommand),
    /// Estimate a model's parameters from recordings, with their uncertainty
    Identify(Identify),
    /// Evaluate static tests: Young's modulus from deflections, or the first mode of an arm and its springs' shares
    Statics(Statics),
    /// Combine the two stages of a gearbox into the one of a joint
    Gearbox(Gearbox),
    /// Compute the torques of a planar arm's motors from their motion, its base free
    Inverse(Inverse),
    /// Analyse a pose of a robot on a free base: matrices, measures, singularities; surfaces over two joints
    Robot(RobotArgument),
    /// Show what bends of an arm on the ground, and how it vibrates
    #[command(subcommand)]
    Arm(ArmCommand),
    /// Locate the gap between a model and recordings, name the effect that causes it, and report how far it shrinks
    Diagnose(Diagnose),
    /// Show the whole work flow once: pack FMUs, couple them, identify and diagnose a case whose cause is sealed
    Demo(Demo),
    /// The process of an FMU that has one of its own; started by this program alone
    #[command(name = "__fmu-host", hide = true)]
    FmuHost,
    /// Make and judge blind trials: cases with a sealed cause, and the scorecard of the diagnosis
    #[command(subcommand)]
    Trial(Trial),
    /// Make a sealed benchmark, run this program on it, check an entry of any program, and score entries when the keys are out
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Experiment with a joint whose cause is sealed: it runs what is proposed, within limits, and hands the recording back
    #[command(subcommand)]
    Lab(LabCommand),
    /// Print the JSON Schema of a file, for editors that complete and check it
    Schema(Schema),
    /// Print the script that completes commands and options in a shell
    Completions(Completions),
    /// Write the manual pages of all commands
    Man(Man),
}

#[derive(Debug, Subcommand)]
pub(crate) enum FmuCommand {
    /// Pack models as FMUs
    Pack(Box<Pack>),
    /// List models, presets and effects
    List,
    /// Describe an FMU: its model, interfaces, variables and platforms
    Info(Info),
    /// Check anybody's FMU and say what is wrong with it
    Validate(Validate),
}

/// Joints of a controller at most: as many as a robot has bodies.
const MOST_JOINTS: i64 = trueup_models::space::MAX_BODIES as i64;

#[derive(Debug, clap::Args)]
pub(crate) struct Diagnose {
    /// A folder of recordings with a case.toml, or that file
    pub(crate) case: PathBuf,
    /// Folder for diagnosis.json, decision.json, report.html, the augmented FMUs and where their free runs began; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Also print the content of diagnosis.json
    #[arg(long)]
    pub(crate) json: bool,
    /// Only diagnosis.json with verdict, claims and gaps, and decision.json: no page, no FMUs, no next experiment
    #[arg(long)]
    pub(crate) verdict_only: bool,
    /// Take every reading: without it large recordings are thinned, which the diagnosis reports
    #[arg(long)]
    pub(crate) all_readings: bool,
    /// The recordings for fitting are healthy: also report when and where the held-out ones deviate from the model
    #[arg(long)]
    pub(crate) watch: bool,
    /// Conclude even from recordings with a grave finding: a wrong sign or unit, a time that is not in s, a drive that was not
    /// recorded. Else the verdict is `unknown` then
    #[arg(long)]
    pub(crate) force: bool,
    /// Seed of everything that is drawn
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// How long the work may take, s; else as long as it likes. Nothing is written if it is not done by then
    #[arg(long, value_name = "S", value_parser = deadline)]
    pub(crate) deadline: Option<f64>,
    /// Folder with the template libraries of the FMUs; searched next to the program when not given
    #[arg(long, value_name = "DIR")]
    pub(crate) library: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Demo {
    /// Folder for the FMUs and the page; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "out/demo")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, Default, clap::Args)]
pub(crate) struct Pack {
    /// Models to pack; all that fit the other options when none is named
    pub(crate) model: Vec<String>,
    /// Folder for the FMUs; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = ".")]
    pub(crate) output: PathBuf,
    /// The model of a result, with its effects and values: what `trueup identify CASE --json` prints, or a diagnosis.json
    #[arg(
        long,
        value_name = "FILE.json",
        conflicts_with_all = ["model", "effect", "preset", "robot", "joints", "flexible", "structure"]
    )]
    pub(crate) from: Option<PathBuf>,
    /// Version of the standard; both when not given
    #[arg(long, value_name = "2|3", value_parser = clap::value_parser!(u32).range(2..=3))]
    pub(crate) fmi: Option<u32>,
    /// Effect to pack in (see `trueup fmu list`); may be repeated
    #[arg(long, value_name = "ID")]
    pub(crate) effect: Vec<String>,
    /// Parameter set to start from (see `trueup fmu list`)
    #[arg(long, value_name = "NAME")]
    pub(crate) preset: Option<String>,
    /// Robot of a SpatialFreeFlyer, a FlexibleArm or a CaptureScene with chaser=spatial: a file of TOML (see docs/robots.md), URDF or MJCF
    #[arg(long, value_name = "FILE", conflicts_with = "preset")]
    pub(crate) robot: Option<PathBuf>,
    /// Hold the robot's base: it is bolted to the ground, and the FMU has a parameter `gravity`
    #[arg(long, requires = "robot")]
    pub(crate) held: bool,
    /// Change inertias of the robot that no body has into the nearest ones that some body has; what is changed is reported
    #[arg(long, requires = "robot")]
    pub(crate) repair_inertia: bool,
    /// Number of joints of a ManipulatorController
    #[arg(long, value_name = "N", conflicts_with = "flexible", value_parser = clap::value_parser!(u16).range(1..=MOST_JOINTS))]
    pub(crate) joints: Option<u16>,
    /// Start value: a number, `true`, an item of an enumeration; of an array one element (`linkMass[1]=4`)
    /// or all of them (`linkMass=4,3,1`)
    #[arg(long, value_name = "NAME=VALUE", allow_hyphen_values = true)]
    pub(crate) set: Vec<String>,
    /// Structure of an arm: which of its joints are flexible; as many entries as the arm has joints
    #[arg(long, value_name = "true|false,..", value_delimiter = ',', action = clap::ArgAction::Append)]
    pub(crate) flexible: Vec<bool>,
    /// Structure of a contact model: how many balls or ports, what moves the jaws (see `trueup fmu list`); may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    pub(crate) structure: Vec<String>,
    /// Platforms in each FMU: `all`, or some of x86_64-linux, aarch64-linux, x86_64-windows, aarch64-darwin, x86_64-darwin;
    /// this machine's when not given
    #[arg(long, value_name = "all|LIST", value_delimiter = ',')]
    pub(crate) platform: Vec<String>,
    /// Folder with the template library and, in templates/PLATFORM, those of `tools/release`; the program's own when not given
    #[arg(long, value_name = "DIR")]
    pub(crate) library: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Info {
    /// The FMU: a file or an unpacked folder
    pub(crate) file: PathBuf,
    /// Machine-readable
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Validate {
    /// The FMU: a file or an unpacked folder
    pub(crate) file: PathBuf,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Simulate {
    /// An FMU (a file or an unpacked folder), or a system of FMUs: .toml, .ssp, .ssd
    pub(crate) file: PathBuf,
    /// Results; if the run fails, what was computed is kept as `<name>.partial.csv` or `.partial.parquet`
    #[arg(short, long, value_name = "FILE.csv|.parquet", default_value = "results.csv")]
    pub(crate) output: PathBuf,
    /// Start time in s; else that of the system or of the default experiment, else 0
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = number)]
    pub(crate) start: Option<f64>,
    /// Stop time in s; else that of the system or of the default experiments, else the end of the inputs
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = number)]
    pub(crate) stop: Option<f64>,
    /// Communication step in s; else that of the system, else the smallest of the default experiments, else a
    /// 500th of the run
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = above_zero)]
    pub(crate) step: Option<f64>,
    /// Relative tolerance of the coupling and of integrators
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = tolerance)]
    pub(crate) tolerance: Option<f64>,
    /// Start value: a number, `true`, an item of an enumeration; of an array one element (`linkMass[1]=4`)
    /// or all of them (`linkMass=4,3,1`); in a system with the component (`arm.linkMass[1]=4`)
    #[arg(long, value_name = "NAME=VALUE", allow_hyphen_values = true)]
    pub(crate) set: Vec<String>,
    /// Inputs over time: a CSV with the columns `time` (s) and names of inputs
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) input: Option<PathBuf>,
    /// Also draw the results: one HTML file that opens offline
    #[arg(long, value_name = "FILE.html")]
    pub(crate) plot: Option<PathBuf>,
    /// Write the log of the run: algorithm and why, steps, events, loops; also of a run that failed
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
    /// Report progress even where standard error is no terminal
    #[arg(long)]
    pub(crate) progress: bool,
    /// Variables to record instead of all outputs: scalars, whole arrays, elements; `arm.*`: all outputs of `arm`
    #[arg(long, value_name = "NAME,..")]
    pub(crate) outputs: Vec<String>,
    /// How components are coupled: jacobi, gauss-seidel, extrapolate, iterative, adaptive; else the master chooses
    #[arg(long, value_name = "NAME")]
    pub(crate) algorithm: Option<Algorithm>,
    /// Run all FMUs in Co-Simulation (cs) or Model Exchange (me)
    #[arg(long, value_name = "cs|me")]
    pub(crate) interface: Option<ComponentInterface>,
    /// Give each FMU a process of its own: one that crashes, exits or hangs ends the run with an error, and what was computed
    /// before is kept (Linux)
    #[arg(long)]
    pub(crate) isolate: bool,
    /// How long a single call of an FMU may take, s; else as long as it likes; gives each FMU a process of its own as --isolate
    #[arg(long, value_name = "S", value_parser = deadline)]
    pub(crate) deadline: Option<f64>,
    /// Only check, and say what would be run
    #[arg(long)]
    pub(crate) check: bool,
    /// Pack the system with its FMUs as SSP instead of running it
    #[arg(long, value_name = "FILE.ssp", conflicts_with = "check")]
    pub(crate) save_ssp: Option<PathBuf>,
}

fn number(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|x| x.is_finite()).ok_or_else(|| "write seconds as a number, as in 0, -1 or 2.5".to_owned())
}

fn above_zero(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|x| *x > 0.0 && x.is_finite())
        .ok_or_else(|| "write a number above 0, as in 0.001".to_owned())
}

fn tolerance(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|x| *x > 0.0 && *x < 1.0)
        .ok_or_else(|| "write a number between 0 and 1, as in 1e-6".to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|s| *s >= 1.0 && s.is_finite())
        .ok_or_else(|| "write seconds, 1 or more, as in 120".to_owned())
}

fn deadline(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|s| *s > 0.0 && *s <= 1e9).ok_or_else(|| "write seconds, more than 0, as in 2.5".to_owned())
}

fn shard(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    parts.filter(|(i, n)| *i >= 1 && i <= n).ok_or_else(|| "write I/N with 1 <= I <= N, as in 2/4".to_owned())
}
