//! Output error: a free-running simulation of every recording against all its readings.
//!
//! Parameters are shared by the recordings; initial states, encoder offsets and input gains may belong to one.
//! Residuals are divided by the standard deviation of their reading, priors are further residuals. Derivatives are
//! exact ([`crate::predict`]); recordings run in parallel and are joined in order, so a result has the same bits
//! whatever the number of threads.

use std::borrow::Cow;

use crate::parallel;
use nalgebra::{DMatrix, DVector};
use trueup_numerics::Scalar;

use crate::carried::CarriedNoise;
use crate::interval;
use crate::lsq::{LeastSquares, ResidualEvaluation};
use crate::predict::{InputMap, PredictError, PredictionPlan};
use crate::predictor::Predictor;
use crate::run::{IdentificationRun, OutputChannel};
use crate::sensors::LinearSensor;
use crate::unknown::{FitTarget, FitUnknown};
use trueup_plant::{LANES, Lanes};

/// Step of a difference by an unknown that shifts readings, as a coordinate.
const SHIFT: f64 = 0.02;

/// Columns of a Jacobian with the unknown that each belongs to.
type JacobianColumns = Vec<(usize, Vec<f64>)>;

/// Recordings, a model and what is unknown.
#[derive(Clone, Debug)]
pub struct OutputError<'a> {
    model: &'a dyn Predictor,
    /// The values of what is not estimated.
    nominal: Vec<f64>,
    runs: &'a [IdentificationRun],
    plans: Vec<PredictionPlan>,
    unknowns: Vec<FitUnknown>,
    /// Where each run's residuals begin; then those of the priors.
    begin: Vec<usize>,
    /// What noise of measured inputs does, by run.
    carried: Vec<Option<CarriedNoise>>,
    /// Counting channels are read as intervals, with this slack in counts.
    slack: Option<f64>,
}

