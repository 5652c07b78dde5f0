//! What is unknown of every model: relative changes of the parameters, what adds to readings, and the zeros of the encoders.
//!
//! Forces of parameters come from the model's own rates along the smoothed trajectory, never from a smoothed acceleration and
//! never from a latent: else their sum would be what is left of the data, and all of them would shrink together.

use super::column::{ColumnPart, FilterColumn};
use super::evidence::AmplitudePriors;
use super::frame::InnovationsFrame;
use super::known_along::KnownSeed;
use super::numeric::gradient;
use super::plant::StepMeans;
use super::rig::{AddedNumber, AddedTerm, RigNumber};

impl InnovationsFrame {
    /// Columns of the unknown parameters (relative changes), of what a rig adds to readings, and of the zeros of further angles,
    /// with their priors about the point in hand.
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
        for term in &self.intake.rig.added {
            columns.push((0..self.runs.len()).map(|k| self.added_part(term, k)).collect());
            priors.mean.push(term.mean);
            priors.deviation.push(1.0);
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
        let theta = self.parameters_in(recording);
        let rig = &self.intake.rig;
        let mut gear = vec![vec![0.0; r.nodes]; forces];
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
            self.plant.sensitivities(&theta, &means, &mut all); // (EST-11)
            if let Some(k) = rig.geared_inertia() {
                gear.iter_mut().enumerate().for_each(|(c, g)| g[t] = -2.0 * all[forces * k + c]);
            }
            let common = |k: &usize| *k < parameters && !rig.is_own(*k, recording);
            for (s, k) in series.iter_mut().zip(&self.unknown).filter(|(_, k)| common(k)) {
                (0..forces).for_each(|c| s[c][t] = all[forces * k + c]);
            }
        }
        self.add_effect_columns(recording, &inputs, &mut series);
        let part = |s: Vec<Vec<f64>>| {
            let mut part = ColumnPart::default();
            for (c, values) in s.into_iter().enumerate() {
                part.forces.extend(ColumnPart::force(c, values).forces);
            }
            part
        };
        let mut parts: Vec<ColumnPart> = series.into_iter().map(part).collect();
        self.add_element_readings(recording, &theta, &mut parts);
        for (p, k) in parts.iter_mut().zip(&self.unknown).filter(|(_, k)| **k >= parameters) {
            if let Some(of_rig) = self.rig_part(*k - parameters, recording, &inputs, &gear) {
                if self.plant.known_effects().is_none() {
                    p.forces.clear();
                }
                p.forces.extend(of_rig.forces);
                p.readings.extend(of_rig.readings);
            }
        }
        parts
    }

    /// What channels that show the force of an elastic element read of relative changes of its parameters.
    fn add_element_readings(&self, recording: usize, theta: &[f64], parts: &mut [ColumnPart]) {
        let r = &self.runs[recording];
        let size = r.states.len() / r.nodes;
        for (c, channel) in self.intake.channels.iter().enumerate() {
            let of = self.plant.readings()[channel.reading].element;
            let Some(element) = of.and_then(|e| self.plant.elements().get(e)) else { continue };
            let factor = self.intake.rig.of_reading(self.rig_numbers(), c, recording);
            for (k, sum) in [(element.stiffness, &element.deflection), (element.damping, &element.rate)] {
                let Some(at) = self.unknown.iter().position(|u| *u == k) else { continue };
                if self.intake.rig.is_own(k, recording) {
                    continue;
                }
                let along = |x: &[f64]| sum.iter().zip(x).map(|(s, x)| s * x).sum::<f64>();
                let values = r.states.chunks(size).map(|x| factor * theta[k] * along(x)).collect();
                parts[at].readings.extend(ColumnPart::reading(c, values).readings); // (EST-22)
            }
        }
    }

    /// What the model shows of a channel along the smoothed trajectory, and its rate, by node.
    fn shown(&self, recording: usize, channel: usize) -> [Vec<f64>; 2] {
        let (r, channels) = (&self.runs[recording], self.channels());
        let size = r.states.len() / r.nodes;
        let row = |t: usize| &r.linear.rows.h[size * (channels * t + channel)..][..size];
        let state = |t: usize| &r.states[size * t..size * (t + 1)];
        let shown = |t: usize| row(t).iter().zip(state(t)).map(|(h, x)| h * x).sum::<f64>();
        let c = &self.intake.channels[channel];
        let coordinate = &self.plant.coordinates()[self.plant.readings()[c.reading].coordinate];
        let factor = self.intake.rig.of_reading(self.rig_numbers(), channel, recording);
        let read: Vec<f64> = (0..r.nodes).map(shown).collect();
        let rate = if c.angle {
            r.state(coordinate.velocity).iter().map(|v| factor * v).collect()
        } else {
            gradient(&read).iter().map(|v| v / r.dt).collect()
        };
        [read, rate]
    }

    /// What adds to the readings of a recording, where its number is 1.
    fn added_part(&self, term: &AddedTerm, recording: usize) -> ColumnPart {
        let r = &self.runs[recording];
        if term.only.as_ref().is_some_and(|only| !only.contains(&recording)) {
            return ColumnPart::default();
        }
        // (EST-19)
        match term.of {
            AddedNumber::ReadingOffset { channel, recording: own } if own == recording => {
                ColumnPart::reading(channel, vec![term.size; r.nodes])
            }
            AddedNumber::ReadingOffset { .. } => ColumnPart::default(),
            AddedNumber::ReadingDelay(c) => {
                let [_, rate] = self.shown(recording, c);
                ColumnPart::reading(c, rate.iter().map(|v| -term.size * v).collect())
            }
            AddedNumber::InputDelay(k) => {
                let Some(input) = &self.intake.recordings[recording].inputs[k] else {
                    return ColumnPart::default();
                };
                let force = &self.plant.input_forces()[k];
                let [factor, _] = self.intake.rig.of_input(self.rig_numbers(), k, recording);
                let unit = term.size * factor / r.dt;
                // It acted before the record has it: at its half a step later less that half a step before.
                let [later, before] = [-0.5, 0.5].map(|x| input.delayed(x * r.dt));
                let rise: Vec<f64> = later.iter().zip(&before).map(|(a, b)| unit * (a - b)).collect();
                let mut part = self.known_part(recording, KnownSeed::Input(k, &rise), 1.0);
                let per_unit = force.per_unit(&self.parameters_in(recording));
                let direct = rise.iter().map(|x| per_unit * x).collect();
                part.forces.extend(ColumnPart::force(force.coordinate, direct).forces);
                part
            }
            AddedNumber::ServoState { state, recording: own } if own == recording => {
                self.known_part(recording, KnownSeed::Start(state), term.size)
            }
            AddedNumber::ServoState { .. } => ColumnPart::default(),
        }
    }

    /// Forces of known effects in the direction of a seed, times a size.
    fn known_part(&self, recording: usize, seed: KnownSeed<'_>, size: f64) -> ColumnPart {
        let mut part = ColumnPart::default();
        let slopes = self.known_slopes(recording, &[seed]);
        for (c, mut values) in slopes.into_iter().flatten().enumerate() {
            values.iter_mut().for_each(|x| *x *= size);
            part.forces.extend(ColumnPart::force(c, values).forces);
        }
        part
    }

    /// What known effects make of relative changes of their numbers and of what the rig has of inputs.
    fn add_effect_columns(&self, recording: usize, inputs: &[Vec<f64>], series: &mut [Vec<Vec<f64>>]) {
        let (numbers, parameters) = (self.rig_numbers(), self.plant.parameters().len());
        if self.plant.known_effects().is_none() {
            return;
        }
        let terms = self.unknown.iter().map(|k| k.checked_sub(parameters));
        let changes: Vec<Option<(usize, Vec<f64>)>> =
            terms.clone().map(|t| self.input_change(t?, recording, inputs)).collect();
        let mut places = Vec::new();
        let mut seeds = Vec::new();
        for (at, (term, change)) in terms.zip(&changes).enumerate() {
            let Some(term) = term else { continue };
            match (self.intake.rig.terms[term].of, change) {
                (RigNumber::Effect(number), _) => {
                    places.push((at, numbers[term]));
                    seeds.push(KnownSeed::Number(number));
                }
                (_, Some((input, by))) => {
                    places.push((at, 1.0));
                    seeds.push(KnownSeed::Input(*input, by));
                }
                _ => {}
            }
        }
        // (EST-18)
        for ((at, factor), slopes) in places.into_iter().zip(self.known_slopes(recording, &seeds)) {
            for (sum, slope) in series[at].iter_mut().zip(slopes) {
                sum.iter_mut().zip(slope).for_each(|(s, x)| *s += factor * x);
            }
        }
    }

    /// How an input changes over the steps with a relative change of a number of the rig, and which; `inputs`: means as in hand.
    fn input_change(&self, term: usize, recording: usize, inputs: &[Vec<f64>]) -> Option<(usize, Vec<f64>)> {
        let (rig, numbers) = (&self.intake.rig, self.rig_numbers());
        let (t, number) = (&rig.terms[term], numbers[term]);
        if !t.is_in(recording) {
            return None;
        }
        match t.of {
            RigNumber::InputGain(k) => {
                let [_, taken] = rig.of_input(numbers, k, recording);
                Some((k, inputs[k].iter().map(|u| u + taken).collect()))
            }
            RigNumber::InputOffset(k) => {
                let all = numbers.iter().zip(&rig.terms).map(|(n, t)| match t.of {
                    RigNumber::GearRatio if rig.is_geared(k) => 1.0 / n,
                    _ => 1.0,
                });
                Some((k, vec![-t.unit * number * all.product::<f64>(); inputs[k].len()]))
            }
            RigNumber::ReadingGain(_) | RigNumber::GearRatio | RigNumber::Effect(_) => None,
        }
    }

    /// A relative change of a number of the rig in a recording, `None` of a known effect; `inputs`: means as in hand, `gear`: forces on
    /// the coordinates of an inertia behind the gear that is taken to be smaller by twice that.
    fn rig_part(
        &self,
        term: usize,
        recording: usize,
        inputs: &[Vec<f64>],
        gear: &[Vec<f64>],
    ) -> Option<ColumnPart> {
        let rig = &self.intake.rig;
        let theta = self.parameters_in(recording);
        let of_input = |k: usize, u: &dyn Fn(f64) -> f64| {
            let force = &self.plant.input_forces()[k];
            let per_unit = force.per_unit(&theta);
            ColumnPart::force(force.coordinate, inputs[k].iter().map(|x| per_unit * u(*x)).collect())
        };
        // (EST-16)
        Some(match rig.terms[term].of {
            RigNumber::InputGain(_) | RigNumber::InputOffset(_) => {
                let (k, change) = self.input_change(term, recording, inputs)?;
                let force = &self.plant.input_forces()[k];
                let per_unit = force.per_unit(&theta);
                ColumnPart::force(force.coordinate, change.iter().map(|x| per_unit * x).collect())
            }
            RigNumber::ReadingGain(_) if !rig.terms[term].is_in(recording) => return None,
            RigNumber::ReadingGain(c) => ColumnPart::reading(c, self.shown(recording, c)[0].clone()),
            RigNumber::GearRatio => {
                let mut part = ColumnPart::default();
                for (c, values) in gear.iter().enumerate() {
                    part.forces.extend(ColumnPart::force(c, values.clone()).forces);
                }
                for k in (0..inputs.len()).filter(|k| rig.is_geared(*k)) {
                    part.forces.extend(of_input(k, &|u| -u).forces);
                }
                for c in (0..self.channels()).filter(|c| rig.is_read_geared(*c)) {
                    let [mut shown, _] = self.shown(recording, c);
                    shown.iter_mut().for_each(|y| *y = -*y);
                    part.readings.extend(ColumnPart::reading(c, shown).readings);
                }
                part
            }
            RigNumber::Effect(_) => return None,
        })
    }
}
