//! Constant offsets of readings of outputs, estimated for each recording separately.

use super::unknown::UnknownPrior;
use trueup_identification::run::OutputChannel;
use trueup_identification::sensor_unknowns::SensorFigure;
use trueup_identification::unknown::Scale;
use trueup_signals::PriorGuess;

use super::problem::{BalanceTarget, BalanceUnknown};
use super::search::CaseSearch;

/// Share of a reading's range that an offset may be of which nothing is known.
const SHARE: f64 = 0.1;

impl CaseSearch<'_> {
    /// The offset of a channel in a recording, with the declared prior.
    pub(super) fn offset(&self, channel: &OutputChannel, run: usize) -> BalanceUnknown {
        let PriorGuess { value, doubt } = channel.offset.unwrap_or(PriorGuess { value: 0.0, doubt: None });
        let size = doubt.unwrap_or(SHARE * self.sizes.range(channel.output));
        let unit = self.case.outputs.get(channel.output).map_or("", |q| q.unit);
        offset((&channel.name, unit), channel.output, run, (value, size))
    }
}

/// Of a channel with its unit; its prior mean and standard deviation.
pub(super) fn offset(
    (channel, unit): (&str, &str),
    output: usize,
    run: usize,
    (value, size): (f64, f64),
) -> BalanceUnknown {
    let size = size.max(1e-12);
    BalanceUnknown {
        name: format!("{channel}.{}", SensorFigure::Offset.name()),
        unit: unit.to_owned(),
        target: BalanceTarget::Offset(output),
        run: Some(run),
        start: value,
        scale: Scale::Linear(size),
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        prior: Some(UnknownPrior::normal(value / size, 1.0)),
    }
}
