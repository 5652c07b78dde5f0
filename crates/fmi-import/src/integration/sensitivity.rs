//! A run of one FMU differentiated along the way, across its events.
//!
//! In each lane parameters p and inputs u move in one direction. Between events the sensitivities s = dx/d(lane) of the states obey
//!
//! ```text
//! ds/dt = (df/dx) s + (df/du) du + (df/dp) dp
//! ```
//!
//! by directional derivatives; steps follow the states alone. An event where an indicator z becomes 0 moves by
//! dt* = -dz/(dz/dt), and the sensitivities jump by (f- - f+) dt* in states that are continuous there.

use super::field::place;
use super::lanes::{CarriedSensitivity, Departed, Late, Sensitivities, SensitivityLane};
use super::{Failure, Fmus, IntegratedGroup, IntegrationEvent, Integrator, Member};
use crate::instance::indicator_references;
use trueup_numerics::driver::ErrorControlledStepper;

/// Nominal value of a sensitivity: steps follow the states alone.
const FREE: f64 = 1e100;
/// Half the width of a difference of indicators by tunable parameters, as a share of their move.
const WIDTH: f64 = 1e-4;

impl IntegratedGroup {
    /// Differentiates the run from here on, the states moving by `first` at present, lane after lane. The method is
    /// explicit from then on.
    ///
    /// # Errors
    /// [`Failure::NoDerivative`]: several FMUs; one that gives no directional derivatives.
    pub fn differentiate<F: Fmus + ?Sized>(
        &mut self,
        fmus: &F,
        of: Sensitivities,
        first: &[f64],
    ) -> Result<(), Failure<F::Error>> {
        let [Member { columns: Some(columns), .. }] = &self.members[..] else {
            let reason = "derivatives along the way are for one FMU that gives directional derivatives";
            return Err(Failure::NoDerivative { time: self.time, reason });
        };
        let shown = indicator_references(fmus.description(0), self.indicators).unwrap_or_default();
        let n = self.state_count();
        let mut nominal = self.stepper.nominal_mut()[..n].to_vec();
        self.x.truncate(n);
        self.x.extend(first);
        self.x.resize(n * (1 + of.lanes.len()), 0.0);
        nominal.resize(self.x.len(), FREE);
        self.settings.integrator = Integrator::Explicit;
        self.stepper =
            ErrorControlledStepper::new(self.settings.integrator.solver(false), nominal, self.indicators);
        self.mode.fresh = true;
        self.along = Some(CarriedSensitivity { columns: columns.clone(), of, shown, departed: None });
        Ok(())
    }

    /// The directions, of which what the inputs do may be changed on the way.
    pub fn sensitivities_mut(&mut self) -> Option<&mut Sensitivities> {
        self.along.as_mut().map(|along| &mut along.of)
    }

    /// How the states move in a lane.
    pub fn sensitivity(&self, lane: usize) -> &[f64] {
        let n = self.state_count();
        &self.x[n * (lane + 1)..n * (lane + 2)]
    }

    /// How variables (value references) move in a lane.
    ///
    /// # Errors
    /// Whatever the FMU returns; [`Failure::NoDerivative`].
    pub fn derivative<F: Fmus + ?Sized>(
        &self,
        fmus: &mut F,
        lane: usize,
        of: &[u32],
        column: &mut [f64],
    ) -> Result<(), Failure<F::Error>> {
        let Some(along) = &self.along else {
            return Err(Failure::NoDerivative { time: self.time, reason: "the run is not differentiated" });
        };
        let (by, seed) = along.knowns(lane, self.sensitivity(lane), self.time);
        fmus.instance(0).directional(of, &by, &seed, column).map_err(self.call())
    }

    /// Before an event: how it moves. Returns whether the FMU is in event mode already.
    pub(super) fn depart<F: Fmus + ?Sized>(&mut self, fmus: &mut F) -> Result<bool, Failure<F::Error>> {
        let Some(along) = &self.along else { return Ok(false) };
        let late = match self.mode.pending {
            Some(IntegrationEvent::Indicator(i)) => Some(self.lateness(fmus, along, i)?),
            _ => None,
        };
        let entered = late.as_ref().is_some_and(|late| late.entered);
        let departed = Some(Departed { x: self.states().to_vec(), late });
        self.along = self.along.take().map(|along| CarriedSensitivity { departed, ..along });
        Ok(entered)
    }

