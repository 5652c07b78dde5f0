//! Known effects along the recordings of a frame: their states, forces, derivatives, and the tangent of those that hold it.

use nalgebra::DMatrix;

use super::frame::InnovationsFrame;
use super::known_effects::{KnownDirection, KnownEffects, KnownPoint};
use super::linear::Feedback;

/// Nodes of a recording from which a tangent is taken.
const NODES: usize = 64;

/// In what a force of known effects is differentiated.
#[derive(Clone, Copy, Debug)]
pub(super) enum KnownSeed<'a> {
    /// A number of theirs.
    Number(usize),
    /// An input, by its changes over each step.
    Input(usize, &'a [f64]),
    /// A state of theirs at the begin.
    Start(usize),
}

/// Forces of known effects over the steps of a recording, by coordinate, and their derivatives, by seed.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownAlong {
    pub(super) forces: Vec<Vec<f64>>,
    pub(super) slopes: Vec<Vec<Vec<f64>>>,
}

/// Integral of exp(J s) over a time.
fn integral(jacobian: &DMatrix<f64>, time: f64) -> DMatrix<f64> {
    let n = jacobian.nrows();
    if jacobian.iter().all(|x| *x == 0.0) {
        return DMatrix::identity(n, n) * time;
    }
    let mut joined = DMatrix::zeros(2 * n, 2 * n);
    joined.view_mut((0, 0), (n, n)).copy_from(&(jacobian * time));
    joined.view_mut((0, n), (n, n)).fill_diagonal(time);
    joined.exp().view((0, n), (n, n)).into_owned()
}

fn advanced(x: &[f64], by: &DMatrix<f64>, rate: &[f64]) -> Vec<f64> {
    let rise = |i: usize| rate.iter().enumerate().map(|(j, r)| by[(i, j)] * r).sum::<f64>();
    x.iter().enumerate().map(|(i, x)| x + rise(i)).collect()
}

impl InnovationsFrame {
    /// Numbers of the known effects in hand.
    fn known_numbers(&self, effects: &KnownEffects) -> Vec<f64> {
        let all = self.rig_numbers();
        all[all.len() - effects.numbers.len()..].to_vec()
    }
    /// Values of the model's parameters that are others in a recording than in the case.
    fn own_in(&self, recording: usize) -> Vec<(usize, f64)> {
        let mut own = self.plant.model_parameters(&self.parameters_in(recording));
        own.extend(self.intake.rig.of_effects(recording).copied());
        own
    }

