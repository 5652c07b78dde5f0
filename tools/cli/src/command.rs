//! The commands, one file each.

mod arm;
mod bench;
mod check;
mod demo;
mod diagnose;
mod gearbox;
mod identify;
mod info;
mod init;
mod inverse;
mod lab;
mod list;
mod pack;
pub(crate) mod ports;
mod robot;
mod scale;
mod schema;
mod shell;
mod simulate;
mod sweep;
mod trial;
mod validate;

use crate::args::{ArmCommand, CliCommand, FmuCommand, Trial};
use crate::error::CliError;

pub(crate) fn run(command: CliCommand) -> Result<(), CliError> {
    match command {
        CliCommand::Demo(a) => demo::demo(&a),
        CliCommand::Init(a) => init::run(&a),
        CliCommand::Check(a) => check::run(&a),
        CliCommand::Ports(a) => ports::run(&a),
        CliCommand::Identify(a) => identify::run(&a),
        CliCommand::Statics(a) => identify::statics::run(&a),
        CliCommand::Gearbox(a) => gearbox::run(&a),
        CliCommand::Inverse(a) => inverse::run(&a),
        CliCommand::Robot(a) => robot::run(&a),
        CliCommand::Arm(ArmCommand::Map(a)) => arm::map(&a),
        CliCommand::Diagnose(a) => diagnose::run(&a),
        CliCommand::Simulate(a) => simulate::run(&a),
        CliCommand::Scale(a) => scale::run(&a),
        CliCommand::Sweep(a) => sweep::run(&a),
        CliCommand::Fmu(FmuCommand::Pack(a)) => pack::run(&a),
        CliCommand::Fmu(FmuCommand::List) => list::run(),
        CliCommand::Fmu(FmuCommand::Info(a)) => info::run(&a),
        CliCommand::Fmu(FmuCommand::Validate(a)) => validate::run(&a),
        // Served before it comes here.
        CliCommand::FmuHost => Ok(()),
        CliCommand::Trial(Trial::Generate(a)) => trial::generate(&a),
        CliCommand::Trial(Trial::Run(a)) => trial::run(&a),
        CliCommand::Trial(Trial::Score(a)) => trial::score(&a),
        CliCommand::Trial(Trial::Compare(a)) => trial::compare(&a),
        CliCommand::Trial(Trial::Corpus(a)) => trial::corpus(&a),
        CliCommand::Bench(a) => bench::run(&a),
        CliCommand::Lab(a) => lab::run(&a),
        CliCommand::Schema(a) => schema::run(&a),
        CliCommand::Completions(a) => shell::completions(&a),
        CliCommand::Man(a) => shell::man(&a),
    }
}
