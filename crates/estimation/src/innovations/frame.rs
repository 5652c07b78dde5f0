//! A plant with its recordings, the nuisances that the data decide, and the smoothed trajectory.

use std::borrow::Cow;
use std::rc::Rc;

use super::bank::gains_of_bank;
use super::column::{AppliedLaw, FilterColumn, OwnForces};
use super::evidence::{AmplitudePriors, SetEvidence, log_evidence};
use super::filter_data::{DataColumn, FilterGains, FilterInput};
use super::gram::{BaseGram, GroupGram, PackedColumns, PassedBase};
use super::intake::{NodeIntake, input_force};
use super::intake_channel::IntakeChannel;
use super::linear::{Feedback, LinearPoint, PlantStep, ReadingRows, StepOrder};
use super::numeric::{over_steps, quantile};
use super::plant::ForcedPlant;
use super::recording::{LateChannel, Linearisation, NodeRecording};
use super::signs::{DrySigns, SignRule};
use super::smoother::smooth_recording;

/// Least and largest intensity of a latent, in usual forces.
pub const INTENSITY: [f64; 2] = [5e-4, 20.0];

/// A structure of the plant with late channels, and all that belongs to it.
#[derive(Clone)]
pub struct InnovationsFrame {
    /// The case's recordings.
    pub intake: Rc<NodeIntake>,
    /// The plant with its nominal values and beliefs.
    pub plant: Rc<dyn ForcedPlant>,
    /// Parameters in hand, behind those of the plant the numbers of the rig.
    pub theta: Vec<f64>,
    /// Parameters with which hypotheses begin.
    pub start: Vec<f64>,
    /// Parameters that are unknown.
    pub unknown: Vec<usize>,
    /// Recordings.
    pub runs: Vec<NodeRecording>,
    /// Speed of rest, rad/s.
    pub rest: f64,
    /// Speed that a coordinate at rest has, in speeds of rest.
    pub creep: f64,
    /// White force in a step, in usual forces.
    pub white: f64,
    /// Factor of the variance of readings.
    pub scale: f64,
    /// Intensities of the latents, in usual forces.
    pub q: Vec<f64>,
    /// Evidence of the model alone at these.
    pub evidence: f64,
    /// Largest torque held at rest, in levels of dry friction.
    pub release: f64,
    /// Speed that is reached or exceeded 3 % of the time, rad/s.
    pub usual_speed: f64,
    /// Least speed that the encoder distinguishes from rest, rad/s.
    pub least_rest: f64,
    /// Tangent of the laws in force.
    pub feedback: Feedback,
    /// Tangent of known effects that hold the joint, as of the last smoothing.
    pub held: Feedback,
}