    /// Known effects along the trajectory in hand; none before there is one.
    pub(super) fn along_known(
        &self,
        (effects, numbers): (&KnownEffects, &[f64]),
        recording: usize,
        seeds: &[KnownSeed<'_>],
    ) -> Option<KnownAlong> {
        let r = &self.runs[recording];
        let size = r.states.len() / r.nodes;
        if size == 0 {
            return None;
        }
        let own = self.own_in(recording);
        let parameters = &effects.parameters(numbers, &own)[..];
        let inputs: Vec<Vec<f64>> =
            (0..self.plant.input_forces().len()).map(|i| self.input_means(recording, i)).collect();
        let series = || vec![vec![0.0; r.nodes]; self.coordinates()];
        let mut along = KnownAlong { forces: series(), slopes: seeds.iter().map(|_| series()).collect() };
        let rigid = self.plant.elements().is_empty();
        let point = |t: usize, state: &mut Vec<f64>, input: &mut Vec<f64>| {
            let next = (t + 1).min(r.nodes - 1);
            state.clear();
            state.extend(
                (0..self.plant.states()).map(|i| 0.5 * (r.states[size * t + i] + r.states[size * next + i])),
            );
            input.clear();
            input.extend(inputs.iter().map(|m| m[t]));
        };
        let (mut state, mut input) = (Vec::new(), Vec::new());
        point(0, &mut state, &mut input);
        let at = KnownPoint {
            time: 0.0,
            parameters,
            state: &state,
            inner: &[],
            input: &input,
            sign: r.signs.mean[0],
            rigid,
        };
        let mut inner = if effects.have_memory(&at) { effects.start(&at) } else { Vec::new() };
        let n = inner.len();
        let begin = |seed: &KnownSeed<'_>| match seed {
            KnownSeed::Start(k) => (0..n).map(|i| f64::from(u8::from(i == *k))).collect(),
            KnownSeed::Number(_) | KnownSeed::Input(..) => vec![0.0; n],
        };
        let mut changes: Vec<Vec<f64>> = seeds.iter().map(begin).collect();
        let known_there = |k: usize| own.iter().any(|(p, _)| *p == effects.parameter_of(k));
        for t in 0..r.nodes {
            point(t, &mut state, &mut input);
            let direction = |(seed, inner): (&KnownSeed<'_>, &Vec<f64>)| KnownDirection {
                number: match seed {
                    KnownSeed::Number(k) if !known_there(*k) => Some((*k, 1.0)),
                    _ => None,
                },
                input: match seed {
                    KnownSeed::Input(k, by) => Some((*k, by[t])),
                    _ => None,
                },
                state: None,
                inner: inner.clone(),
            };
            let (time, sign) = ((t as f64 + 0.5) * r.dt, r.signs.mean[t]);
            let at =
                KnownPoint { time, parameters, state: &state, inner: &inner, input: &input, sign, rigid };
            let mut directions: Vec<KnownDirection> = seeds.iter().zip(&changes).map(direction).collect();
            let (mut middle, mut after) = (inner.clone(), Vec::new());
            if n > 0 {
                let unit = |k: usize| (0..n).map(|i| f64::from(u8::from(i == k))).collect();
                let units = (0..n).map(|k| KnownDirection { inner: unit(k), ..KnownDirection::default() });
                directions.extend(units);
                let (motion, slopes) = effects.motion(&at, &directions);
                let (of_seeds, of_units) = slopes.split_at(seeds.len());
                let jacobian = DMatrix::from_fn(n, n, |i, j| of_units[j].inner[i]);
                // (EST-18): exact for rates that are affine in the states and inputs that are constant over the step.
                let [half, whole] = [0.5, 1.0].map(|x| integral(&jacobian, x * r.dt));
                directions.truncate(seeds.len());
                middle = advanced(&inner, &half, &motion.inner);
                after = advanced(&inner, &whole, &motion.inner);
                for ((d, change), slope) in directions.iter_mut().zip(&mut changes).zip(of_seeds) {
                    d.inner = advanced(change, &half, &slope.inner);
                    *change = advanced(change, &whole, &slope.inner);
                }
            }
            let at = KnownPoint { inner: &middle, ..at };
            let (motion, slopes) = effects.motion(&at, &directions);
            along.forces.iter_mut().zip(motion.forces).for_each(|(all, f)| all[t] = f);
            for (all, slope) in along.slopes.iter_mut().zip(slopes) {
                all.iter_mut().zip(slope.forces).for_each(|(all, f)| all[t] = f);
            }
            inner = after;
        }
        Some(along)
    }

