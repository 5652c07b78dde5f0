//! A run of an FMU as a plant, from event to event.

use trueup_fmi_import::{EventInfo, HybridFmu, iterate_events};
use trueup_numerics::driver::{
    DriverMemory, DriverOptions, DriverReached, ErrorControlledStepper, OdeSystem, Solver,
};
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::At;
use trueup_numerics::integrate::Ode;
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{LANES, Lanes, Plant};

/// Nominal value of all states, which the tolerance multiplies.
const NOMINAL: f64 = 1e-3;

/// What a run came to.
#[derive(Clone, Debug, Default)]
pub(crate) struct HybridRun {
    /// Times of events, without those of inputs that jump, in s.
    pub(crate) events: Vec<f64>,
    /// States at the end.
    pub(crate) x: Vec<f64>,
}

/// Inputs that are held from a time in s on.
pub(crate) type HeldInputs = (f64, Vec<f64>);

/// The plant between events.
struct PlantRates<'a> {
    plant: &'a HybridFmu,
    p: &'a [f64],
    u: &'a [f64],
    modes: [i32; 1],
}

impl PlantRates<'_> {
    fn at<'b>(&'b self, t: f64, x: &'b [f64]) -> At<'b, f64> {
        At { t, x, u: self.u, p: self.p, modes: &self.modes }
    }

    /// Event iteration; new states in `x`.
    fn settle(&mut self, t: f64, x: &mut [f64]) -> Result<(), String> {
        let settled = iterate_events(|| {
            let update = self.plant.update(t, x, self.u, self.p, &mut self.modes);
            self.plant.failure().map_or(Ok(()), Err)?;
            Ok::<_, String>(EventInfo { again: !update.settled(), ..EventInfo::default() })
        })?;
        settled.map(|_| ()).ok_or_else(|| format!("no end of events at t = {t} s"))
    }
}

impl Ode for PlantRates<'_> {
    fn rates(&mut self, t: f64, x: &[f64], dx: &mut [f64]) {
        self.plant.rates(self.at(t, x), &[], dx);
    }
    fn jacobian(&mut self, t: f64, x: &[f64], dfdx: &mut [f64], dfdt: &mut [f64]) {
        let n = x.len();
        let constant = |v: &[f64]| v.iter().map(|v| Dual::constant(*v)).collect::<Vec<Lanes>>();
        let (u, p) = (constant(self.u), constant(self.p));
        for first in (0..n).step_by(LANES) {
            let (mut at, mut dx) = (constant(x), vec![Lanes::default(); n]);
            (first..n).take(LANES).for_each(|j| at[j].eps[j - first] = 1.0);
            let at = At { t: Dual::constant(t), x: &at, u: &u, p: &p, modes: &self.modes };
            self.plant.rates_lanes(at, &[], &mut dx);
            for j in (first..n).take(LANES) {
                (0..n).for_each(|i| dfdx[i * n + j] = dx[i].eps[j - first]);
            }
        }
        dfdt.fill(0.0);
    }
}

impl OdeSystem for PlantRates<'_> {
    fn indicators(&mut self, t: f64, x: &[f64], z: &mut [f64]) {
        self.plant.indicators(self.at(t, x), z);
    }
}

/// From its start with parameters `p` to `stop` s; `inputs` are in order of time, the first at the start.
///
/// # Errors
/// A failure of the FMU or of the integrator.
pub(crate) fn run(
    plant: &HybridFmu,
    p: &[f64],
    inputs: &[HeldInputs],
    stop: f64,
    tolerance: f64,
) -> Result<HybridRun, String> {
    let failed = || plant.failure().map_or(Ok(()), Err);
    let sizes = plant.sizes();
    let (start, first) = inputs.first().ok_or("no inputs")?;
    let mut t = *start;
    let mut of = PlantRates { plant, p, u: first, modes: [0] };
    let mut run = HybridRun { x: vec![0.0; sizes.states], ..HybridRun::default() };
    plant.start(p, &mut run.x);
    let mut modes = of.modes;
    plant.start_modes(of.at(t, &run.x), &mut modes);
    of.modes = modes;
    let mut stepper =
        ErrorControlledStepper::new(Solver::Explicit, vec![NOMINAL; sizes.states], sizes.indicators);
    let options = DriverOptions { tolerance, ..DriverOptions::default() };
    let (mut memory, mut done) = (DriverMemory::default(), DriverReached::default());
    let mut dx = vec![0.0; sizes.states];
    for (k, (_, u)) in inputs.iter().enumerate() {
        of.u = u;
        let end = inputs.get(k + 1).map_or(stop, |next| next.0.min(stop));
        of.settle(t, &mut run.x)?;
        of.indicators(t, &run.x, stepper.restart());
        memory.step = 0.0;
        while t < end {
            let next = plant.next_event(p, &of.modes).filter(|next| *next < end);
            let to = next.unwrap_or(end).max(t);
            let crossed = if to > t {
                let both = |_| Direction::Both;
                let step =
                    stepper.step(&mut of, &both, &mut t, &mut run.x, &mut memory, to, &options, &mut done);
                failed()?;
                step.map_err(|e| e.to_string())?
            } else {
                None
            };
            of.rates(t, &run.x, &mut dx);
            let requested = plant.completed_step();
            failed()?;
            if crossed.is_some() || requested || next.is_some_and(|next| t >= next) {
                run.events.push(t);
                of.settle(t, &mut run.x)?;
                of.indicators(t, &run.x, stepper.restart());
                memory.step = 0.0;
            }
        }
    }
    failed()?;
    Ok(run)
}
