//! Constants that readings of outputs have too much, estimated in every recording anew.

use super::unknown::Prior;
use trueup_identification::run::Channel;
use trueup_identification::sensor_unknowns::Figure;
use trueup_identification::unknown::Scale;
use trueup_signals::Guess;

use super::problem::{Target, Unknown};
use super::search::Search;

/// Share of a reading's range that an offset may be of which nothing is known.
const SHARE: f64 = 0.1;

impl Search<'_> {
    /// The offset of a channel in a recording, believed as its owner says.
    pub(super) fn offset(&self, channel: &Channel, run: usize) -> Unknown {
        let Guess { value, doubt } = channel.offset.unwrap_or(Guess { value: 0.0, doubt: None });
        let size = doubt.unwrap_or(SHARE * self.sizes.range(channel.output));
        let unit = self.case.outputs.get(channel.output).map_or("", |q| q.unit);
        offset((&channel.name, unit), channel.output, run, (value, size))
    }
}

/// Of a channel with its unit; what it is believed to be, and how far it may be off.
pub(super) fn offset(
    (channel, unit): (&str, &str),
    output: usize,
    run: usize,
    (value, size): (f64, f64),
) -> Unknown {
    let size = size.max(1e-12);
    Unknown {
        name: format!("{channel}.{}", Figure::Offset.name()),
        unit: unit.to_owned(),
        target: Target::Offset(output),
        run: Some(run),
        start: value,
        scale: Scale::Linear(size),
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        prior: Some(Prior::normal(value / size, 1.0)),
    }
}
