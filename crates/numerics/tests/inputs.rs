//! Inputs, time events, early return: what a master does to a model.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use trueup_numerics::driver::*;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};
use trueup_numerics::{Driver, Scalar};

/// States: integral of the input; integral of the sampled input; the sampled input itself, sampled every
/// `p[0]` s. Mode 0 counts the samples, mode 1 is the sign of the input.
struct Sampler;

impl Hybrid for Sampler {
    fn sizes(&self) -> ModelSizes {
        ModelSizes { states: 3, inputs: 1, parameters: 1, modes: 2, indicators: 1, ..ModelSizes::default() }
    }
    fn start<T: Scalar>(&self, _p: &[T], x: &mut [T]) {
        x.fill(T::zero());
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        (modes[0], modes[1]) = (0, i32::from(at.u[0] > 0.0));
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        (dx[0], dx[1], dx[2]) = (at.u[0], at.x[2], T::zero());
    }
    fn outputs<T: Scalar>(&self, _at: At<T>, _y: &mut [T]) {}
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        z[0] = at.u[0];
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let sign = i32::from(u[0] > 0.0);
        let due = t >= f64::from(modes[0]) * p[0];
        let changed = due || sign != modes[1];
        modes[1] = sign;
        if due {
            x[2] = u[0];
            modes[0] += 1;
        }
        EventUpdate { modes: changed, states: due }
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        Some(f64::from(modes[0]) * p[0])
    }
}

const SOLVERS: [Solver; 3] = [Solver::Explicit, Solver::Stiff, Solver::FixedExplicit];

struct Owner {
    t: f64,
    x: [f64; 3],
    u: [f64; 1],
    p: [f64; 1],
    modes: [i32; 2],
    memory: DriverMemory,
}

impl Owner {
    /// Initialised at 0 with the given input and sample period.
    fn new(driver: &mut Driver, u: f64, period: f64) -> Self {
        let mut o =
            Self { t: 0.0, x: [0.0; 3], u: [u], p: [period], modes: [0; 2], memory: DriverMemory::default() };
        driver.initialise(&Sampler, &mut o.lend()).unwrap();
        o
    }
    fn lend(&mut self) -> DriverState<'_> {
        let Self { t, x, u, p, modes, memory } = self;
        DriverState { t, x, u, p, modes, memory }
    }
}

fn driver(solver: Solver, stop_at_event: bool) -> Driver {
    Driver::new(
        Sampler.sizes(),
        &[],
        DriverOptions { solver, stop_at_event, max_step: 0.05, ..DriverOptions::default() },
    )
}

#[test]
fn time_events_are_hit_exactly() {
    for solver in SOLVERS {
        let mut d = driver(solver, false);
        let mut o = Owner::new(&mut d, 1.0, 0.1);
        let mut times = vec![];
        d.advance_to(&Sampler, &mut o.lend(), 100.05, StepInputs::Ramp(&[2.0]), &mut |view| {
            if view.moment == DriverMoment::Event {
                times.push(view.t);
            }
            Flow::Continue
        })
        .unwrap();
        assert_eq!(times, (1..=1000).map(|k| f64::from(k) * 0.1).collect::<Vec<_>>());
        // u = 1 + 2 t; sampled at 0, 0.1 ... and held.
        let held: f64 = (0..1000).map(|k| 0.1 * (1.0 + 0.2 * f64::from(k))).sum::<f64>() + 0.05 * 201.0;
        assert!((o.x[0] / (100.05 + 100.05 * 100.05) - 1.0).abs() < 1e-11);
        assert!((o.x[1] / held - 1.0).abs() < 1e-11);
        assert_eq!(o.u[0], 1.0 + 2.0 * 100.05);
    }
}

#[test]
fn a_time_event_at_the_end_sees_the_next_inputs() {
    for solver in SOLVERS {
        let mut d = driver(solver, false);
        let mut o = Owner::new(&mut d, 1.0, 0.1);
        let mut t = 0.0;
        for k in 1..=50 {
            t += 0.1; // differs from k 0.1 by rounding
            d.advance_to(&Sampler, &mut o.lend(), t, StepInputs::Hold, &mut |_| Flow::Continue).unwrap();
            assert_eq!(o.x[2], f64::from(k), "held up to here");
            o.u[0] = f64::from(k + 1);
        }
    }
}

