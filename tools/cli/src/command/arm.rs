//! `trueup arm map`: what bends of an arm under its weight.

mod asked;
mod found;
mod grid;
mod motion;
mod page;
mod paper;
mod pose;
mod schedule;

use crate::args::ArmMap;
use crate::error::CliError;
use asked::ArmRequest;

pub(crate) fn map(args: &ArmMap) -> Result<(), CliError> {
    let asked = ArmRequest::of(args)?;
    let over = args.output.is_some()
        || [&args.from, &args.to].iter().any(|o| o.is_some())
        || args.joints.is_some()
        || args.schedule.is_some()
        || args.steps.is_some();
    if args.pose.is_empty() || over { grid::run(&asked) } else { pose::run(&asked) }
}
