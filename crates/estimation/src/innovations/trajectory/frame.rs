//! A plant with its recordings, each about its trajectory.

use std::rc::Rc;

use trueup_plant::{Coordinate, CoordinateKind};
use trueup_signals::Loaded;

use super::doubted::{DoubtedNumber, DoubtedScale, doubted, own_parameters};
use super::nodes::TrajectoryIntake;
use super::plant::{TrajectoryError, TrajectoryPlant};
use super::readings::ReadOutputs;
use super::run::{LawTangent, TrajectoryRun};
use super::unknowns::UnknownParameter;
use crate::innovations::column::{ColumnPart, FilterColumn, OwnForces};
use crate::innovations::estimate::EstimatedNumber;
use crate::innovations::evidence::{AmplitudePriors, SetEvidence, log_evidence};
use crate::innovations::filter_data::{DataColumn, FilterGains, FilterInput, SmoothedRecording};
use crate::innovations::gram::{BaseGram, GroupGram, PackedColumns, PassedBase};
use crate::innovations::linear::{PlantStep, StepOrder};
use crate::innovations::numeric::{median, rates_at};
use crate::innovations::smoother::{smooth_recording, smooth_with_powers};

/// Least and largest intensity of a latent force, in usual forces.
const FORCES: [f64; 2] = [5e-4, 30.0];
/// Least and largest intensity of a latent error, in standard deviations of a reading.
const ERRORS: [f64; 2] = [0.02, 3e3];
/// White force of a step, in usual forces.
const WHITE: f64 = 3e-4;
/// Intensity of latent forces to begin with, in usual forces.
const BEGIN: f64 = 0.3;
/// What may rest moves by fewer standard deviations of a reading than so many in so many s.
const CREEP: (f64, f64) = (2.0, 0.05);
/// Standard deviations of the first coordinates and rates, of a driven body and of one that floats: angles, rad and rad/s; places, m
/// and m/s.
const FIRST: [[f64; 2]; 3] = [[0.02, 0.05], [0.03, 0.05], [0.02, 0.03]];
/// Step of derivatives of reported numbers.
const STEP: f64 = 1e-6;

/// A plant and its recordings about their trajectories, and all that belongs to them.
#[derive(Clone)]
pub struct TrajectoryFrame {
    /// The case's recordings.
    pub intake: Rc<TrajectoryIntake>,
    /// The plant.
    pub plant: Rc<TrajectoryPlant>,
    /// All parameters in hand, in the order of the model's table.
    pub theta: Vec<f64>,
    /// Those that are refitted.
    pub unknown: Rc<Vec<UnknownParameter>>,
    /// Recordings.
    pub runs: Vec<TrajectoryRun>,
    /// Usual force on each coordinate, in its unit.
    pub usual_force: Vec<f64>,
    /// Intensities: standard deviations of the latent force on each coordinate and of the latent error of each channel.
    pub intensities: Vec<f64>,
    /// Variance of a white force on each coordinate.
    pub white: Vec<f64>,
    /// Speed of each coordinate that its readings hardly distinguish from rest.
    creep: Vec<f64>,
    /// Standard deviations of the first coordinates and rates.
    pub first_deviation: Vec<f64>,
    outputs: Rc<ReadOutputs>,
    /// Gains, offsets and delays of inputs and of readings.
    doubted: Rc<Vec<DoubtedNumber>>,
    /// Readings have no latent errors but the least.
    errors_held: bool,
    parameter_columns: Option<Rc<Vec<FilterColumn>>>,
}

