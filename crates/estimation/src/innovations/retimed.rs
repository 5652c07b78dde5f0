//! Delays that are estimated: readings and inputs are put to the times at which the model alone has them; what is left of each delay
//! is a column of every hypothesis.

use std::borrow::Cow;

use trueup_signals::Loaded;

use super::rig::LateGroup;

/// Delays that are tried first, s: a fit from 0 may end on its way.
const TRIED: [f64; 12] =
    [-0.016, -0.0065, -0.0025, 0.0015, 0.0025, 0.004, 0.0065, 0.01, 0.016, 0.025, 0.04, 0.06];
/// First step of a finer search around the best of them, s, which is halved.
const HALVED: f64 = 0.008;
/// Times that channels are put back then, the step below which they stay, in steps of the nodes, and the longest step, s.
const RETIMED: (usize, f64, f64) = (6, 0.2, 0.02);

/// What the model alone has of the delays of a case.
#[derive(Clone, Debug, Default)]
pub struct LaterChannels {
    /// Log evidence a reading, nats.
    pub evidence: f64,
    /// Step of the nodes, s.
    pub step: f64,
    /// Channels whose delays are estimated, with what adds to the assumed delays, s; none without a fit.
    pub by: Vec<(LateGroup, f64)>,
}

/// A case at the delays that the model alone has of these channels; `look`: what it has of a case, with a fit or without one; `finest`: the
/// least step by which delays are tried from the best on, s.
///
/// # Errors
/// Those of `look`.
pub fn retimed<'a, E>(
    loaded: &'a Loaded,
    late: Vec<LateGroup>,
    finest: f64,
    look: impl Fn(&Loaded, bool) -> Result<LaterChannels, E>,
) -> Result<Cow<'a, Loaded>, E> {
    if late.is_empty() {
        return Ok(Cow::Borrowed(loaded));
    }
    let mut loaded = loaded.clone();
    for group in &late {
        let mut best = (look(&loaded, false)?.evidence, loaded.clone());
        let around = |best: &mut (f64, Loaded), steps: &[f64]| -> Result<(), E> {
            let from = best.1.clone();
            for by in steps {
                let mut moved = from.clone();
                group.delay(&mut moved, *by);
                let evidence = look(&moved, false)?.evidence;
                if evidence > best.0 {
                    *best = (evidence, moved);
                }
            }
            Ok(())
        };
        around(&mut best, &TRIED)?;
        let mut step = HALVED;
        while step >= finest {
            around(&mut best, &[-step, step])?;
            step *= 0.5;
        }
        loaded = best.1;
    }
    let (times, settled, longest) = RETIMED;
    for _ in 0..times {
        let LaterChannels { step, by, .. } = look(&loaded, true)?;
        if by.iter().all(|(_, by)| by.abs() < settled * step) {
            break;
        }
        by.iter().for_each(|(group, by)| group.delay(&mut loaded, by.clamp(-longest, longest)));
    }
    Ok(Cow::Owned(loaded))
}
