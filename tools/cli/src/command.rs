//! The commands, one file each.

mod list;
mod pack;

use crate::args::{Command, Fmu};
use crate::error::Error;

pub(crate) fn run(command: Command) -> Result<(), Error> {
    match command {
        Command::Fmu(Fmu::Pack(a)) => pack::run(&a),
        Command::Fmu(Fmu::List) => list::run(),
        Command::Fmu(Fmu::Info(_) | Fmu::Validate(_)) => Err(Error::Failed("not there yet".to_owned())),
    }
}