    /// Derivatives of the forces of all known effects along a recording, by seed, then by coordinate; none without any.
    pub(super) fn known_slopes(&self, recording: usize, seeds: &[KnownSeed<'_>]) -> Vec<Vec<Vec<f64>>> {
        let Some(effects) = self.plant.known_effects().filter(|_| !seeds.is_empty()) else {
            return Vec::new();
        };
        let numbers = self.known_numbers(effects);
        self.along_known((effects, &numbers), recording, seeds).map_or_else(Vec::new, |a| a.slopes)
    }

    /// Forces of known effects on the coordinates over the steps; empty: there are none.
    pub fn known_forces(&self, recording: usize) -> Vec<Vec<f64>> {
        let Some(effects) = self.plant.known_effects() else { return Vec::new() };
        let numbers = self.known_numbers(effects);
        self.along_known((effects, &numbers), recording, &[]).map_or_else(Vec::new, |a| a.forces)
    }

    /// Torque that drives, over the steps: the first input, and that of a servo with what is known of its actuator, N.m.
    pub fn drive_torque(&self, recording: usize) -> Vec<f64> {
        let theta = self.parameters_in(recording);
        let gain = self.plant.input_forces().first().map_or(0.0, |i| i.per_unit(&theta));
        let mut torque = self.input_means(recording, 0);
        torque.iter_mut().for_each(|u| *u *= gain);
        let effects = self.plant.known_effects();
        if let Some((drive, numbers)) = effects.and_then(|e| e.drive(&self.known_numbers(e))) {
            let along = self.along_known((drive, &numbers), recording, &[]).unwrap_or_default();
            for forces in along.forces {
                torque.iter_mut().zip(forces).for_each(|(u, f)| *u += f);
            }
        }
        torque
    }
    /// Whether a servo drives.
    pub fn has_servo(&self) -> bool {
        self.plant.known_effects().is_some_and(|e| e.inputs().any(|i| i.1))
    }

    /// An output of the model with its known effects along the trajectory in hand, by node; states of the effects are not followed.
    pub(super) fn output_along(&self, model: &KnownEffects, recording: usize, output: usize) -> Vec<f64> {
        let r = &self.runs[recording];
        let size = r.states.len() / r.nodes;
        let numbers = vec![1.0; model.numbers.len()];
        let parameters = &model.parameters(&numbers, &self.own_in(recording))[..];
        let inputs: Vec<Vec<f64>> =
            (0..self.plant.input_forces().len()).map(|i| self.input_means(recording, i)).collect();
        let rigid = self.plant.elements().is_empty();
        let shown = |t: usize| {
            let state = &r.states[size * t..size * t + self.plant.states()];
            let input: Vec<f64> = inputs.iter().map(|m| m[t]).collect();
            let (time, sign, input) = (r.time(t), r.signs.mean[t], &input[..]);
            model.outputs(&KnownPoint { time, parameters, state, inner: &[], input, sign, rigid })[output]
        };
        (0..r.nodes).filter(|_| size > 0).map(shown).collect()
    }

    /// Mean tangent of the known effects along the trajectory in hand where they hold the joint as a spring does.
    pub(super) fn known_tangent(&self) -> Feedback {
        let (states, forces) = (self.plant.states(), self.coordinates());
        let Some(effects) = self.plant.known_effects().filter(|e| e.hold()) else {
            return Feedback::default();
        };
        let numbers = self.known_numbers(effects);
        let rigid = self.plant.elements().is_empty();
        let directions: Vec<KnownDirection> = (0..states)
            .map(|k| KnownDirection { state: Some((k, 1.0)), ..KnownDirection::default() })
            .collect();
        let (mut sum, mut count) = (vec![0.0; states * forces], 0.0);
        for (recording, r) in self.runs.iter().enumerate().filter(|(_, r)| !r.states.is_empty()) {
            let parameters = effects.parameters(&numbers, &self.own_in(recording));
            let size = r.states.len() / r.nodes;
            let inputs: Vec<Vec<f64>> =
                (0..self.plant.input_forces().len()).map(|i| self.input_means(recording, i)).collect();
            for t in (0..r.nodes).step_by((r.nodes / NODES).max(1)) {
                let input: Vec<f64> = inputs.iter().map(|m| m[t]).collect();
                let state = &r.states[size * t..size * t + states];
                let (time, sign) = (r.time(t), r.signs.mean[t]);
                let (parameters, input) = (&parameters[..], &input[..]);
                let at = KnownPoint { time, parameters, state, inner: &[], input, sign, rigid };
                for (k, slope) in effects.motion(&at, &directions).1.iter().enumerate() {
                    (0..forces).for_each(|c| sum[states * c + k] += slope.forces[c]);
                }
                count += 1.0;
            }
        }
        if count == 0.0 {
            return Feedback::default();
        }
        sum.iter_mut().for_each(|s| *s /= count);
        Feedback(sum)
    }
}
