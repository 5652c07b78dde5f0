//! Free-running simulation of a recording: what the sensors would have shown, with exact derivatives.
//!
//! The run is cut at every sample of the inputs and at every instant that a sensor shows (its reading's time less its
//! delay). Within a piece the modes are frozen and [`crate::law`] makes the step; on duals it carries the derivatives
//! of the discrete solution.
//!
//! **Across events.** An event at t* where an indicator z(x, u, p) becomes 0 moves with the parameters by
//! dt* = -dz/(dz/dt). A dual run locates t* by value, moves its states along the old rates by dt*, applies the reset,
//! and moves them back along the new rates: the jump ("saltation") of the sensitivities,
//! s+ = dR (s- + f- dt*) - f+ dt*. Where the inputs jump, the instant does not move and dt* = 0. An event that is only
//! grazed (dz/dt = 0) has no derivative; there the jump is left out.

use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::At;
use trueup_numerics::{Dual, Scalar, ShortNumber};
use trueup_plant::{Lanes, Plant, PlantScalar};

use crate::law::{FrozenPlant, LinearStepLaw};
pub use crate::plan::PredictionPlan;
use crate::plan::{PlanNode, TICK};
pub use crate::sensors::InputMap;

/// A prediction that could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PredictError {
    /// A state left the real numbers.
    #[error("the simulation of {run} diverges at t = {} s: state {state} is not finite", ShortNumber(*.t))]
    NotFinite {
        /// Recording.
        run: String,
        /// Time in s.
        t: f64,
        /// Index of the state.
        state: usize,
    },
    /// Events without end.
    #[error(
        "the simulation of {run} has more than {MOST_EVENTS} events between t = {} s and the next sample",
        ShortNumber(*.t)
    )]
    Chatter {
        /// Recording.
        run: String,
        /// Time in s.
        t: f64,
    },
    /// An FMU failed.
    #[error("the simulation of {run} through the FMU fails: {what}")]
    Fmu {
        /// Recording.
        run: String,
        /// Its message.
        what: String,
    },
    /// The model is too fast for these samples.
    #[error("the simulation of {run} needs steps of {} s at t = {} s: too stiff for these parameters", ShortNumber(*.step), ShortNumber(*.t))]
    Stiff {
        /// Recording.
        run: String,
        /// Time in s.
        t: f64,
        /// s.
        step: f64,
    },
}

/// Events between two nodes after which a simulation gives up.
pub(crate) const MOST_EVENTS: usize = 200;

/// What an observer of a simulation sees, and may change.
#[derive(Debug)]
pub enum SimulationMoment<'a, T> {
    /// At each instant, before anything is read: time in s, states, inputs.
    Begin {
        /// s.
        t: f64,
        /// States.
        x: &'a mut [T],
        /// Inputs.
        u: &'a mut [T],
    },
    /// A reading of a channel.
    Reading {
        /// Of the run, by index.
        channel: usize,
        /// Of the channel, by index.
        sample: usize,
        /// Simulated.
        y: T,
    },
}

/// A prediction.
#[derive(Clone, Debug)]
pub struct Prediction<T> {
    /// Readings, channel after channel ([`PredictionPlan::channels`]).
    pub y: Vec<T>,
    /// Events at which modes or states changed: time in s, modes after.
    pub events: Vec<(f64, Vec<i32>)>,
    /// Modes at each reading, as `modes[reading * count + k]`.
    pub modes: Vec<i32>,
}

/// The laws met so far, by their modes.
struct Laws<T> {
    known: Vec<(Vec<i32>, LinearStepLaw<T>, LinearStepLaw<f64>)>,
    current: usize,
}

struct Simulation<'a, T> {
    model: &'a dyn Plant,
    plan: &'a PredictionPlan,
    p: &'a [T],
    values: Vec<f64>,
    x: Vec<T>,
    modes: Vec<i32>,
    laws: Laws<T>,
    z: [Vec<f64>; 2],
    buffers: [Vec<f64>; 4],
}

/// Predicts the readings of a run with parameters `p`; initial states are parameters (`Hybrid::start`).
/// `at_rest`: they are first set to the equilibrium ([`Plant::rest`]).
///
/// # Errors
/// See [`PredictError`].
pub fn predict<T: PlantScalar>(
    model: &dyn Plant,
    plan: &PredictionPlan,
    p: &[T],
    map: &InputMap<T>,
    at_rest: bool,
) -> Result<Prediction<T>, PredictError> {
    follow(model, plan, p, map, at_rest, &mut |_| ())
}

