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

mod events;

use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::At;
use trueup_numerics::{Scalar, ShortNumber};
use trueup_plant::{Plant, PlantScalar};

pub use crate::constant_law::KeptLaws;
use crate::constant_law::{ConstantLaw, ModelLaws, StepStates, constant_laws};
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

/// The laws met so far, by their modes; `constant`: those of a run of which only the start has derivatives.
struct Laws<T> {
    known: Vec<(Vec<i32>, LinearStepLaw<T>, LinearStepLaw<f64>)>,
    constant: Option<ModelLaws>,
    current: usize,
    states: StepStates<T>,
    values: StepStates<f64>,
}

impl<T> Laws<T> {
    /// The present one, where its matrices are constant.
    fn constant(&mut self) -> Option<&mut ConstantLaw> {
        self.constant.as_mut().map(|own| &mut own.known[self.current].1)
    }
    fn modes(&self, at: usize) -> Option<&[i32]> {
        match &self.constant {
            Some(own) => own.known.get(at).map(|known| &known.0[..]),
            None => self.known.get(at).map(|known| &known.0[..]),
        }
    }
    fn count(&self) -> usize {
        self.constant.as_ref().map_or(self.known.len(), |own| own.known.len())
    }
}

struct Simulation<'a, T> {
    model: &'a dyn Plant,
    plan: &'a PredictionPlan,
    p: &'a [T],
    values: Vec<f64>,
    x: Vec<T>,
    modes: Vec<i32>,
    laws: Laws<T>,
    /// States before a step, slopes of the inputs from a node on.
    before: Vec<T>,
    slope: Vec<f64>,
    z: [Vec<f64>; 2],
    buffers: [Vec<f64>; 4],
    /// States before an event iteration, after it, and inputs.
    iterated: [Vec<f64>; 3],
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
    predict_again(model, plan, p, map, at_rest, &KeptLaws::default())
}

/// [`predict`], one of several of the same model: laws that are constant are kept for the next one.
///
/// # Errors
/// See [`PredictError`].
pub fn predict_again<T: PlantScalar>(
    model: &dyn Plant,
    plan: &PredictionPlan,
    p: &[T],
    map: &InputMap<T>,
    at_rest: bool,
    kept: &KeptLaws,
) -> Result<Prediction<T>, PredictError> {
    run((model, Some(kept)), plan, p, map, at_rest, &mut |_| ())
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
    run((model, None), plan, p, map, at_rest, each)
}

fn run<T: PlantScalar>(
    (model, kept): (&dyn Plant, Option<&KeptLaws>),
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
        laws: Laws {
            known: Vec::new(),
            constant: kept.and_then(|kept| constant_laws(model, &p, map, &plan.wanted, kept)),
            current: usize::MAX,
            states: StepStates::default(),
            values: StepStates::default(),
        },
        before: Vec::with_capacity(n.states),
        slope: vec![0.0; n.inputs],
        z: [vec![0.0; n.indicators], vec![0.0; n.indicators]],
        buffers: [vec![0.0; n.states], vec![0.0; n.states], vec![0.0; n.inputs], vec![0.0; n.inputs]],
        iterated: [vec![0.0; n.states], vec![0.0; n.states], vec![0.0; n.inputs]],
    };
    let begin = plan.nodes.first().map_or(0.0, |node| node.t);
    let (x0, u0): (Vec<f64>, Vec<f64>) = (plain(&s.x), plain(&u));
    let none = vec![0; n.modes];
    let mut first = vec![0; n.modes];
    model.start_modes(At { t: begin, x: &x0, u: &u0, p: &s.values, modes: &none }, &mut first);
    s.modes = first;
    let mut out = Prediction {
        y: vec![T::zero(); plan.len()],
        events: Vec::new(),
        modes: vec![0; plan.len() * n.modes],
    };
    let ended = s.through(begin, map, [&mut u, &mut du], each, &mut out);
    if let Some((kept, laws)) = kept.zip(s.laws.constant.take()) {
        kept.give_back(laws);
    }
    ended.map(|()| out)
}

fn plain<T: Scalar>(v: &[T]) -> Vec<f64> {
    v.iter().map(|v| v.value()).collect()
}