impl TrajectoryFrame {
    /// Of a case whose recordings show this plant with these parameters; `late`: how late channels are, s, by which their readings
    /// are put back (by index among the channels).
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn new(
        loaded: &Loaded,
        mut plant: TrajectoryPlant,
        theta: &[f64],
        late: &[(usize, f64)],
    ) -> Result<Self, TrajectoryError> {
        plant.others = recorded_in_addition(loaded, &plant);
        let intake = TrajectoryIntake::new(loaded, &plant, theta)?;
        let unknown = UnknownParameter::all(&loaded.case, &plant, theta)?;
        let outputs = ReadOutputs::new(&plant, &intake.channels);
        let usual_force = usual_forces(&plant, &intake.usual_torque);
        let errors = intake.channels.iter().map(|c| ERRORS[0] * c.variance.sqrt());
        let mut white: Vec<f64> = usual_force.iter().map(|s| (WHITE * s).powi(2)).collect();
        plant.drives.iter().zip(&intake.input_noise).for_each(|(k, noise)| white[*k] += noise * noise);
        let mut frame = Self {
            theta: theta.to_vec(),
            unknown: Rc::new(unknown),
            runs: Vec::new(),
            intensities: usual_force.iter().map(|s| BEGIN * s).chain(errors).collect(),
            usual_force,
            white,
            creep: creep(&plant, &intake),
            first_deviation: first_deviations(&plant),
            outputs: Rc::new(outputs),
            doubted: Rc::new(doubted(loaded, &plant, &intake)),
            errors_held: false,
            parameter_columns: None,
            intake: Rc::new(intake),
            plant: Rc::new(plant),
        };
        let mut delays = vec![0.0; frame.channels()];
        late.iter().for_each(|(c, delay)| delays[*c] = *delay);
        for nodes in &frame.intake.recordings {
            let readings = nodes.readings(&frame.intake.channels, &delays);
            let nodes = Rc::new(nodes.clone());
            let mut run = TrajectoryRun::new(nodes, readings, &frame.intake.channels, &frame.plant);
            run.own_parameters = own_parameters(loaded, &frame.plant, &run.nodes.name);
            frame.runs.push(run);
        }
        frame.linearise(&[])?;
        Ok(frame)
    }

    /// As long as delays are looked for: those in hand, and readings without latent errors but the least, which would follow a late channel.
    pub fn for_delays(mut self) -> Self {
        self.errors_held = true;
        self.doubted = Rc::new(self.doubted.iter().filter(|d| !d.is_delay()).cloned().collect());
        self
    }

