//! The frame of a case of a chain, and the model alone fitted in it.

use std::borrow::Cow;

use trueup_signals::Loaded;

use super::fit::TrajectoryFit;
use super::frame::TrajectoryFrame;
use super::plant::TrajectoryError;
use super::structures::PlantStructures;
use crate::innovations::retimed::{LaterChannels, retimed};
use crate::innovations::rig::LateGroup;

/// Rounds of the nominal model and of the refitted one.
const ROUNDS: [usize; 2] = [4, 7];
/// Least step by which delays are tried, s: latent errors of readings take what is left of one.
const DELAY: f64 = 2.5e-4;

/// The frame of a case with its nominal parameters.
///
/// # Errors
/// See [`TrajectoryError`].
pub fn chain_frame(
    loaded: &Loaded,
    structures: &PlantStructures,
) -> Result<TrajectoryFrame, TrajectoryError> {
    TrajectoryFrame::new(loaded, structures.plant.clone(), &structures.nominal, &[])
}

/// Recordings with late channels at the times that the model alone has.
///
/// # Errors
/// See [`TrajectoryError`].
pub fn prepared<'a>(
    loaded: &'a Loaded,
    structures: &PlantStructures,
) -> Result<Cow<'a, Loaded>, TrajectoryError> {
    let look = |loaded: &Loaded, fits: bool| -> Result<LaterChannels, TrajectoryError> {
        if fits {
            // No delay is left to be fitted.
            return Ok(LaterChannels::default());
        }
        let mut frame = chain_frame(loaded, structures)?.for_delays();
        frame.start()?;
        let q = frame.intensities.clone();
        let fit = frame.fit(&|_| Vec::new(), None, &q, 1, true)?;
        let evidence = fit.evidence / fit.count.max(1) as f64;
        Ok(LaterChannels { evidence, ..LaterChannels::default() })
    };
    let table = structures.plant.plant().table();
    let mut late = LateGroup::all(loaded);
    late.retain(|g| table.output(&g.channel).is_some() || table.inputs.iter().any(|q| q.name == g.channel));
    retimed(loaded, late, DELAY, look)
}

/// Fits the model alone; leaves a frame where hypotheses begin. Also the evidence with the nominal parameters.
///
/// # Errors
/// See [`TrajectoryError`].
pub fn fit_chain_null(
    loaded: &Loaded,
    structures: &PlantStructures,
) -> Result<(TrajectoryFrame, f64, TrajectoryFit), TrajectoryError> {
    fit_alone(chain_frame(loaded, structures)?)
}

/// The same in a frame in hand: of its parameters only those that are unknown there move.
///
/// # Errors
/// See [`TrajectoryError`].
pub fn fit_alone(
    mut frame: TrajectoryFrame,
) -> Result<(TrajectoryFrame, f64, TrajectoryFit), TrajectoryError> {
    frame.start()?;
    let q = frame.intensities.clone();
    let nominal = frame.clone().fit(&|_| Vec::new(), None, &q, ROUNDS[0], true)?.evidence;
    let fit = frame.fit(&|_| Vec::new(), None, &q, ROUNDS[1], false)?;
    Ok((frame, nominal, fit))
}
