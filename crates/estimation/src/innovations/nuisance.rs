//! What is unknown of every model: relative changes of the parameters, and the zeros of the encoders.
//!
//! Forces of parameters come from the model's own rates along the smoothed trajectory, never from a smoothed acceleration and
//! never from a latent: else their sum would be what is left of the data, and all of them would shrink together.

use super::column::{ColumnPart, FilterColumn};
use super::evidence::AmplitudePriors;
use super::frame::InnovationsFrame;
use super::plant::StepMeans;
use super::rig::RigNumber;

impl InnovationsFrame {
    /// Columns of the unknown parameters (relative changes) and of the zeros of further angles, with their priors about the
    /// point in hand.
    pub fn nuisances(&self) -> (Vec<FilterColumn>, AmplitudePriors) {
        let mut priors = AmplitudePriors { parameters: self.unknown.len(), ..AmplitudePriors::default() };
        let forces: Vec<_> = (0..self.runs.len()).map(|k| self.sensitivities(k)).collect();
        let mut columns = Vec::new();
        for (i, k) in self.unknown.iter().enumerate() {
            let [value, deviation] = self.believed(*k);
            let ratio = value / self.theta[*k];
            priors.mean.push(ratio - 1.0);
            priors.deviation.push(deviation * ratio);
            columns.push(forces.iter().map(|f| f[i].clone()).collect());
        }
        for (c, _) in self.intake.channels.iter().enumerate().filter(|(_, c)| c.angle).skip(1) {
            let zero = self.intake.zero();
            columns.push(self.runs.iter().map(|r| ColumnPart::reading(c, vec![zero; r.nodes])).collect());
            priors.mean.push(0.0);
            priors.deviation.push(1.0);
        }
        (columns, priors)
    }

    /// Forces of the unknown parameters along a recording.
    fn sensitivities(&self, recording: usize) -> Vec<ColumnPart> {
        let r = &self.runs[recording];
        let (states, forces) = (self.plant.states(), self.coordinates());
        let size = states + forces;
        let mut series = vec![vec![vec![0.0; r.nodes]; forces]; self.unknown.len()];
        let mut sign = vec![0.0; forces];
        let inputs: Vec<Vec<f64>> =
            (0..self.plant.input_forces().len()).map(|i| self.input_means(recording, i)).collect();
        let (mut own, mut input) = (vec![0.0; forces], vec![0.0; inputs.len()]);
        let parameters = self.plant.parameters().len();
        let mut all = vec![0.0; parameters * forces];
        let known = self.known_forces(recording);
        for t in 0..r.nodes {
            let next = (t + 1).min(r.nodes - 1);
            let at = |i: usize| 0.5 * (r.states[size * t + i] + r.states[size * next + i]);
            let state: Vec<f64> = (0..states).map(at).collect();
            own.iter_mut().zip(&r.own.forces).for_each(|(o, f)| *o = f[t]);
            own.iter_mut().zip(&known).for_each(|(o, f)| *o += f[t]);
            input.iter_mut().zip(&inputs).for_each(|(u, m)| *u = m[t]);
            sign[self.driven()] = r.signs.mean[t];
            let means = StepMeans { state: &state, input: &input, sign: &sign, own: &own };
            self.plant.sensitivities(&self.theta, &means, &mut all); // (EST-11)
            for (s, k) in series.iter_mut().zip(&self.unknown).filter(|(_, k)| **k < parameters) {
                (0..forces).for_each(|c| s[c][t] = all[forces * k + c]);
            }
        }
        for (s, k) in series.iter_mut().zip(&self.unknown).filter(|(_, k)| **k >= parameters) {
            if let Some((on, forces)) = self.rig_column(*k - parameters, &inputs) {
                s[on] = forces;
            }
        }
        self.add_effect_columns(recording, &mut series);
        let part = |s: Vec<Vec<f64>>| {
            let mut part = ColumnPart::default();
            for (c, values) in s.into_iter().enumerate() {
                part.forces.extend(ColumnPart::force(c, values).forces);
            }
            part
        };
        series.into_iter().map(part).collect()
    }

    /// Forces of relative changes of the numbers of known effects.
    fn add_effect_columns(&self, recording: usize, series: &mut [Vec<Vec<f64>>]) {
        let numbers = self.rig_numbers();
        let parameters = self.plant.parameters().len();
        let of = |k: usize| k.checked_sub(parameters).map(|term| (term, self.intake.rig.terms[term].of));
        // (EST-18)
        self.along_known(recording, |t, effects, at| {
            let slopes = effects.slopes(at);
            for (s, k) in series.iter_mut().zip(&self.unknown) {
                let Some((term, RigNumber::Effect(number))) = of(*k) else { continue };
                s.iter_mut().zip(slopes[number]).for_each(|(s, slope)| s[t] = numbers[term] * slope);
            }
        });
    }

    /// Coordinate and force of a relative change of gain or offset of an input, `None` of another number; `inputs`: means as in hand.
    fn rig_column(&self, term: usize, inputs: &[Vec<f64>]) -> Option<(usize, Vec<f64>)> {
        let (t, number) = (&self.intake.rig.terms[term], self.rig_numbers()[term]);
        let of_input = |k: usize, u: &dyn Fn(f64) -> f64| {
            let force = &self.plant.input_forces()[k];
            let per_unit = force.per_unit(&self.theta);
            Some((force.coordinate, inputs[k].iter().map(|x| per_unit * u(*x)).collect()))
        };
        // (EST-16)
        match t.of {
            RigNumber::InputGain(k) => {
                let [_, taken] = self.intake.rig.of_input(self.rig_numbers(), k);
                of_input(k, &|u| u + taken)
            }
            RigNumber::InputOffset(k) => of_input(k, &|_| -t.unit * number),
            RigNumber::Effect(_) => None,
        }
    }
}