/// [`predict`] with an observer.
///
/// # Errors
/// See [`PredictError`].
pub fn follow<T: PlantScalar>(
    model: &dyn Plant,
    plan: &PredictionPlan,
    p: &[T],
    map: &InputMap<T>,
    at_rest: bool,
    each: &mut dyn FnMut(SimulationMoment<T>),
) -> Result<Prediction<T>, PredictError> {
    let n = model.sizes();
    let mut p = p.to_vec();
    let (mut u, mut du) = (vec![T::zero(); n.inputs], vec![T::zero(); n.inputs]);
    let fill = |node: usize, u: &mut [T], du: &mut [T]| plan.inputs_at(node, map, u, du);
    fill(0, &mut u, &mut du);
    if at_rest {
        T::rest(model, &mut p, &u);
    }
    let mut x = vec![T::zero(); n.states];
    T::start(model, &p, &mut x);
    let values: Vec<f64> = p.iter().map(|v| v.value()).collect();
    let mut s = Simulation {
        model,
        plan,
        p: &p,
        values,
        x,
        modes: vec![0; n.modes],
        laws: Laws { known: Vec::new(), current: usize::MAX },
        z: [vec![0.0; n.indicators], vec![0.0; n.indicators]],
        buffers: [vec![0.0; n.states], vec![0.0; n.states], vec![0.0; n.inputs], vec![0.0; n.inputs]],
    };
    let begin = plan.nodes.first().map_or(0.0, |node| node.t);
    let (x0, u0): (Vec<f64>, Vec<f64>) = (plain(&s.x), plain(&u));
    let none = vec![0; n.modes];
    let mut first = vec![0; n.modes];
    model.start_modes(At { t: begin, x: &x0, u: &u0, p: &s.values, modes: &none }, &mut first);
    s.modes = first;
    s.update(begin, &u)?;
    let mut out = Prediction {
        y: vec![T::zero(); plan.len()],
        events: Vec::new(),
        modes: vec![0; plan.len() * n.modes],
    };
    let mut y = vec![T::zero(); plan.wanted.len()];
    for (i, node) in plan.nodes.iter().enumerate() {
        fill(i, &mut u, &mut du);
        if node.jump && s.update(node.t, &u)? {
            out.events.push((node.t, s.modes.clone()));
        }
        s.enter(node.t, &u);
        each(SimulationMoment::Begin { t: node.t, x: &mut s.x, u: &mut u });
        if !node.readings.is_empty() {
            s.read(node.t, &u, &mut y);
            for &(channel, k) in &node.readings {
                let at = plan.begin[channel] + k;
                out.y[at] = y[channel];
                each(SimulationMoment::Reading { channel, sample: k, y: y[channel] });
                out.modes[at * n.modes..][..n.modes].copy_from_slice(&s.modes);
            }
        }
        s.advance(node, &mut u, &du, &mut out.events)?;
    }
    Ok(out)
}

fn plain<T: Scalar>(v: &[T]) -> Vec<f64> {
    v.iter().map(|v| v.value()).collect()
}