#[test]
fn event_mode_gets_every_event_before_it_is_handled() {
    for solver in SOLVERS {
        let mut d = driver(solver, true);
        let mut o = Owner::new(&mut d, 1.0, 0.3);
        let mut seen = vec![];
        while o.t < 0.9 {
            let base = o.u[0];
            let end = 0.9;
            let r = d
                .advance_to(&Sampler, &mut o.lend(), end, StepInputs::Ramp(&[-2.0]), &mut |_| Flow::Continue)
                .unwrap();
            assert!(base >= o.u[0] && r.t == o.t);
            if let Some(cause) = r.pending {
                let modes = o.modes;
                seen.push((cause, r.t));
                assert!(d.handle_event(&Sampler, &mut o.lend()).unwrap());
                assert_ne!(modes, o.modes);
            }
        }
        let causes: Vec<EventCause> = seen.iter().map(|s| s.0).collect();
        // The input 1 - 2 t falls through 0 at 0.5.
        assert_eq!(causes, [EventCause::Time, EventCause::Indicator(0), EventCause::Time, EventCause::Time]);
        assert!(seen[1].1 >= 0.5 && seen[1].1 - 0.5 < 1e-14);
        assert_eq!([seen[0].1, seen[2].1, seen[3].1], [0.3, 0.6, 0.9]);
    }
}

#[test]
fn observer_may_change_inputs_and_return_early() {
    for solver in SOLVERS {
        let mut d = driver(solver, false);
        let mut o = Owner::new(&mut d, 1.0, 1e9);
        let mut from = f64::INFINITY;
        let mut observer = |view: DriverView| {
            if view.t > 0.5 && from.is_infinite() {
                from = view.t;
                view.u[0] = -3.0;
                Flow::InputsChanged
            } else if view.t >= 1.0 {
                Flow::Return
            } else {
                Flow::Continue
            }
        };
        let r = d.advance_to(&Sampler, &mut o.lend(), 10.0, StepInputs::Hold, &mut observer).unwrap();
        assert!(r.t >= 1.0 && r.t < 1.2 && r.t == o.t);
        assert_eq!(o.modes[1], 0, "the jump of the input was noticed");
        assert!((o.x[0] - (from - 3.0 * (r.t - from))).abs() < 1e-12);
    }
}

#[test]
fn bad_values_and_calls_are_errors() {
    let mut d = driver(Solver::Explicit, false);
    let mut o = Owner::new(&mut d, 1.0, 0.1);
    let go = |d: &mut Driver, o: &mut Owner, t: f64| {
        d.advance_to(&Sampler, &mut o.lend(), t, StepInputs::Hold, &mut |_| Flow::Continue).map(|r| r.t)
    };
    o.u[0] = f64::NAN;
    assert_eq!(
        go(&mut d, &mut o, 1.0),
        Err(DriveError::NotFinite { t: 0.0, what: DriverQuantity::Input(0) })
    );
    o.u[0] = 1.0;
    assert!(matches!(go(&mut d, &mut o, -1.0), Err(DriveError::Backwards { .. })));
    assert!(matches!(go(&mut d, &mut o, f64::NAN), Err(DriveError::Backwards { .. })));
    o.p[0] = 0.0; // next_event never goes on
    assert!(matches!(go(&mut d, &mut o, 1.0), Err(DriveError::EventIteration { .. })));
    o.p[0] = 0.1;
    o.modes[0] = 1;
    d.options.max_steps = 5;
    assert!(matches!(go(&mut d, &mut o, 1.0), Err(DriveError::MaxSteps { steps: 5, .. })));
    d.options.max_steps = 1000;
    assert_eq!(go(&mut d, &mut o, 1.0), Ok(1.0));
}