impl InnovationsFrame {
    /// Of a plant and recordings, one channel put back by its delay.
    pub fn new(intake: &Rc<NodeIntake>, plant: Rc<dyn ForcedPlant>, late: LateChannel) -> Self {
        let numbers = intake.rig.terms.iter().map(|_| 1.0);
        let values: Vec<f64> = plant.parameters().iter().map(|p| p.value).chain(numbers).collect();
        let unknown = (0..values.len()).filter(|k| values[*k] > 0.0).collect();
        let runs = intake.recordings.iter().map(|r| NodeRecording::new(intake, &*plant, r, late));
        let mut frame = Self {
            intake: intake.clone(),
            theta: values.clone(),
            start: values,
            unknown,
            runs: runs.collect(),
            rest: 0.0,
            creep: 1.0,
            white: 0.002,
            scale: 1.0,
            q: vec![0.3; plant.coordinates().len()],
            evidence: f64::NEG_INFINITY,
            release: 1.0,
            usual_speed: 0.0,
            least_rest: 0.0,
            feedback: Feedback::default(),
            held: Feedback::default(),
            plant,
        };
        let all = frame.runs.iter().flat_map(|r| r.speed.iter().map(|v| v.abs()));
        frame.usual_speed = quantile(all.collect(), 0.97);
        let encoder = intake.channel_of(frame.driven_state()).unwrap_or(0);
        let slowest = |c: &IntakeChannel| 2.0 * c.resolution / if c.angle { 0.016 } else { 1.0 };
        let slowest = intake.channels.get(encoder).map_or(0.0, slowest);
        frame.least_rest = slowest.max(1e-4 * frame.usual_speed);
        frame.rest = frame.least_rest.max(0.003 * frame.usual_speed);
        frame.signs_from_readings();
        frame.linearise();
        frame
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.plant.coordinates().len()
    }
    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.intake.channels.len()
    }
    /// The coordinate that the first input drives; dry friction of the nominal plant acts there.
    pub fn driven(&self) -> usize {
        self.plant.input_forces().first().map_or(0, |i| i.coordinate)
    }
    fn driven_state(&self) -> usize {
        self.plant.coordinates()[self.driven()].position
    }
    /// Level of dry friction in hand, N.m.
    pub fn dry_level(&self) -> f64 {
        self.dry_level_of(&self.theta)
    }
    fn dry_level_of(&self, theta: &[f64]) -> f64 {
        self.plant.coordinates()[self.driven()].dry.map_or(0.0, |k| theta[k])
    }
    /// Parameters of the plant in hand as they are in a recording.
    pub fn parameters_in(&self, recording: usize) -> Cow<'_, [f64]> {
        self.intake.rig.parameters_in(&self.theta, recording)
    }
    /// Nominal value and relative standard deviation of a parameter in hand.
    pub fn believed(&self, k: usize) -> [f64; 2] {
        let own = self.plant.parameters();
        own.get(k)
            .map_or_else(|| [1.0, self.intake.rig.terms[k - own.len()].deviation], |p| [p.value, p.deviation])
    }
    /// Numbers of the rig in hand.
    pub fn rig_numbers(&self) -> &[f64] {
        &self.theta[self.plant.parameters().len()..]
    }
    /// Means of an input over the steps, as gain and offset in hand have them.
    pub fn input_means(&self, recording: usize, input: usize) -> Vec<f64> {
        let means = &self.intake.recordings[recording].means[input];
        match self.intake.rig.of_input(self.rig_numbers(), input, recording) {
            [1.0, 0.0] => means.clone(),
            [factor, taken] => means.iter().map(|u| factor * u - taken).collect(),
        }
    }
    /// Whether more than one angle is read.
    pub fn two_angles(&self) -> bool {
        self.intake.channels.iter().filter(|c| c.angle).count() > 1
    }
    /// Same intensity of all latents but that of the driven coordinate.
    pub fn intensities(&self, driven: f64, others: f64) -> Vec<f64> {
        (0..self.coordinates()).map(|c| if c == self.driven() { driven } else { others }).collect()
    }

    /// Rule of signs of a recording.
    pub fn sign_rule(&self, recording: usize) -> SignRule {
        let theta = self.parameters_in(recording);
        let drive = self.plant.input_forces().first().map_or(0.0, |i| i.per_unit(&theta));
        let samples = self.intake.recordings[recording].inputs.first().and_then(Option::as_ref);
        let largest = |values: &[f64]| values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let recorded = drive * samples.map_or(0.0, |i| largest(&i.values));
        let drive = if self.has_servo() { largest(&self.drive_torque(recording)) } else { recorded };
        let dt = self.runs[recording].dt;
        let [level, breakaway] = self.holding(&theta);
        SignRule { rest: self.rest, level, breakaway, drive, dt }
    }
    /// Level of dry friction, or what holds without it, and torque at which the driven coordinate breaks away, N.m.
    fn holding(&self, theta: &[f64]) -> [f64; 2] {
        let driven = &self.plant.coordinates()[self.driven()];
        let level = self.dry_level_of(theta);
        if level > 0.0 { [level, level * driven.breakaway] } else { [driven.holds; 2] }
    }
    /// Largest torque at which the driven coordinate breaks away in a recording, N.m; 0: it never rests.
    pub(super) fn breakaway(&self) -> f64 {
        let all = (0..self.runs.len()).map(|k| self.holding(&self.parameters_in(k))[1]);
        all.fold(0.0, f64::max)
    }
    /// Signs again from the speed of the readings.
    pub fn signs_from_readings(&mut self) {
        self.set_signs(|r| r.speed.clone());
    }
    /// Signs again from the smoothed speed.
    pub fn signs_from_states(&mut self) {
        let velocity = self.plant.coordinates()[self.driven()].velocity;
        self.set_signs(|r| r.state(velocity));
    }
    /// Signs again from the smoothed speed of another frame of the same recordings, with its misplaced events.
    pub fn signs_along(&mut self, other: &Self) {
        let velocity = self.plant.coordinates()[self.driven()].velocity;
        for k in 0..self.runs.len() {
            let rule = self.sign_rule(k);
            let o = &other.runs[k];
            self.runs[k].signs = Rc::new(DrySigns::new(&o.state(velocity), &o.signs.misplaced, &rule));
        }
    }
    fn set_signs(&mut self, speed: impl Fn(&NodeRecording) -> Vec<f64>) {
        for k in 0..self.runs.len() {
            let rule = self.sign_rule(k);
            let r = &mut self.runs[k];
            r.signs = Rc::new(DrySigns::new(&speed(r), &r.signs.misplaced, &rule));
        }
    }
    /// Rest and signs of all recordings.
    pub fn signs(&self) -> Vec<Rc<DrySigns>> {
        self.runs.iter().map(|r| r.signs.clone()).collect()
    }
    /// Puts rest and signs back.
    pub fn restore_signs(&mut self, signs: &[Rc<DrySigns>]) {
        self.runs.iter_mut().zip(signs).for_each(|(r, s)| r.signs = s.clone());
    }

    /// Steps and rows about the parameters in hand, where they are not those.
    pub fn linearise(&mut self) {
        let feedback = self.feedback.with(&self.held);
        let point: Vec<f64> = self.theta.iter().chain(&feedback.0).copied().collect();
        let driven = self.driven();
        let held = (0..self.coordinates()).map(|c| self.plant.held_with(driven, c)).collect();
        let modes = [vec![false; self.coordinates()], held];
        let readings = self.plant.readings();
        let rig = &self.intake.rig;
        let numbers = &self.theta[self.plant.parameters().len()..];
        for (k, r) in self.runs.iter_mut().enumerate() {
            let theta = &*rig.parameters_in(&self.theta, k);
            let linear = LinearPoint { plant: &*self.plant, theta, feedback: &feedback };
            let old = Some(&r.linear).filter(|l| l.point == point);
            if old.is_some_and(|l| Rc::ptr_eq(&l.signs, &r.signs)) {
                continue;
            }
            let steps = old.map_or_else(
                || modes.iter().map(|m| PlantStep::new(&linear, m, r.dt)).collect(),
                |l| l.steps.clone(),
            );
            let shown =
                self.intake.channels.iter().map(|c| self.plant.reading_row(theta, &readings[c.reading]));
            let shown: Vec<Vec<f64>> = shown.collect();
            let mut rows = ReadingRows::new(&linear, &shown, &modes, &r.signs.mode, &r.moments);
            let factors: Vec<f64> = (0..shown.len()).map(|c| rig.of_reading(numbers, c, k)).collect();
            rows.scale(&factors, [linear.size(), modes[0].len()]);
            let signs = r.signs.clone();
            r.linear = Rc::new(Linearisation { point: point.clone(), signs, steps, rows });
        }
    }

    /// Gains of a recording at these intensities.
    pub fn gains(&self, recording: usize, q: &[f64], keep: bool) -> FilterGains<'_> {
        FilterGains::new(self.filter_input(recording, q), keep)
    }

    /// What the filter of a recording takes at these intensities.
    pub(super) fn filter_input(&self, recording: usize, q: &[f64]) -> FilterInput<'_> {
        let r = &self.runs[recording];
        let raw = &self.intake.recordings[recording];
        let unit = self.plant.usual_force();
        let (states, forces, channels) = (self.plant.states(), self.coordinates(), self.channels());
        let theta = self.parameters_in(recording);
        let mut white = vec![0.0; forces];
        self.plant.white_shares(&theta, &mut white);
        white.iter_mut().for_each(|w| *w *= self.white * unit);
        if let (Some(input), Some(Some(samples))) = (self.plant.input_forces().first(), raw.inputs.first()) {
            let noise = self.intake.input_noise / samples.samples_per_step().max(1.0).sqrt();
            let w = &mut white[input.coordinate];
            *w = w.hypot(input.per_unit(&theta) * noise);
        }
        let latent: Vec<f64> = q.iter().map(|q| q * unit).collect();
        let size = states + forces;
        let mut first = vec![0.0; size * size];
        for i in 0..states {
            first[size * i..size * i + states]
                .copy_from_slice(&r.first_variance[states * i..states * (i + 1)]);
        }
        for (c, l) in latent.iter().enumerate() {
            first[(size + 1) * (states + c)] = l * l;
        }
        let mut variance = vec![0.0; r.nodes * channels];
        for t in 0..r.nodes {
            let jitter = (raw.stamp * r.speed[t]).powi(2) / 12.0;
            for (c, channel) in self.intake.channels.iter().enumerate() {
                let at = channels * t + c;
                if r.count[at] > 0.0 {
                    let late = if channel.angle { jitter } else { 0.0 };
                    variance[at] = (self.scale * channel.variance + late) / r.count[at];
                }
            }
        }
        let plant = &*self.plant;
        let noise = r
            .linear
            .steps
            .iter()
            .map(|s| s.noise(plant, r.dt, &white, &latent, self.creep * self.rest))
            .collect();
        FilterInput {
            steps: &r.linear.steps,
            noise,
            order: StepOrder::ByMode(&r.signs.mode),
            unknown: &r.signs.unknown,
            unknown_on: (self.driven(), self.driven_state()),
            rows: &r.linear.rows,
            variance,
            counted: &r.counted,
            first,
            forces,
            channels,
            errors: 0,
        }
    }

    /// The forces on a recording: inputs, dry friction, and the laws in hand as far as they are no tangent.
    fn known(&self, recording: usize, own: Option<&OwnForces>) -> Vec<Vec<f64>> {
        let r = &self.runs[recording];
        let theta = self.parameters_in(recording);
        let mut all = vec![vec![0.0; r.nodes]; self.coordinates()];
        for (k, force) in self.plant.input_forces().iter().enumerate() {
            let means = self.input_means(recording, k);
            let sum = all[force.coordinate].iter_mut();
            sum.zip(input_force(force, &theta, &means)).for_each(|(s, f)| *s += f);
        }
        for (sum, f) in all.iter_mut().zip(self.known_forces(recording)) {
            sum.iter_mut().zip(f).for_each(|(s, f)| *s += f);
        }
        let level = self.dry_level_of(&theta);
        let friction = all[self.driven()].iter_mut();
        friction.zip(&r.signs.mean).for_each(|(s, m)| *s -= level * m);
        if let Some(own) = own {
            for (sum, f) in all.iter_mut().zip(&own.forces) {
                sum.iter_mut().zip(f).for_each(|(s, f)| *s += f);
            }
        }
        let feedback = self.feedback.with(&self.held);
        if !feedback.is_none() {
            let states = self.plant.states();
            for (c, sum) in all.iter_mut().enumerate() {
                let gains = &feedback.0[states * c..states * (c + 1)];
                let size = states + self.coordinates();
                let force = |x: &[f64]| gains.iter().zip(x).map(|(g, x)| g * x).sum::<f64>();
                let nodes: Vec<f64> = r.states.chunks(size).map(force).collect();
                sum.iter_mut().zip(over_steps(&nodes)).for_each(|(s, f)| *s -= f);
            }
        }
        all
    }

    fn first_with_latents(&self, recording: usize) -> Vec<f64> {
        let mut first = self.runs[recording].first.clone();
        first.resize(self.plant.states() + self.coordinates(), 0.0);
        first
    }

    /// Smooths all recordings at these intensities, with the forces of a hypothesis, one entry a recording, or none.
    pub fn smooth(&mut self, q: &[f64], own: Option<Vec<OwnForces>>) {
        self.held = self.known_tangent();
        self.linearise();
        let nothing = |r: &NodeRecording| OwnForces::none(self.coordinates(), self.channels(), r.nodes);
        let own: Vec<OwnForces> = own.unwrap_or_else(|| self.runs.iter().map(nothing).collect());
        for (k, own) in own.into_iter().enumerate() {
            let mut readings = self.runs[k].readings.to_vec();
            own.correct(&mut readings);
            let data =
                DataColumn { forces: self.known(k, Some(&own)), readings, first: self.first_with_latents(k) };
            let smoothed = smooth_recording(&self.gains(k, q, true), &data);
            let r = &mut self.runs[k];
            (r.states, r.scores, r.own) = (smoothed.states, smoothed.scores, own);
        }
    }

    /// The data column of each recording.
    pub fn data(&self) -> Vec<DataColumn> {
        let one = |k: usize| DataColumn {
            forces: self.known(k, None),
            readings: self.runs[k].readings.to_vec(),
            first: self.first_with_latents(k),
        };
        (0..self.runs.len()).map(one).collect()
    }

    /// The base of a set: data, nuisances and laws, with their priors.
    pub fn packed(&self, laws: &[AppliedLaw]) -> (PackedColumns, AmplitudePriors) {
        let (mut columns, priors) = self.nuisances();
        let priors = priors.with_laws(laws, &mut columns);
        (PackedColumns::new(self.data(), &columns, self.channels()), priors)
    }

    /// Passes a base at each of these intensities, with the steps of the last [`linearise`](Self::linearise).
    pub fn pass_bank(&self, packed: &PackedColumns, all: &[Vec<f64>]) -> Vec<PassedBase> {
        let mut passed: Vec<PassedBase> = all.iter().map(|_| PassedBase::default()).collect();
        let grams = self.pass_each(packed, all, |k, gains, e| {
            passed[k].gains.push((gains.gain.clone(), gains.variance.clone()));
            passed[k].innovations.push(e.to_vec());
        });
        passed.iter_mut().zip(grams).for_each(|(p, gram)| p.gram = gram);
        passed
    }

    /// Matrices of a base at each of these intensities; `take` gets gains and innovations of each, recording by recording.
    fn pass_each(
        &self,
        packed: &PackedColumns,
        all: &[Vec<f64>],
        mut take: impl FnMut(usize, &FilterGains<'_>, &[f64]),
    ) -> Vec<BaseGram> {
        let mut grams: Vec<BaseGram> = all.iter().map(|_| packed.nothing()).collect();
        for k in 0..self.runs.len() {
            let inputs = all.iter().map(|q| self.filter_input(k, q)).collect();
            let gains = gains_of_bank(inputs);
            packed.pass_base(k, &gains, &mut grams, |i, e| take(i, &gains[i], e));
        }
        grams.into_iter().map(BaseGram::mirrored).collect()
    }

    /// Passes a base at these intensities.
    pub fn pass_base(&mut self, packed: &PackedColumns, q: &[f64]) -> PassedBase {
        self.linearise();
        self.pass_bank(packed, &[q.to_vec()]).pop().unwrap_or_default()
    }

    /// Gram matrices of groups in addition to a base that was passed.
    pub fn pass_groups(
        &self,
        packed: &PackedColumns,
        base: &PassedBase,
        groups: &[&[FilterColumn]],
    ) -> Vec<GroupGram> {
        // With gains at hand the intensities have no effect.
        base.groups(packed, groups, |k| self.filter_input(k, &self.q))
    }

    /// Evidence of a base at each of these intensities.
    pub fn evidences_of(
        &mut self,
        (packed, priors): &(PackedColumns, AmplitudePriors),
        all: &[Vec<f64>],
    ) -> Vec<SetEvidence> {
        self.linearise();
        let grams = self.pass_each(packed, all, |_, _, _| ());
        grams.iter().map(|gram| log_evidence(gram, priors)).collect()
    }

    /// Takes the unknown ones of these parameters; the others are those with which hypotheses begin.
    pub fn take_unknowns(&mut self, theta: &[f64]) {
        self.theta.clone_from(&self.start);
        for k in &self.unknown {
            self.theta[*k] = theta[*k];
        }
    }

    /// Parameters and trajectory with which hypotheses begin.
    pub fn reset(&mut self, q: &[f64]) {
        self.theta.clone_from(&self.start);
        self.feedback = Feedback::default();
        self.smooth(q, None)
    }
}