impl<T: PlantScalar> Simulation<'_, T> {
    /// Finds the law of the present modes.
    fn enter(&mut self, t: f64, u: &[T]) {
        let laws = &mut self.laws;
        if laws.known.get(laws.current).is_some_and(|(modes, ..)| *modes == self.modes) {
            return;
        }
        laws.current = laws.known.iter().position(|(modes, ..)| *modes == self.modes).unwrap_or_else(|| {
            let f = FrozenPlant { model: self.model, p: self.p, modes: &self.modes };
            let law = LinearStepLaw::new(&f, t, &self.x, u, &self.plan.wanted);
            let values = law.values();
            laws.known.push((self.modes.clone(), law, values));
            laws.known.len() - 1
        });
    }

    fn read(&mut self, t: f64, u: &[T], y: &mut [T]) {
        let f = FrozenPlant { model: self.model, p: self.p, modes: &self.modes };
        let law = &mut self.laws.known[self.laws.current].1;
        law.read(&f, t, &self.x, u, &self.plan.wanted, y);
    }

    /// Event iteration; did anything change?
    fn update(&mut self, t: f64, u: &[T]) -> Result<bool, PredictError> {
        let (mut x, u) = (plain(&self.x), plain(u));
        for pass in 0..100 {
            let before = x.clone();
            let update = self.model.update(t, &mut x, &u, &self.values, &mut self.modes);
            for i in 0..x.len() {
                if x[i].to_bits() != before[i].to_bits() {
                    self.x[i] = T::constant(x[i]);
                }
            }
            if update.settled() {
                return Ok(pass > 0);
            }
        }
        Err(PredictError::Chatter { run: self.plan.name.clone(), t })
    }

    fn indicators(&mut self, side: usize, t: f64, x: &[f64], u: &[f64]) {
        let at = At { t, x, u, p: &self.values, modes: &self.modes };
        self.model.indicators(at, &mut self.z[side]);
    }

    /// Which indicators changed their domain from side 0 to side 1.
    fn crossed(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.z[0].len()).filter(|&i| {
            let (before, after) = (self.z[0][i] > 0.0, self.z[1][i] > 0.0);
            before != after
                && match self.model.direction(i) {
                    Direction::Both => true,
                    Direction::Up => after,
                    Direction::Down => before,
                }
        })
    }

    /// From a node to the next one; `u` is moved along.
    fn advance(
        &mut self,
        node: &PlanNode,
        u: &mut [T],
        du: &[T],
        events: &mut Vec<(f64, Vec<i32>)>,
    ) -> Result<(), PredictError> {
        if node.h <= 0.0 {
            return Ok(());
        }
        let [mut x0, mut x1, mut u0, mut u1] = core::mem::take(&mut self.buffers);
        let (mut t, mut left, mut met) = (node.t, node.h, 0);
        let longest = self.laws.known[self.laws.current].1.longest;
        let mut h = even(node.h, longest);
        while left > 0.0 {
            if h < node.h / self.plan.most_steps && h < left {
                return Err(PredictError::Stiff { run: self.plan.name.clone(), t, step: h });
            }
            if left < 1.5 * h {
                h = left;
            }
            let due = self.model.next_event(&self.values, &self.modes).filter(|due| *due < t + h);
            if let Some(due) = due {
                h = (due - t).max(TICK.min(left));
            }
            x0.iter_mut().zip(&self.x).for_each(|(a, b)| *a = b.value());
            for (i, (a, b)) in u0.iter_mut().zip(&mut u1).enumerate() {
                (*a, *b) = (u[i].value(), (u[i] + du[i] * h).value());
            }
            self.indicators(0, t, &x0, &u0);
            let before = self.x.clone();
            let f = FrozenPlant { model: self.model, p: self.p, modes: &self.modes };
            self.laws.known[self.laws.current].1.step(&f, t, &mut self.x, u, du, h);
            x1.iter_mut().zip(&self.x).for_each(|(a, b)| *a = b.value());
            if let Some(state) = x1.iter().position(|v| !v.is_finite()) {
                return Err(PredictError::NotFinite { run: self.plan.name.clone(), t, state });
            }
            self.indicators(1, t + h, &x1, &u1);
            let crossed: Vec<usize> = self.crossed().collect();
            if crossed.is_empty() {
                (t, left) = (t + h, left - h);
                u.iter_mut().zip(du).for_each(|(u, du)| *u += *du * h);
                if due.is_some() {
                    met += 1;
                    if self.update(t, u)? {
                        events.push((t, self.modes.clone()));
                        self.enter(t, u);
                    }
                    h = even(left, self.laws.known[self.laws.current].1.longest);
                }
                if met > MOST_EVENTS {
                    return Err(PredictError::Chatter { run: self.plan.name.clone(), t });
                }
                continue;
            }
            met += 1;
            if met > MOST_EVENTS {
                return Err(PredictError::Chatter { run: self.plan.name.clone(), t });
            }
            let slope = plain(du);
            let (tau, which) = self.locate(&crossed, t, &x0, &u0, &slope, h);
            self.x = before;
            let f = FrozenPlant { model: self.model, p: self.p, modes: &self.modes };
            self.laws.known[self.laws.current].1.step_once(&f, t, &mut self.x, u, du, tau);
            (t, left) = (t + tau, left - tau);
            u.iter_mut().zip(du).for_each(|(u, du)| *u += *du * tau);
            if self.jump(t, which, u, &slope)? {
                events.push((t, self.modes.clone()));
                self.enter(t, u);
            }
            let longest = self.laws.known[self.laws.current].1.longest;
            h = even(left, longest);
        }
        self.buffers = [x0, x1, u0, u1];
        Ok(())
    }

    /// The earliest of the crossings within (0, h]: the time at which it has just happened, and which it is.
    fn locate(
        &mut self,
        crossed: &[usize],
        t: f64,
        x0: &[f64],
        u0: &[f64],
        du: &[f64],
        h: f64,
    ) -> (f64, usize) {
        let f = FrozenPlant { model: self.model, p: &self.values, modes: &self.modes };
        let law = &mut self.laws.known[self.laws.current].2;
        let (mut x, mut u) = (x0.to_vec(), u0.to_vec());
        let mut z = self.z[0].clone();
        let mut at = |tau: f64, i: usize| {
            x.copy_from_slice(x0);
            law.step_once(&f, t, &mut x, u0, du, tau);
            u.iter_mut().zip(u0.iter().zip(du)).for_each(|(u, (u0, du))| *u = u0 + du * tau);
            let at = At { t: t + tau, x: &x, u: &u, p: f.p, modes: f.modes };
            f.model.indicators(at, &mut z);
            z[i]
        };
        let mut earliest = (h, crossed[0]);
        for &i in crossed {
            // Illinois: false position that halves the end that stays.
            let before = self.z[0][i] > 0.0;
            let (mut a, mut b, mut za, mut zb) = (0.0, earliest.0, self.z[0][i], at(earliest.0, i));
            if (zb > 0.0) == before {
                continue;
            }
            let mut stayed = 0;
            for _ in 0..100 {
                if b - a <= 4.0 * f64::EPSILON * (t.abs() + h) {
                    break;
                }
                let middle = b - zb * (b - a) / (zb - za);
                let tau = if middle > a && middle < b { middle } else { 0.5 * (a + b) };
                let tau = if !(-3..=3).contains(&stayed) { 0.5 * (a + b) } else { tau };
                let zt = at(tau, i);
                if (zt > 0.0) == before {
                    (a, za) = (tau, zt);
                    stayed = if stayed > 0 { stayed + 1 } else { 1 };
                    zb *= if stayed > 1 { 0.5 } else { 1.0 };
                } else {
                    (b, zb) = (tau, zt);
                    stayed = if stayed < 0 { stayed - 1 } else { -1 };
                    za *= if stayed < -1 { 0.5 } else { 1.0 };
                }
            }
            earliest = (b, i);
        }
        earliest
    }

    /// Event iteration with the jump of the sensitivities; did anything change?
    fn jump(&mut self, t: f64, which: usize, u: &[T], du: &[f64]) -> Result<bool, PredictError> {
        let n = self.model.sizes();
        let modes = self.modes.clone();
        let (mut z, mut old) = (vec![T::zero(); n.indicators], vec![T::zero(); n.states]);
        let at = At { t: T::constant(t), x: &self.x, u, p: self.p, modes: &modes };
        T::indicators(self.model, at, &mut z);
        T::rates(self.model, at, &[], &mut old);
        let along = self.indicator_rate(t, which, &plain(&self.x), &plain(u), &plain(&old), du);
        // Value 0, derivative that of the event's time.
        let shift = if along != 0.0 && along.is_finite() {
            (z[which] - T::constant(z[which].value())) * (-1.0 / along)
        } else {
            T::zero()
        };
        self.x.iter_mut().zip(&old).for_each(|(x, f)| *x += *f * shift);
        let changed = self.update(t, u)?;
        let mut new = vec![T::zero(); n.states];
        let at = At { t: T::constant(t), x: &self.x, u, p: self.p, modes: &self.modes };
        T::rates(self.model, at, &[], &mut new);
        self.x.iter_mut().zip(&new).for_each(|(x, f)| *x += *f * -shift);
        Ok(changed)
    }

    /// dz/dt of an indicator along the motion.
    fn indicator_rate(&self, t: f64, which: usize, x: &[f64], u: &[f64], dx: &[f64], du: &[f64]) -> f64 {
        let moving = |v: f64, d: f64| -> Lanes {
            let mut moving = Dual::constant(v);
            moving.eps[0] = d;
            moving
        };
        let along =
            |v: &[f64], d: &[f64]| -> Vec<Lanes> { v.iter().zip(d).map(|(v, d)| moving(*v, *d)).collect() };
        let p: Vec<Lanes> = self.values.iter().map(|v| Dual::constant(*v)).collect();
        let mut z = vec![Lanes::default(); self.z[0].len()];
        let (x, u) = (along(x, dx), along(u, du));
        let at = At { t: moving(t, 1.0), x: &x, u: &u, p: &p, modes: &self.modes };
        self.model.indicators_lanes(at, &mut z);
        z[which].eps[0]
    }
}

/// The largest step up to `longest` that divides `whole` evenly.
fn even(whole: f64, longest: f64) -> f64 {
    let pieces = (whole / longest).ceil().max(1.0);
    whole / pieces
}
