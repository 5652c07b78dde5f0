//! Delays that are estimated: readings and inputs are put to the times at which the model alone has them; what is left of each delay
//! is a column of every hypothesis.

use std::borrow::Cow;

use trueup_signals::Loaded;

/// Times that channels are put back at the most, the step below which they stay, in steps of the nodes, and the longest step, s.
const RETIMED: (usize, f64, f64) = (6, 0.2, 0.02);

/// How much later channels are than a case assumes.
pub(super) struct LaterChannels {
    /// Step of the nodes, s.
    pub(super) step: f64,
    /// Channels whose delays are estimated, with what the model alone adds to them, s.
    pub(super) by: Vec<(String, f64)>,
}

/// A case at the delays that the model alone has; `later`: how much later its channels are.
///
/// # Errors
/// Those of `later`.
pub(super) fn retimed<'a, E>(
    loaded: &'a Loaded,
    mut later: impl FnMut(&Loaded) -> Result<LaterChannels, E>,
) -> Result<Cow<'a, Loaded>, E> {
    let mut loaded = Cow::Borrowed(loaded);
    let all = || loaded.recordings.values().flat_map(|r| &r.channels);
    if all().all(|c| c.sensor.late.is_none()) {
        return Ok(loaded);
    }
    let (times, settled, longest) = RETIMED;
    for _ in 0..times {
        let LaterChannels { step, by } = later(&loaded)?;
        if by.iter().all(|(_, by)| by.abs() < settled * step) {
            break;
        }
        for c in loaded.to_mut().recordings.values_mut().flat_map(|r| &mut r.channels) {
            let by = by.iter().find(|(name, _)| *name == c.name).map_or(0.0, |l| l.1);
            c.sensor.delay += by.clamp(-longest, longest);
        }
    }
    Ok(loaded)
}