    /// With some of its recordings only, where each of them is.
    pub fn of_recordings(&self, recordings: &[usize]) -> Self {
        let some = |column: &FilterColumn| recordings.iter().map(|k| column[*k].clone()).collect();
        Self {
            runs: recordings.iter().map(|k| self.runs[*k].clone()).collect(),
            parameter_columns: self
                .parameter_columns
                .as_ref()
                .map(|all| Rc::new(all.iter().map(some).collect())),
            ..self.clone()
        }
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.plant.coordinates()
    }
    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.intake.channels.len()
    }
    /// Least and largest intensity of each latent.
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        let forces = self.usual_force.iter().map(|s| FORCES.map(|x| x * s));
        let range = if self.errors_held { [ERRORS[0]; 2] } else { ERRORS };
        let errors = self.intake.channels.iter().map(|c| range.map(|x| x * c.variance.sqrt()));
        forces.chain(errors).collect()
    }

    /// Steps and rows about the trajectories and parameters in hand, with the tangents of laws: one entry a recording, or none.
    ///
    /// # Errors
    /// [`TrajectoryError::Singular`].
    pub fn linearise(&mut self, laws: &[LawTangent]) -> Result<(), TrajectoryError> {
        let none = LawTangent::new();
        self.parameter_columns = None;
        for (k, run) in self.runs.iter_mut().enumerate() {
            let laws = laws.get(k).unwrap_or(&none);
            run.linearise(&self.plant, &self.theta, &self.outputs, [&self.white, &self.creep], laws)?;
        }
        Ok(())
    }

    /// Noise of the steps after other variances of white forces.
    pub(super) fn renew_noise(&mut self) {
        for run in &mut self.runs {
            run.renew_noise(&self.plant, &self.theta, [&self.white, &self.creep]);
        }
    }

    /// Gains of a recording at these intensities; `keep`: with what a smoother needs.
    pub fn gains(&self, recording: usize, q: &[f64], keep: bool) -> FilterGains<'_> {
        FilterGains::new(self.filter_input(recording, q), keep)
    }

    fn filter_input(&self, recording: usize, q: &[f64]) -> FilterInput<'_> {
        let linear = &self.runs[recording].linear;
        let n = self.coordinates();
        let size = 3 * n + self.channels();
        let noise = |(step, pushed): (&PlantStep, &Vec<f64>)| {
            let mut noise = vec![0.0; size * size];
            for (to, from) in noise.chunks_mut(size).zip(pushed.chunks(2 * n)) {
                to[..2 * n].copy_from_slice(from);
            }
            for (k, q) in (2 * n..size).zip(q) {
                let kept = step.a[(size + 1) * k];
                noise[(size + 1) * k] = q * q * (1.0 - kept * kept);
            }
            noise
        };
        let mut first = vec![0.0; size * size];
        for (k, s) in self.first_deviation.iter().chain(q).enumerate() {
            first[(size + 1) * k] = s * s;
        }
        let noise = linear.steps.iter().zip(&linear.noise).map(noise).collect();
        FilterInput { noise, first, ..self.passed_input(recording) }
    }

    /// What columns pass with gains at hand: no intensities.
    pub(super) fn passed_input(&self, recording: usize) -> FilterInput<'_> {
        let run = &self.runs[recording];
        let (n, channels, nodes) = (self.coordinates(), self.channels(), run.nodes.len());
        let size = 3 * n + channels;
        let variance = |(k, count): (usize, &f64)| {
            if *count > 0.0 { self.intake.channels[k % channels].variance / count } else { 0.0 }
        };
        FilterInput {
            steps: &run.linear.steps,
            noise: Vec::new(),
            order: StepOrder::Own(nodes),
            unknown: &[],
            unknown_on: (0, 0),
            rows: &run.linear.rows,
            variance: run.readings.count.iter().enumerate().map(variance).collect(),
            counted: &run.readings.counted,
            first: vec![0.0; size * size],
            forces: n,
            channels,
            errors: channels,
        }
    }

    /// What was read less what the model reads, less errors of a hypothesis; its forces in addition to those of the trajectory.
    pub(super) fn residual(&self, recording: usize, extra: Option<&OwnForces>) -> DataColumn {
        let run = &self.runs[recording];
        let (n, channels, nodes) = (self.coordinates(), self.channels(), run.nodes.len());
        let pairs = run.readings.mean.iter().zip(&run.model_readings).zip(&run.readings.count);
        let mut readings: Vec<f64> =
            pairs.map(|((y, h), count)| if *count > 0.0 { y - h } else { 0.0 }).collect();
        let mut forces = vec![vec![0.0; nodes]; n];
        if let Some(extra) = extra {
            forces.clone_from(&extra.forces);
            extra.correct(&mut readings);
        }
        DataColumn { forces, readings, first: vec![0.0; 3 * n + channels] }
    }

    /// Columns of the unknown parameters along the present trajectories.
    pub fn parameter_columns(&mut self) -> Rc<Vec<FilterColumn>> {
        if let Some(found) = &self.parameter_columns {
            return found.clone();
        }
        let mut columns: Vec<FilterColumn> = vec![Vec::new(); self.unknown.len()];
        for run in &self.runs {
            let parts = run.columns_of(&self.plant, &self.theta, &self.unknown);
            columns.iter_mut().zip(parts).for_each(|(c, part)| c.push(part));
        }
        let columns = Rc::new(columns);
        self.parameter_columns = Some(columns.clone());
        columns
    }

    /// Columns of all that is refitted with every hypothesis, with their priors: parameters, gains, offsets and delays.
    pub fn nuisances(&mut self) -> (Vec<FilterColumn>, AmplitudePriors) {
        let mut columns = self.parameter_columns().to_vec();
        let mut priors = AmplitudePriors {
            mean: self.unknown.iter().map(|u| u.mean_at(&self.theta)).collect(),
            deviation: self.unknown.iter().map(|u| u.deviation).collect(),
            parameters: 0,
        };
        for d in self.doubted.iter() {
            columns.push(self.scale_column(d));
            priors = priors.with(&[d.mean], &[d.deviation]);
        }
        (columns, priors)
    }

    fn scale_column(&self, number: &DoubtedNumber) -> FilterColumn {
        let of_run = |run: &TrajectoryRun| {
            let (nodes, parts) = (run.nodes.len(), run.nodes.parts);
            let gain = |j: usize| self.plant.drive_gains[j];
            let force = |j: usize, series| ColumnPart::force(self.plant.drives[j], series);
            let torque = |t: usize, j: usize| {
                (0..parts).map(|part| run.nodes.torque(t, part)[j]).sum::<f64>() / parts as f64
            };
            let read = |c: usize| run.model_readings.iter().skip(c).step_by(self.channels()).copied();
            let of = self.intake.recordings.iter().position(|r| r.name == run.nodes.name);
            if !of.is_some_and(|k| number.is_in(k)) {
                return ColumnPart::default();
            }
            match number.of {
                DoubtedScale::InputGain(j) => force(j, (0..nodes).map(|t| gain(j) * torque(t, j)).collect()),
                DoubtedScale::InputOffset(j) => force(j, vec![gain(j); nodes]),
                DoubtedScale::InputDelay(j) => {
                    // What shows later was there before: as it is a moment later less a moment before.
                    let by = 0.5 * median(run.nodes.step.clone()) / parts as f64;
                    let [after, before] = [-by, by].map(|d| run.nodes.late_torque(j, d));
                    let rise = |k: usize| gain(j) * (after[k] - before[k]) / (2.0 * by); // (EST-19)
                    let mean = |t: usize| (0..parts).map(|p| rise(parts * t + p)).sum::<f64>() / parts as f64;
                    force(j, (0..nodes).map(mean).collect())
                }
                DoubtedScale::ReadingGain(c) => ColumnPart::reading(c, read(c).collect()),
                DoubtedScale::ReadingDelay(c) => {
                    let rates = rates_at(&run.nodes.time, &read(c).collect::<Vec<_>>()); // (EST-19)
                    ColumnPart::reading(c, rates.into_iter().map(|v| -v).collect())
                }
                DoubtedScale::ReadingOffset(c) => ColumnPart::reading(c, vec![1.0; nodes]),
            }
        };
        self.runs.iter().map(of_run).collect()
    }

    /// Columns of the parameters are to be made again.
    pub(super) fn forget_columns(&mut self) {
        self.parameter_columns = None;
    }
    /// Gains, offsets and delays at these amplitudes: which of them, the number, and its derivative.
    pub(super) fn doubted_numbers(&self, amplitudes: &[f64]) -> Vec<(usize, EstimatedNumber, f64)> {
        let mut all = Vec::new();
        for (k, (d, a)) in self.doubted.iter().zip(amplitudes).enumerate() {
            let slope = (d.value(a + STEP) - d.value(a - STEP)) / (2.0 * STEP);
            let of = |recording| EstimatedNumber { name: d.name.clone(), recording, value: d.value(*a) };
            match &d.only {
                Some(only) => all.extend(only.iter().map(|r| (k, of(Some(*r)), slope))),
                None => all.push((k, of(None), slope)),
            }
        }
        all
    }
    /// Gains, offsets and delays that all recordings have as they are reported, at these amplitudes: names and values.
    pub fn reported(&self, amplitudes: &[f64]) -> Vec<(String, f64)> {
        let all = self.doubted.iter().zip(amplitudes).filter(|(d, _)| d.only.is_none());
        all.map(|(d, a)| (d.name.clone(), d.value(*a))).collect()
    }
    /// What single recordings have as it is reported: name, recording, value.
    pub fn reported_of_single(&self, amplitudes: &[f64]) -> Vec<(String, usize, f64)> {
        let of = |(d, a): (&DoubtedNumber, &f64)| {
            let value = d.value(*a);
            d.only.iter().flatten().map(|k| (d.name.clone(), *k, value)).collect::<Vec<_>>()
        };
        self.doubted.iter().zip(amplitudes).flat_map(of).collect()
    }
    /// Whether the delay of a channel is estimated.
    pub fn is_late(&self, channel: usize) -> bool {
        self.doubted.iter().any(|d| d.of == DoubtedScale::ReadingDelay(channel))
    }
    /// Columns as the filter takes them, data first.
    pub fn packed(&self, columns: &[FilterColumn]) -> PackedColumns {
        let data = (0..self.runs.len()).map(|k| self.residual(k, None)).collect();
        PackedColumns::new(data, columns, self.channels())
    }

    /// Gram matrix of data and columns with the gains of each recording; `take` gets the innovations of each.
    fn gram_with(
        &self,
        packed: &PackedColumns,
        gains: &[FilterGains<'_>],
        mut take: impl FnMut(&[f64]),
    ) -> BaseGram {
        let mut gram = packed.nothing();
        for (k, gains) in gains.iter().enumerate() {
            packed.pass_base(k, std::slice::from_ref(gains), std::slice::from_mut(&mut gram), |_, e| take(e));
            gram.log_variance += self.runs[k].readings.merged;
        }
        gram.mirrored()
    }

    /// Passes data and columns at these intensities, for groups in addition to them.
    pub fn pass_base(&self, packed: &PackedColumns, q: &[f64]) -> PassedBase {
        let gains = self.all_gains(q, false);
        let mut innovations = Vec::new();
        let gram = self.gram_with(packed, &gains, |e| innovations.push(e.to_vec()));
        let gains = gains.into_iter().map(|g| (g.gain, g.variance)).collect();
        PassedBase { gram, gains, innovations }
    }

    /// Gram matrices of groups in addition to a base that was passed.
    pub fn pass_groups(
        &self,
        packed: &PackedColumns,
        base: &PassedBase,
        groups: &[&[FilterColumn]],
    ) -> Vec<GroupGram> {
        base.groups(packed, groups, |k| self.passed_input(k))
    }

    /// Gains of all recordings.
    pub fn all_gains(&self, q: &[f64], keep: bool) -> Vec<FilterGains<'_>> {
        (0..self.runs.len()).map(|k| self.gains(k, q, keep)).collect()
    }

    /// Gram matrix and evidence of data and columns with the gains of each recording.
    pub fn evidence_with(
        &self,
        packed: &PackedColumns,
        priors: &AmplitudePriors,
        gains: &[FilterGains<'_>],
    ) -> (BaseGram, SetEvidence) {
        let gram = self.gram_with(packed, gains, |_| ());
        let found = log_evidence(&gram, priors);
        (gram, found)
    }

    /// Forces and reading errors of columns at these amplitudes, one entry a recording.
    pub fn own_forces(&self, columns: &[FilterColumn], amplitudes: &[f64]) -> Vec<OwnForces> {
        let sizes = |nodes: usize| [self.coordinates(), self.channels(), nodes];
        let runs = self.runs.iter().enumerate();
        runs.map(|(k, r)| OwnForces::of(columns, amplitudes, k, sizes(r.nodes.len()))).collect()
    }

    /// Smoothed deviations from the trajectories with these gains, with `extra` in addition.
    pub fn smoothed(&self, gains: &[FilterGains<'_>], extra: Option<&[OwnForces]>) -> Vec<SmoothedRecording> {
        let one = |(k, gains)| smooth_recording(gains, &self.residual(k, extra.map(|e| &e[k])));
        gains.iter().enumerate().map(one).collect()
    }
    /// The same with the powers of the latents' scores.
    pub fn smoothed_with_powers(
        &self,
        gains: &[FilterGains<'_>],
        extra: Option<&[OwnForces]>,
    ) -> Vec<SmoothedRecording> {
        let one = |(k, gains)| smooth_with_powers(gains, &self.residual(k, extra.map(|e| &e[k])));
        gains.iter().enumerate().map(one).collect()
    }

    /// Moves the trajectories by what was smoothed; `own`: the forces that stay with the model, one entry a recording; `laws`: their
    /// tangents.
    ///
    /// # Errors
    /// [`TrajectoryError::Singular`].
    pub fn follow(
        &mut self,
        smoothed: Vec<SmoothedRecording>,
        own: Option<&[OwnForces]>,
        laws: &[LawTangent],
    ) -> Result<(), TrajectoryError> {
        let (n, size) = (self.coordinates(), 3 * self.coordinates() + self.channels());
        for (k, (run, s)) in self.runs.iter_mut().zip(smoothed).enumerate() {
            let nodes = s.states.chunks(size);
            let moves = nodes.clone().flat_map(|z| &z[..2 * n]);
            let states = run.states.iter().zip(moves).map(|(x, dx)| x + dx).collect();
            let own: Vec<f64> = own.map_or_else(
                || vec![0.0; run.own.len()],
                |own| {
                    let forces = &own[k].forces;
                    (0..run.nodes.len()).flat_map(|t| forces.iter().map(move |f| f[t])).collect()
                },
            );
            let latent = nodes.flat_map(|z| &z[2 * n..3 * n]);
            let forces = own.iter().zip(latent).map(|(f, d)| f + d).collect();
            run.put(states, forces, own);
            run.scores = s.scores;
        }
        self.linearise(laws)
    }
}

/// Speed of each coordinate that readings of its position hardly distinguish from rest.
fn creep(plant: &TrajectoryPlant, intake: &TrajectoryIntake) -> Vec<f64> {
    let of = |k: usize| {
        let read = intake.channels.iter().filter(|c| c.state == Some(k)).map(|c| c.variance);
        let least = read.fold(f64::INFINITY, f64::min);
        if least.is_finite() { CREEP.0 * least.sqrt() / CREEP.1 } else { 0.0 }
    };
    (0..plant.coordinates()).map(of).collect()
}

/// Inputs of a plant that do not drive it and that were recorded.
fn recorded_in_addition(loaded: &Loaded, plant: &TrajectoryPlant) -> Vec<usize> {
    let table = plant.plant().table();
    let train = loaded.train();
    let recorded = |k: &usize| {
        let name = &table.inputs[*k].name;
        train.iter().any(|r| r.channel(name).is_some_and(|c| !c.is_empty()))
    };
    (0..table.inputs.len()).filter(|k| !table.driving.contains(k)).filter(recorded).collect()
}

/// Usual force on each coordinate: of what a motor drives its usual torque, of what floats the largest, twice that of a place (1 / m).
fn usual_forces(plant: &TrajectoryPlant, torque: &[f64]) -> Vec<f64> {
    let largest = torque.iter().copied().fold(0.0, f64::max);
    let of = |c: &Coordinate| if c.force_unit == "N" { 2.0 * largest } else { largest };
    let mut usual: Vec<f64> = plant.plant().coordinates().iter().map(of).collect();
    for (j, t) in torque.iter().enumerate() {
        usual[plant.joints[j]] = *t;
        usual[plant.drives[j]] = *t;
    }
    usual
}

/// Standard deviations of the first coordinates, then of their rates.
fn first_deviations(plant: &TrajectoryPlant) -> Vec<f64> {
    let of = |c: &Coordinate| match (c.kind, c.force_unit) {
        (CoordinateKind::Base, "N") => FIRST[2],
        (CoordinateKind::Base, _) => FIRST[1],
        _ => FIRST[0],
    };
    let all: Vec<[f64; 2]> = plant.plant().coordinates().iter().map(of).collect();
    (0..2).flat_map(|k| all.iter().map(move |s| s[k])).collect()
}