impl<'a> OutputError<'a> {
    /// `nominal` are all parameters of the model.
    pub fn new(
        model: &'a dyn Predictor,
        nominal: &[f64],
        runs: &'a [IdentificationRun],
        unknowns: Vec<FitUnknown>,
    ) -> Self {
        let plans: Vec<PredictionPlan> =
            runs.iter().map(|r| PredictionPlan::new(r, model.counts().inputs)).collect();
        let mut begin = vec![0];
        plans.iter().for_each(|p| begin.push(begin[begin.len() - 1] + p.len()));
        Self {
            model,
            nominal: nominal.to_vec(),
            runs,
            plans,
            unknowns,
            begin,
            carried: vec![None; runs.len()],
            slack: None,
        }
    }
    /// The same unknowns in recordings begun otherwise, weighed by the noise of the readings alone.
    pub fn with_runs<'b>(&self, runs: &'b [IdentificationRun]) -> OutputError<'b>
    where
        'a: 'b,
    {
        OutputError::new(self.model, &self.nominal, runs, self.unknowns.clone())
    }
    /// Reads channels that count as intervals: the motion was within the count, but for an error of `slack` counts (or the
    /// channel's noise, if that is more). `None`: as normal errors again.
    pub fn read_intervals(&mut self, slack: Option<f64>) {
        self.slack = slack;
    }
    /// Whether channels that count are read as intervals.
    pub fn reads_intervals(&self) -> bool {
        self.slack.is_some()
    }
    /// Error before counting of a channel that is read as intervals, in its unit.
    pub fn slack(&self, run: usize, channel: usize) -> Option<f64> {
        self.slack_of(&self.runs[run].channels[channel])
    }
    /// Error before counting, in the unit of the channel.
    fn slack_of(&self, channel: &OutputChannel) -> Option<f64> {
        self.slack.filter(|_| channel.counts()).map(|share| {
            let noise = (channel.sigma.powi(2) - channel.resolution.powi(2) / 12.0).max(0.0).sqrt();
            noise.max(share * channel.resolution)
        })
    }
    /// What the residuals of counting channels leave out of the negative logarithm of the likelihood of their counts.
    pub(crate) fn constant(&self) -> f64 {
        let of = |c: &OutputChannel| -> f64 {
            let each = match self.slack_of(c) {
                Some(s) => interval::least(c.resolution, s),
                None => (c.sigma / c.resolution * (2.0 * std::f64::consts::PI).sqrt()).ln(),
            };
            (0..c.y.len()).map(|k| each * c.worth(k)).sum()
        };
        self.runs.iter().flat_map(|r| &r.channels).filter(|c| c.counts()).map(of).sum()
    }
    /// Weighs residuals by the noise of the readings alone again.
    pub fn forget_noise(&mut self) {
        self.carried.fill(None);
    }
    /// What noise of measured inputs does to a run's readings.
    pub fn carried(&self, run: usize) -> Option<&CarriedNoise> {
        self.carried[run].as_ref()
    }
    /// A column over the readings of a run, in their deviations, as least squares sees it.
    pub fn whiten(&self, run: usize, column: &mut [f64]) {
        if let Some(carried) = &self.carried[run] {
            carried.whiten(column);
        }
    }
    /// Bounds of the coordinates.
    pub fn bounds_of(&self) -> (Vec<f64>, Vec<f64>) {
        LeastSquares::bounds(self)
    }
    /// What is estimated.
    pub fn unknowns(&self) -> &[FitUnknown] {
        &self.unknowns
    }
    /// The recordings.
    pub fn runs(&self) -> &[IdentificationRun] {
        self.runs
    }
    /// How many readings there are: the residuals before those of the priors.
    pub fn readings(&self) -> usize {
        self.begin[self.plans.len()]
    }
    /// Where the residuals of a recording are.
    pub fn residuals_of(&self, run: usize) -> core::ops::Range<usize> {
        self.begin[run]..self.begin[run + 1]
    }
    /// The recordings made ready for simulation.
    pub fn plans(&self) -> &[PredictionPlan] {
        &self.plans
    }
    /// The coordinates to start from.
    pub fn start(&self) -> Vec<f64> {
        self.unknowns.iter().map(|u| u.scale.coordinate(u.start)).collect()
    }
    /// The values at `theta`.
    pub fn values(&self, theta: &[f64]) -> Vec<f64> {
        self.unknowns.iter().zip(theta).map(|(u, x)| u.scale.value(*x).0).collect()
    }
    /// All parameters of the model in one run at `theta`.
    pub fn parameters(&self, run: usize, theta: &[f64]) -> Vec<f64> {
        self.arguments(run, theta, |_, v, _| v).0
    }

    /// All parameters of the model at `theta`, those of single recordings left as they were.
    pub fn shared(&self, theta: &[f64]) -> Vec<f64> {
        let mut p = self.nominal.clone();
        for (u, x) in self.unknowns.iter().zip(theta).filter(|(u, _)| u.run.is_none()) {
            if let FitTarget::Parameter(i) = u.target {
                p[i] = u.scale.value(*x).0;
            }
        }
        p
    }

    /// Readings of one run at `theta`, gains and offsets included.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn predict(&self, run: usize, theta: &[f64]) -> Result<Vec<f64>, PredictError> {
        let (p, map, sensors) = self.arguments(run, theta, |_, v, _| v);
        let plan = self.plan(run, theta);
        let mut y = self.model.readings(&plan, &p, &map, self.runs[run].at_rest)?;
        self.read(run, &mut y, &sensors);
        Ok(y)
    }

    /// A recording made ready, read as late as it is at `theta`.
    fn plan(&self, run: usize, theta: &[f64]) -> Cow<'_, PredictionPlan> {
        let acting = self.acting(run);
        if !acting.iter().any(|&k| self.unknowns[k].target.shifts()) {
            return Cow::Borrowed(&self.plans[run]);
        }
        let mut shifted = self.runs[run].clone();
        for k in acting {
            let value = self.unknowns[k].scale.value(theta[k]).0;
            match self.unknowns[k].target {
                FitTarget::SensorDelay(output) => shifted.read_late(output, value),
                FitTarget::InputSensorDelay(input) => shifted.driven_late(input, value),
                _ => {}
            }
        }
        Cow::Owned(PredictionPlan::new(&shifted, self.model.counts().inputs))
    }

    /// Column of an unknown that shifts readings: plans have no derivative.
    fn shift(&self, run: usize, theta: &[f64], k: usize) -> Result<Vec<f64>, PredictError> {
        let at = |by: f64| {
            let mut moved = theta.to_vec();
            moved[k] += by;
            Ok(self.weighted(run, &self.predict(run, &moved)?, |_, _, _| {}))
        };
        let (late, early) = (at(SHIFT)?, at(-SHIFT)?);
        Ok(late.iter().zip(&early).map(|(a, b)| (a - b) / (2.0 * SHIFT)).collect())
    }

    fn acting(&self, run: usize) -> Vec<usize> {
        (0..self.unknowns.len()).filter(|&k| self.unknowns[k].run.is_none_or(|r| r == run)).collect()
    }

    /// Parameters, inputs and sensors of a run; `seed` makes a scalar of unknown, value and dvalue/dtheta.
    pub(crate) fn arguments<T: Scalar>(
        &self,
        run: usize,
        theta: &[f64],
        seed: impl Fn(usize, f64, f64) -> T,
    ) -> (Vec<T>, InputMap<T>, Vec<LinearSensor<T>>) {
        let n = self.model.counts();
        let mut p: Vec<T> = self.nominal.iter().map(|v| T::constant(*v)).collect();
        self.runs[run].known.iter().for_each(|(i, v)| p[*i] = T::constant(*v));
        let mut map = InputMap { gain: vec![T::one(); n.inputs], bias: vec![T::zero(); n.inputs] };
        let mut sensors = self.runs[run].believed(n.inputs, n.outputs);
        for k in self.acting(run) {
            let (value, slope) = self.unknowns[k].scale.value(theta[k]);
            let v = seed(k, value, slope);
            match self.unknowns[k].target {
                FitTarget::Parameter(i) => p[i] = v,
                FitTarget::Offset(i) => sensors.outputs[i].offset = v,
                FitTarget::Gain(i) => sensors.outputs[i].gain = v,
                FitTarget::InputOffset(i) => sensors.inputs[i].offset = v,
                FitTarget::InputGain(i) => sensors.inputs[i].gain = v,
                FitTarget::InputBias(i) => map.bias[i] = v,
                FitTarget::SensorDelay(_) | FitTarget::InputSensorDelay(_) => {}
            }
        }
        // The assumed offset is already subtracted from the readings.
        let sensors = sensors.beside(&self.runs[run].believed(n.inputs, n.outputs));
        let read = sensors.inputs_of();
        map.gain = read.gain;
        map.bias.iter_mut().zip(read.bias).for_each(|(bias, read)| *bias += read);
        (p, map, sensors.outputs)
    }
    /// The model.
    pub fn model(&self) -> &'a dyn Predictor {
        self.model
    }

    /// What is there becomes what the sensors show.
    fn read<T: Scalar>(&self, run: usize, y: &mut [T], sensors: &[LinearSensor<T>]) {
        let plan = &self.plans[run];
        for (c, channel) in self.runs[run].channels.iter().enumerate() {
            let range = plan.channels()[c]..plan.channels()[c + 1];
            y[range].iter_mut().for_each(|y| *y = sensors[channel.output].reads(*y));
        }
    }

    /// Readings of one run at `theta` and, column by column, their exact derivatives by each unknown, which must be none that
    /// shifts readings.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn predict_along(
        &self,
        run: usize,
        theta: &[f64],
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), PredictError> {
        let acting = self.acting(run);
        let (mut readings, mut columns) = (Vec::new(), Vec::new());
        for piece in acting.chunks(LANES) {
            let found = self.along(run, theta, piece)?;
            let column = |lane: usize| found.iter().map(|y| y.eps[lane]).collect::<Vec<f64>>();
            columns.extend((0..piece.len()).map(column));
            readings = found.iter().map(|y| y.value()).collect();
        }
        if acting.is_empty() {
            readings = self.predict(run, theta)?;
        }
        let none = || vec![0.0; readings.len()];
        let mut all: Vec<Vec<f64>> = self.unknowns.iter().map(|_| none()).collect();
        acting.into_iter().zip(columns).for_each(|(k, column)| all[k] = column);
        Ok((readings, all))
    }

    /// Readings of a run with a lane for each of these unknowns.
    fn along(&self, run: usize, theta: &[f64], acting: &[usize]) -> Result<Vec<Lanes>, PredictError> {
        let (p, map, sensors) = self.arguments(run, theta, |k, value, slope| {
            let mut v = Lanes::constant(value);
            if let Some(i) = acting.iter().position(|a| *a == k) {
                v.eps[i] = slope;
            }
            v
        });
        let plan = self.plan(run, theta);
        let mut found = self.model.readings_along(&plan, &p, &map, self.runs[run].at_rest)?;
        self.read(run, &mut found, &sensors);
        Ok(found)
    }

    /// Residuals of a run and, column by column, their derivatives by the unknowns that act in it.
    fn derivatives(
        &self,
        run: usize,
        theta: &[f64],
        acting: &[usize],
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), PredictError> {
        let found = self.along(run, theta, acting)?;
        let mut columns = vec![vec![0.0; found.len()]; acting.len()];
        let residuals = self.weighted(run, &found, |at, y, slope| {
            columns.iter_mut().zip(y.eps).for_each(|(c, e)| c[at] = e * slope);
        });
        Ok((residuals, columns))
    }

    fn weighted<T: Scalar>(&self, run: usize, y: &[T], mut each: impl FnMut(usize, &T, f64)) -> Vec<f64> {
        let mut residuals = Vec::with_capacity(y.len());
        for channel in &self.runs[run].channels {
            let slack = self.slack_of(channel);
            for (k, measured) in channel.y.iter().enumerate() {
                let at = residuals.len();
                let off = y[at].value() - measured;
                let (r, slope) = match slack {
                    Some(slack) => {
                        let (r, slope) = interval::residual(off, channel.resolution, slack);
                        let weight = channel.worth(k).sqrt();
                        (r * weight, slope * weight)
                    }
                    None => (off / channel.deviation(k), 1.0 / channel.deviation(k)),
                };
                each(at, &y[at], slope);
                residuals.push(r);
            }
        }
        residuals
    }

    fn run_derivatives(
        &self,
        run: usize,
        theta: &[f64],
    ) -> Result<(Vec<f64>, JacobianColumns), PredictError> {
        let (shifts, acting): (Vec<usize>, Vec<usize>) =
            self.acting(run).into_iter().partition(|&k| self.unknowns[k].target.shifts());
        let (mut residuals, mut all) = (Vec::new(), Vec::new());
        for piece in acting.chunks(LANES) {
            let (r, columns) = self.derivatives(run, theta, piece)?;
            residuals = r;
            all.extend(piece.iter().copied().zip(columns));
        }
        if acting.is_empty() {
            let found = self.predict(run, theta)?;
            residuals = self.weighted(run, &found, |_, _, _| {});
        }
        for k in shifts {
            all.push((k, self.shift(run, theta, k)?));
        }
        self.whiten(run, &mut residuals);
        all.iter_mut().for_each(|(_, column)| self.whiten(run, column));
        Ok((residuals, all))
    }

    /// Weighs residuals by the noise of the measured inputs too ([`crate::carried`]), as it is at `theta`; whether the model
    /// can say what that does.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn carry_noise(&mut self, theta: &[f64]) -> Result<bool, PredictError> {
        if !self.model.carries_noise() {
            return Ok(false);
        }
        let carried = |run: usize| {
            let (p, map, _) = self.arguments(run, theta, |_, v, _| v);
            self.model.carried(&self.runs[run], &self.plans[run], &p, &map)
        };
        let all: Result<Vec<_>, _> = parallel::map(0..self.runs.len(), carried).into_iter().collect();
        self.carried = all?;
        Ok(true)
    }
}