impl<T: PlantScalar> Simulation<'_, T> {
    /// From node to node.
    fn through(
        &mut self,
        begin: f64,
        map: &InputMap<T>,
        [u, du]: [&mut [T]; 2],
        each: &mut dyn FnMut(SimulationMoment<T>),
        out: &mut Prediction<T>,
    ) -> Result<(), PredictError> {
        let (plan, modes) = (self.plan, self.modes.len());
        self.update(begin, u)?;
        let mut y = vec![T::zero(); plan.wanted.len()];
        for (i, node) in plan.nodes.iter().enumerate() {
            plan.inputs_at(i, map, u, du);
            self.slope.iter_mut().zip(&*du).for_each(|(own, du)| *own = du.value());
            if node.jump && self.update(node.t, u)? {
                out.events.push((node.t, self.modes.clone()));
            }
            self.enter(node.t, u);
            each(SimulationMoment::Begin { t: node.t, x: &mut self.x, u: &mut *u });
            if !node.readings.is_empty() {
                self.read(node.t, u, &mut y);
                for &(channel, k) in &node.readings {
                    let at = plan.begin[channel] + k;
                    out.y[at] = y[channel];
                    each(SimulationMoment::Reading { channel, sample: k, y: y[channel] });
                    out.modes[at * modes..][..modes].copy_from_slice(&self.modes);
                }
            }
            self.advance(node, u, du, &mut out.events)?;
        }
        Ok(())
    }

    /// Finds the law of the present modes.
    fn enter(&mut self, t: f64, u: &[T]) {
        let laws = &mut self.laws;
        if laws.modes(laws.current).is_some_and(|modes| *modes == self.modes) {
            return;
        }
        let known = (0..laws.count()).find(|at| laws.modes(*at).is_some_and(|modes| *modes == self.modes));
        laws.current = known.unwrap_or_else(|| {
            if let Some(own) = &mut laws.constant {
                let f = FrozenPlant { model: self.model, p: &self.values, modes: &self.modes };
                let law = LinearStepLaw::new(&f, t, &plain(&self.x), &plain(u), self.plan);
                own.known.push((self.modes.clone(), ConstantLaw::new(law, self.plan.wanted.len())));
            } else {
                let f = FrozenPlant { model: self.model, p: self.p, modes: &self.modes };
                let law = LinearStepLaw::new(&f, t, &self.x, u, self.plan);
                let values = law.values();
                laws.known.push((self.modes.clone(), law, values));
            }
            laws.count() - 1
        });
    }

    /// Longest step of the present law, s.
    fn longest(&mut self) -> f64 {
        match self.laws.constant() {
            Some(law) => law.longest,
            None => self.laws.known[self.laws.current].1.longest,
        }
    }

    fn read(&mut self, t: f64, u: &[T], y: &mut [T]) {
        if let Some(law) = self.laws.constant() {
            return law.read(&self.x, u.iter().map(|u| u.value()), y);
        }
        let f = FrozenPlant { model: self.model, p: self.p, modes: &self.modes };
        let law = &mut self.laws.known[self.laws.current].1;
        law.read(&f, t, &self.x, u, &self.plan.wanted, y);
    }

    /// Event iteration; did anything change?
    fn update(&mut self, t: f64, u: &[T]) -> Result<bool, PredictError> {
        let [before, x, own] = &mut self.iterated;
        x.iter_mut().zip(&self.x).for_each(|(a, b)| *a = b.value());
        own.iter_mut().zip(u).for_each(|(a, b)| *a = b.value());
        for pass in 0..100 {
            before.copy_from_slice(x);
            let update = self.model.update(t, x, own, &self.values, &mut self.modes);
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
        // Indicators where a step ended are those where the next one begins.
        let mut known = false;
        let mut h = even(node.h, self.longest());
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
            if known {
                self.z.swap(0, 1);
            } else {
                self.indicators(0, t, &x0, &u0);
            }
            self.before.clone_from(&self.x);
            if let Some(own) = &mut self.laws.constant {
                let law = &mut own.known[self.laws.current].1;
                law.step(&mut self.x, [&u0, &self.slope], h, &mut self.laws.states);
            } else {
                let f = FrozenPlant { model: self.model, p: self.p, modes: &self.modes };
                self.laws.known[self.laws.current].1.step(&f, t, &mut self.x, u, du, h);
            }
            x1.iter_mut().zip(&self.x).for_each(|(a, b)| *a = b.value());
            if let Some(state) = x1.iter().position(|v| !v.is_finite()) {
                return Err(PredictError::NotFinite { run: self.plan.name.clone(), t, state });
            }
            self.indicators(1, t + h, &x1, &u1);
            let crossed: Vec<usize> = self.crossed().collect();
            known = crossed.is_empty() && due.is_none();
            if crossed.is_empty() {
                (t, left) = (t + h, left - h);
                u.iter_mut().zip(du).for_each(|(u, du)| *u += *du * h);
                if due.is_some() {
                    met += 1;
                    if self.update(t, u)? {
                        events.push((t, self.modes.clone()));
                        self.enter(t, u);
                    }
                    h = even(left, self.longest());
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
            let (tau, which) = self.locate(&crossed, t, &x0, &u0, h);
            std::mem::swap(&mut self.x, &mut self.before);
            if let Some(own) = &mut self.laws.constant {
                let law = &mut own.known[self.laws.current].1;
                law.step_once(&mut self.x, [&u0, &self.slope], tau, &mut self.laws.states);
            } else {
                let f = FrozenPlant { model: self.model, p: self.p, modes: &self.modes };
                self.laws.known[self.laws.current].1.step_once(&f, t, &mut self.x, u, du, tau);
            }
            (t, left) = (t + tau, left - tau);
            u.iter_mut().zip(du).for_each(|(u, du)| *u += *du * tau);
            if self.jump(t, which, u)? {
                events.push((t, self.modes.clone()));
                self.enter(t, u);
            }
            h = even(left, self.longest());
        }
        self.buffers = [x0, x1, u0, u1];
        Ok(())
    }
}

/// The largest step up to `longest` that divides `whole` evenly.
fn even(whole: f64, longest: f64) -> f64 {
    let pieces = (whole / longest).ceil().max(1.0);
    whole / pieces
}