    /// After an event: the jump of the sensitivities.
    pub(super) fn arrive<F: Fmus + ?Sized>(&mut self, fmus: &mut F) -> Result<(), Failure<F::Error>> {
        let Some(departed) = self.along.as_mut().and_then(|along| along.departed.take()) else {
            return Ok(());
        };
        let n = self.state_count();
        self.place(fmus)?;
        let mut after = vec![0.0; n];
        if n > 0 {
            fmus.instance(0).derivatives(&mut after).map_err(self.call())?;
        }
        for lane in 0..self.x.len().checked_div(n).map_or(0, |all| all - 1) {
            let (before, dt) = match &departed.late {
                Some(late) => (&late.before, late.by[lane]),
                None => (&after, 0.0),
            };
            for i in 0..n {
                let s = n * (lane + 1) + i;
                if self.x[i].to_bits() == departed.x[i].to_bits() {
                    self.x[s] += (before[i] - after[i]) * dt;
                } else if self.x[i] == 0.0 {
                    // Stopped: wherever it came from.
                    self.x[s] = -after[i] * dt;
                } else {
                    let reason = "how an event resets a state is not known";
                    return Err(Failure::NoDerivative { time: self.time, reason });
                }
            }
        }
        Ok(())
    }

    /// Rates before the crossing of indicator `i`, here and now, and by how much later it comes in each lane:
    /// -dz / (dz/dt). The parameters' part of dz is a directional derivative where indicators are variables (FMI 3.0), else
    /// a difference in event mode, where tunable parameters may be set; then the FMU is in event mode.
    fn lateness<F: Fmus + ?Sized>(
        &self,
        fmus: &mut F,
        along: &CarriedSensitivity,
        i: usize,
    ) -> Result<Late, Failure<F::Error>> {
        let (n, t, call) = (self.state_count(), self.time, self.call());
        let mut before = vec![0.0; n];
        if n > 0 {
            fmus.instance(0).derivatives(&mut before).map_err(&call)?;
        }
        let mut z = vec![0.0; self.indicators];
        let mut at = |fmus: &mut F, t: f64, x: &[f64]| {
            place(fmus, &self.members, t, x)?;
            fmus.instance(0).indicators(&mut z).map_err(&call)?;
            Ok(z[i])
        };
        let moved = |by: f64, along: &[f64]| -> Vec<f64> {
            self.states().iter().zip(along).map(|(x, f)| x + by * f).collect()
        };
        let span = 1e-7 * t.abs().max(1e-2);
        let rate = (at(fmus, t + span, &moved(span, &before))? - at(fmus, t - span, &moved(-span, &before))?)
            / (2.0 * span);
        let (lanes, shown) = (&along.of.lanes, along.shown.get(i));
        let mut dz = Vec::new();
        for (k, lane) in lanes.iter().enumerate() {
            let s = self.sensitivity(k);
            if let Some(shown) = shown {
                self.place(fmus)?;
                let mut column = [0.0];
                self.derivative(fmus, k, &[*shown], &mut column)?;
                dz.push(column[0]);
                continue;
            }
            if !lane.u.is_empty() {
                return Err(Failure::NoDerivative {
                    time: t,
                    reason: "how inputs move an event is not known",
                });
            }
            let size = s.iter().zip(&self.x).map(|(s, x)| s.abs() / (1e-3 + x.abs())).fold(0.0, f64::max);
            let by = 1e-6 / size.max(1e-30);
            dz.push((at(fmus, t, &moved(by, s))? - at(fmus, t, &moved(-by, s))?) / (2.0 * by));
        }
        self.place(fmus)?;
        let entered = shown.is_none() && lanes.iter().any(SensitivityLane::tunes);
        if entered {
            let instance = fmus.instance(0);
            instance.enter_event_mode().map_err(&call)?;
            for (lane, dz) in lanes.iter().zip(&mut dz).filter(|(lane, _)| lane.tunes()) {
                let mut ends = [0.0; 2];
                for (end, by) in ends.iter_mut().zip([-WIDTH, WIDTH]) {
                    instance.set_float64(&lane.parameters, &lane.tuned(by)).map_err(&call)?;
                    instance.indicators(&mut z).map_err(&call)?;
                    *end = z[i];
                }
                instance.set_float64(&lane.parameters, &lane.tuned(0.0)).map_err(&call)?;
                *dz += (ends[1] - ends[0]) / (2.0 * WIDTH);
            }
        }
        // One that is only grazed has no derivative.
        let later = |dz: f64| Some(-dz / rate).filter(|dt| dt.is_finite()).unwrap_or(0.0);
        Ok(Late { before, by: dz.into_iter().map(later).collect(), entered })
    }
}