impl LeastSquares for OutputError<'_> {
    type Error = PredictError;

    fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        let of = |v: f64, u: &FitUnknown| if v.is_finite() { u.scale.coordinate(v) } else { v };
        (
            self.unknowns.iter().map(|u| of(u.lower, u)).collect(),
            self.unknowns.iter().map(|u| of(u.upper, u)).collect(),
        )
    }

    fn evaluate(&self, theta: &[f64], jacobian: bool) -> Result<ResidualEvaluation, PredictError> {
        let believed: Vec<usize> = (0..theta.len()).filter(|&k| self.unknowns[k].prior.is_some()).collect();
        let (readings, rows) = (self.readings(), self.readings() + believed.len());
        let mut residuals = DVector::zeros(rows);
        let mut columns = jacobian.then(|| DMatrix::zeros(rows, theta.len()));
        if let Some(j) = &mut columns {
            let found: Vec<_> = parallel::map(0..self.runs.len(), |run| self.run_derivatives(run, theta));
            for (run, found) in found.into_iter().enumerate() {
                let (r, all) = found?;
                residuals.as_mut_slice()[self.residuals_of(run)].copy_from_slice(&r);
                for (k, column) in all {
                    j.column_mut(k).as_mut_slice()[self.residuals_of(run)].copy_from_slice(&column);
                }
            }
        } else {
            let found: Vec<_> = parallel::map(0..self.runs.len(), |run| {
                let mut r = self.weighted(run, &self.predict(run, theta)?, |_, _, _| {});
                self.whiten(run, &mut r);
                Ok(r)
            });
            for (run, r) in found.into_iter().enumerate() {
                residuals.as_mut_slice()[self.residuals_of(run)].copy_from_slice(&r?);
            }
        }
        for (row, &k) in believed.iter().enumerate() {
            if let Some((mean, sd)) = self.unknowns[k].prior {
                residuals[readings + row] = (theta[k] - mean) / sd;
                if let Some(j) = &mut columns {
                    j[(readings + row, k)] = 1.0 / sd;
                }
            }
        }
        Ok(ResidualEvaluation { residuals, jacobian: columns })
    }
}
