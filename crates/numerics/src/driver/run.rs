//! A whole simulation in one call, for reference runs.

use super::{DriveError, Driver, DriverMemory, DriverMoment, DriverOptions, DriverState, Flow, StepInputs};
use crate::hybrid::{At, Hybrid};

/// What [`simulate`] recorded.
#[derive(Clone, Debug, Default)]
pub struct SimulationRecord {
    /// Requested times in s.
    pub t: Vec<f64>,
    /// States at these times.
    pub x: Vec<Vec<f64>>,
    /// Outputs at these times.
    pub y: Vec<Vec<f64>>,
    /// Every event handled: its time in s and the modes after it.
    pub events: Vec<(f64, Vec<i32>)>,
    /// Steps accepted.
    pub accepted: usize,
    /// Steps rejected.
    pub rejected: usize,
}

/// Simulates from the initial states at `times[0]`; the integration stops at each of `times`, so inputs may
/// have kinks there.
///
/// # Errors
/// See [`DriveError`].
pub fn simulate<M: Hybrid>(
    model: &M,
    p: &[f64],
    nominal: &[f64],
    options: DriverOptions,
    inputs: &dyn Fn(f64, &mut [f64]),
    times: &[f64],
) -> Result<SimulationRecord, DriveError> {
    let n = model.sizes();
    let mut driver = Driver::new(n, nominal, DriverOptions { stop_at_event: false, ..options });
    let (mut t, mut memory) = (times.first().copied().unwrap_or(0.0), DriverMemory::default());
    let (mut x, mut u, mut modes) = (vec![0.0; n.states], vec![0.0; n.inputs], vec![0; n.modes]);
    inputs(t, &mut u);
    let mut s = DriverState { t: &mut t, x: &mut x, u: &mut u, p, modes: &mut modes, memory: &mut memory };
    driver.initialise(model, &mut s)?;
    let mut run = SimulationRecord::default();
    for &time in times {
        let events = &mut run.events;
        let reached = driver.advance_to(model, &mut s, time, StepInputs::Function(inputs), &mut |view| {
            if view.moment == DriverMoment::Event {
                events.push((view.t, view.modes.to_vec()));
            }
            Flow::Continue
        })?;
        run.accepted += reached.accepted;
        run.rejected += reached.rejected;
        let mut y = vec![0.0; n.outputs];
        model.outputs(At { t: *s.t, x: s.x, u: s.u, p, modes: s.modes }, &mut y);
        run.t.push(time);
        run.x.push(s.x.to_vec());
        run.y.push(y);
    }
    Ok(run)
}
