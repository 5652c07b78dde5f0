//! The commands, one file each.

mod arm;
mod demo;
mod diagnose;
mod identify;
mod info;
mod list;
mod pack;
mod robot;
mod scale;
mod shell;
mod simulate;
mod sweep;
mod trial;
mod validate;

use crate::args::{Arm, Command, Fmu, Trial};
use crate::error::Error;

pub(crate) fn run(command: Command) -> Result<(), Error> {
    match command {
        Command::Demo(a) => demo::demo(&a),
        Command::Identify(a) => identify::run(&a),
        Command::Statics(a) => identify::statics::run(&a),
        Command::Robot(a) => robot::run(&a),
        Command::Arm(Arm::Map(a)) => arm::map(&a),
        Command::Diagnose(a) => diagnose::run(&a),
        Command::Simulate(a) => simulate::run(&a),
        Command::Scale(a) => scale::run(&a),
        Command::Sweep(a) => sweep::run(&a),
        Command::Fmu(Fmu::Pack(a)) => pack::run(&a),
        Command::Fmu(Fmu::List) => list::run(),
        Command::Fmu(Fmu::Info(a)) => info::run(&a),
        Command::Fmu(Fmu::Validate(a)) => validate::run(&a),
        // Served before it comes here.
        Command::FmuHost => Ok(()),
        Command::Trial(Trial::Generate(a)) => trial::generate(&a),
        Command::Trial(Trial::Run(a)) => trial::run(&a),
        Command::Trial(Trial::Score(a)) => trial::score(&a),
        Command::Trial(Trial::Compare(a)) => trial::compare(&a),
        Command::Trial(Trial::Decide(a)) => trial::decide(&a),
        Command::Trial(Trial::Corpus(a)) => trial::corpus(&a),
        Command::Completions(a) => shell::completions(&a),
        Command::Man(a) => shell::man(&a),
    }
}
