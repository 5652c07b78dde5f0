//! What a model misses of recordings, and its derivatives by what is unknown.

use nalgebra::{DMatrix, DVector};
use trueup_identification::lsq::{LeastSquares, ResidualEvaluation};
use trueup_identification::parallel;
use trueup_identification::predict::{KeptLaws, PredictError, PredictionPlan, predict, predict_again};
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation};
use trueup_identification::sensors::SensorSet;
use trueup_models::arm::ArmScalar;
use trueup_numerics::Scalar;
use trueup_plant::{LANES, Lanes};
use trueup_signals::PriorGuess;

use super::balance::{GriddedRecording, Links};
pub use super::compared::Compared;
use super::compared::plan_of;
use super::subject::EngineModel;
pub use super::unknown::{BalanceTarget, BalanceUnknown};

/// Columns of a Jacobian with the unknown that each belongs to.
pub(super) type BalanceColumns = Vec<(usize, Vec<f64>)>;

/// The joint prior of several unknowns: `rows` times their distance from `at` has deviation 1.
#[derive(Clone, Debug)]
pub struct Belief {
    /// Which unknowns.
    pub of: Vec<usize>,
    /// Their coordinates.
    pub at: Vec<f64>,
    /// One row per independent statement.
    pub rows: DMatrix<f64>,
}

/// A model, recordings, and what is unknown.
#[derive(Clone, Debug)]
pub struct BalanceProblem<'a> {
    /// With its effects.
    pub model: &'a EngineModel,
    /// All parameters.
    pub nominal: Vec<f64>,
    /// Parameters that follow another: `(which, whom)`.
    pub ties: Vec<(usize, usize)>,
    /// The recordings.
    pub runs: &'a [Compared],
    /// The recordings that drive the model; empty: it runs freely.
    pub prescribed: Vec<(&'a GriddedRecording, Links)>,
    /// What is estimated.
    pub unknowns: Vec<BalanceUnknown>,
    /// Free-running: deviation by recording and output that the model is allowed in addition to that of the readings; empty: none.
    pub allowed: Vec<Vec<f64>>,
    /// The joint prior of several unknowns.
    pub belief: Option<&'a Belief>,
    /// Orders of a shaft: which unknown (its logarithm is searched), and the angle that the shaft turns through (rad).
    pub orders: Vec<(usize, f64)>,
    /// Laws of the model, where several problems differ in where it begins.
    pub laws: Option<&'a KeptLaws>,
}

impl<'a> BalanceProblem<'a> {
    /// A model that runs freely through recordings, all of it known.
    pub fn free(model: &'a EngineModel, nominal: Vec<f64>, runs: &'a [Compared]) -> Self {
        Self {
            model,
            nominal,
            ties: Vec::new(),
            runs,
            prescribed: Vec::new(),
            unknowns: Vec::new(),
            orders: Vec::new(),
            allowed: Vec::new(),
            belief: None,
            laws: None,
        }
    }
}

impl BalanceProblem<'_> {
    /// Coordinates to start from.
    pub fn start(&self) -> Vec<f64> {
        self.unknowns.iter().map(BalanceUnknown::coordinate).collect()
    }
    /// Values at `theta`.
    pub fn values(&self, theta: &[f64]) -> Vec<f64> {
        self.unknowns.iter().zip(theta).map(|(u, x)| u.scale.value(*x).0).collect()
    }
    /// How many readings there are: the residuals before those of the priors.
    pub fn readings(&self) -> usize {
        (0..self.runs.len()).map(|run| self.length(run)).sum()
    }
    fn length(&self, run: usize) -> usize {
        self.prescribed.get(run).map_or_else(|| self.runs[run].len(), |l| l.0.len())
    }
    /// Where each recording's residuals begin; last: where they end.
    pub fn begins(&self) -> Vec<usize> {
        let mut begin = vec![0];
        (0..self.runs.len()).for_each(|r| begin.push(begin[begin.len() - 1] + self.length(r)));
        begin
    }
    /// All parameters in one recording at `theta`; beyond the last: in none of them.
    pub fn parameters(&self, run: usize, theta: &[f64]) -> Vec<f64> {
        self.arguments(run, theta, |_, v, _| v).0
    }

    fn acting(&self, run: usize) -> Vec<usize> {
        (0..self.unknowns.len()).filter(|&k| self.unknowns[k].run.is_none_or(|r| r == run)).collect()
    }

    /// Parameters and sensors; `seed` makes a scalar of unknown, value and dvalue/dtheta.
    fn arguments<T: Scalar>(
        &self,
        run: usize,
        theta: &[f64],
        seed: impl Fn(usize, f64, f64) -> T,
    ) -> (Vec<T>, SensorSet<T>) {
        let mut p: Vec<T> = self.nominal.iter().map(|v| T::constant(*v)).collect();
        let known = self.runs.get(run).map_or(&[][..], |r| &r.known);
        known.iter().for_each(|(i, v)| p[*i] = T::constant(*v));
        let sizes = self.model.sizes();
        let believed = self.runs.get(run).map_or_else(
            || SensorSet::none(sizes.inputs, sizes.outputs),
            |r| r.run.believed(sizes.inputs, sizes.outputs),
        );
        let mut sensors = believed.clone();
        let mut above = Vec::new();
        for k in self.acting(run) {
            let (value, slope) = self.unknowns[k].scale.value(theta[k]);
            let v = seed(k, value, slope);
            match self.unknowns[k].target {
                BalanceTarget::Parameter(i) => p[i] = v,
                BalanceTarget::Above { at, base } => above.push((at, base, v)),
                BalanceTarget::Offset(i) => sensors.outputs[i].offset = v,
                BalanceTarget::Gain(i) => sensors.outputs[i].gain = v,
                BalanceTarget::InputOffset(i) => sensors.inputs[i].offset = v,
                BalanceTarget::InputGain(i) => sensors.inputs[i].gain = v,
                BalanceTarget::SensorDelay(_)
                | BalanceTarget::ActuatorDeadTime(_)
                | BalanceTarget::ActuatorLag(_) => {}
                BalanceTarget::TotalSensorDelay(_) | BalanceTarget::InputSensorDelay(_) => {}
            }
        }
        self.ties.iter().for_each(|&(which, whom)| p[which] = p[whom]);
        above.into_iter().for_each(|(at, base, v)| p[at] = p[base] + v);
        // The prior means are removed from the readings already.
        (p, sensors.beside(&believed))
    }

    /// The recording with its delays as `theta` has them; `None`: as it is.
    fn shifted(&self, run: usize, theta: &[f64]) -> Option<(IdentificationRun, PredictionPlan)> {
        let acting = self.acting(run);
        if !acting.iter().any(|&k| self.unknowns[k].target.shifts()) {
            return None;
        }
        let mut shifted = self.runs[run].run.clone();
        // Sensors that are known to be late first: what comes on top of it adds to that.
        for &k in &acting {
            let value = self.unknowns[k].scale.value(theta[k]).0;
            match self.unknowns[k].target {
                BalanceTarget::TotalSensorDelay(output) => shifted.read_late(output, value),
                BalanceTarget::InputSensorDelay(input) => shifted.driven_late(input, value),
                _ => {}
            }
        }
        for k in acting {
            let value = self.unknowns[k].scale.value(theta[k]).0;
            match self.unknowns[k].target {
                BalanceTarget::SensorDelay(output) => {
                    let late = shifted.channels.iter_mut().filter(|c| c.output == output);
                    late.for_each(|c| c.delay += value);
                }
                BalanceTarget::ActuatorDeadTime(input) => {
                    let late = shifted.drives.iter_mut().filter(|d| d.input == input);
                    late.for_each(|d| d.t.iter_mut().for_each(|t| *t += value));
                }
                BalanceTarget::ActuatorLag(input) => {
                    let late = shifted.drives.iter_mut().filter(|d| d.input == input);
                    late.for_each(|d| *d = lagged(d, value));
                }
                _ => {}
            }
        }
        let plan = plan_of(&shifted, self.model.sizes().inputs);
        Some((shifted, plan))
    }

    /// What the channels show beyond what is measured (simulated less measured), channel after channel.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn errors(&self, run: usize, theta: &[f64]) -> Result<Vec<f64>, PredictError> {
        let (p, sensors) = self.arguments(run, theta, |_, v, _| v);
        let shifted = self.shifted(run, theta);
        self.differences(run, &p, &sensors, shifted.as_ref())
    }

    /// Readings as the model would show them in a recording, channel by channel.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn shown(&self, run: usize, theta: &[f64]) -> Result<Vec<Vec<f64>>, PredictError> {
        Ok(self.with_errors(run, self.errors(run, theta)?))
    }

    /// Readings of a recording with these errors, channel by channel.
    pub(super) fn with_errors(&self, run: usize, errors: Vec<f64>) -> Vec<Vec<f64>> {
        let mut errors = errors.into_iter();
        let channels = self.runs[run].run.channels.iter();
        channels.map(|c| c.y.iter().zip(errors.by_ref()).map(|(y, e)| e + y).collect()).collect()
    }

    fn differences<T: ArmScalar>(
        &self,
        run: usize,
        p: &[T],
        sensors: &SensorSet<T>,
        shifted: Option<&(IdentificationRun, PredictionPlan)>,
    ) -> Result<Vec<T>, PredictError> {
        let (data, plan) = shifted.map_or((&self.runs[run].run, &self.runs[run].plan), |(r, p)| (r, p));
        let map = sensors.inputs_of();
        let plant = self.model.plant();
        let mut found = match self.laws {
            Some(laws) => predict_again(plant, plan, p, &map, data.at_rest, laws)?,
            None => predict(plant, plan, p, &map, data.at_rest)?,
        };
        for (c, channel) in data.channels.iter().enumerate() {
            let range = plan.channels()[c]..plan.channels()[c + 1];
            for (y, measured) in found.y[range].iter_mut().zip(&channel.y) {
                *y = sensors.outputs[channel.output].reads(*y) - T::constant(*measured);
            }
        }
        Ok(found.y)
    }

    /// Residuals of a recording in units of what a perfect model leaves; of a free run, where not `weighted`, in those of the readings.
    fn look<T: ArmScalar>(
        &self,
        run: usize,
        theta: &[f64],
        p: &[T],
        sensors: &SensorSet<T>,
        weighted: bool,
    ) -> Result<Vec<T>, PredictError> {
        let Some((prescribed, links)) = self.prescribed.get(run) else {
            let mut found = self.differences(run, p, sensors, self.shifted(run, theta).as_ref())?;
            if weighted {
                found.iter_mut().zip(self.weights(run)).for_each(|(v, w)| *v = *v * w);
            }
            return Ok(found);
        };
        let moves: Vec<(BalanceTarget, f64)> = (self.acting(run).into_iter())
            .map(|k| self.moves(run, self.unknowns[k].target, self.unknowns[k].scale.value(theta[k]).0))
            .filter(|(target, by)| target.shifts() && *by != 0.0)
            .collect();
        if moves.is_empty() {
            return Ok(prescribed.weighted(&prescribed.missing(self.model, links, p, sensors)?));
        }
        let moved = prescribed.shifted(&moves);
        Ok(moved.weighted(&moved.missing(self.model, links, p, sensors)?))
    }

    /// A shift relative to the recording's prior mean.
    fn moves(&self, run: usize, target: BalanceTarget, value: f64) -> (BalanceTarget, f64) {
        let run = &self.runs[run].run;
        let beyond = |late: Option<PriorGuess>| late.map_or(0.0, |g| value - g.value);
        match target {
            BalanceTarget::TotalSensorDelay(output) => {
                let late = run.channels.iter().find(|c| c.output == output).and_then(|c| c.late);
                (BalanceTarget::SensorDelay(output), beyond(late))
            }
            BalanceTarget::InputSensorDelay(input) => {
                let late = run.drives.iter().find(|d| d.input == input).and_then(|d| d.late);
                (BalanceTarget::ActuatorDeadTime(input), -beyond(late))
            }
            other => (other, value),
        }
    }

    /// What is missing in each channel of a recording that drives the model.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn missing(&self, run: usize, theta: &[f64]) -> Result<Vec<Vec<f64>>, PredictError> {
        let (p, sensors) = self.arguments(run, theta, |_, v, _| v);
        self.prescribed.get(run).map_or_else(
            || Ok(Vec::new()),
            |(prescribed, links)| prescribed.missing(self.model, links, &p, &sensors),
        )
    }

    /// 1 over the deviation of each reading.
    pub(super) fn weights(&self, run: usize) -> Vec<f64> {
        let channels = self.runs[run].run.channels.iter();
        let own = self.allowed.get(run);
        let allowed = |output: usize| own.and_then(|a| a.get(output)).copied().unwrap_or(0.0);
        channels
            .flat_map(|c| (0..c.t.len()).map(move |k| 1.0 / c.deviation(k).hypot(allowed(c.output))))
            .collect()
    }

    fn columns(
        &self,
        run: usize,
        theta: &[f64],
        acting: &[usize],
        weighted: bool,
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), PredictError> {
        let (p, sensors) = self.arguments(run, theta, |k, value, slope| {
            let mut v = Lanes::constant(value);
            if let Some(i) = acting.iter().position(|a| *a == k) {
                v.eps[i] = slope;
            }
            v
        });
        let found = self.look(run, theta, &p, &sensors, weighted)?;
        let columns = (0..acting.len()).map(|i| found.iter().map(|y| y.eps[i]).collect()).collect();
        Ok((found.iter().map(|y| y.value()).collect(), columns))
    }

    /// Residuals of one recording.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn residual(&self, run: usize, theta: &[f64]) -> Result<Vec<f64>, PredictError> {
        let (p, sensors) = self.arguments(run, theta, |_, v, _| v);
        self.look(run, theta, &p, &sensors, true)
    }

    fn derivatives(
        &self,
        run: usize,
        theta: &[f64],
        weighted: bool,
    ) -> Result<(Vec<f64>, BalanceColumns), PredictError> {
        let (shifts, smooth): (Vec<usize>, Vec<usize>) =
            self.acting(run).into_iter().partition(|&k| self.unknowns[k].target.shifts());
        let (mut residuals, mut all) = (Vec::new(), Vec::new());
        for piece in smooth.chunks(LANES) {
            let (r, columns) = self.columns(run, theta, piece, weighted)?;
            residuals = r;
            all.extend(piece.iter().copied().zip(columns));
        }
        let plain =
            |theta: &[f64]| if weighted { self.residual(run, theta) } else { self.errors(run, theta) };
        if residuals.is_empty() {
            residuals = plain(theta)?;
        }
        let moves = |&k: &usize| self.unknowns[k].lower < self.unknowns[k].upper;
        for k in shifts.into_iter().filter(moves) {
            let mut moved = theta.to_vec();
            let step = 0.02;
            moved[k] += step;
            let there = plain(&moved)?;
            let column = there.iter().zip(&residuals).map(|(a, b)| (a - b) / step).collect();
            all.push((k, column));
        }
        Ok((residuals, all))
    }

    /// Residuals of the readings, without derivatives and priors.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn residuals(&self, theta: &[f64]) -> Result<Vec<f64>, PredictError> {
        let found: Vec<_> = parallel::map(0..self.runs.len(), |run| self.residual(run, theta));
        let mut all = Vec::with_capacity(self.readings());
        for r in found {
            all.extend(r?);
        }
        Ok(all)
    }

    /// What the first recording shows beyond what is measured, and its derivatives if requested, neither of them weighted; it runs
    /// freely.
    ///
    /// # Errors
    /// See [`PredictError`].
    pub(super) fn unweighted(
        &self,
        theta: &[f64],
        jacobian: bool,
    ) -> Result<(Vec<f64>, Option<BalanceColumns>), PredictError> {
        match jacobian {
            true => self.derivatives(0, theta, false).map(|(errors, columns)| (errors, Some(columns))),
            false => self.errors(0, theta).map(|errors| (errors, None)),
        }
    }

    /// Residuals and derivatives of all recordings with those of the priors behind them.
    pub(super) fn with_priors(
        &self,
        theta: &[f64],
        all: Vec<(Vec<f64>, Option<BalanceColumns>)>,
        jacobian: bool,
    ) -> ResidualEvaluation {
        let believed: Vec<usize> = (0..theta.len()).filter(|&k| self.unknowns[k].prior.is_some()).collect();
        let together = self.belief.map_or(0, |b| b.rows.nrows());
        let (readings, rows) = (self.readings(), self.readings() + believed.len() + together);
        let begin = self.begins();
        let mut residuals = DVector::zeros(rows);
        let mut columns = jacobian.then(|| DMatrix::zeros(rows, theta.len()));
        for (run, (r, own)) in all.into_iter().enumerate() {
            let range = begin[run]..begin[run + 1];
            residuals.as_mut_slice()[range.clone()].copy_from_slice(&r);
            let Some(j) = &mut columns else { continue };
            for (k, column) in own.iter().flatten() {
                j.column_mut(*k).as_mut_slice()[range.clone()].copy_from_slice(column);
            }
        }
        for (row, &k) in believed.iter().enumerate() {
            if let Some((residual, slope)) = self.unknowns[k].prior.map(|p| p.residual(theta[k])) {
                residuals[readings + row] = residual;
                if let Some(j) = &mut columns {
                    j[(readings + row, k)] = slope;
                }
            }
        }
        if let Some(belief) = self.belief {
            let apart = DVector::from_fn(belief.of.len(), |i, _| theta[belief.of[i]] - belief.at[i]);
            let begin = readings + believed.len();
            residuals.rows_mut(begin, together).copy_from(&(&belief.rows * apart));
            if let Some(j) = &mut columns {
                for (i, k) in belief.of.iter().enumerate() {
                    j.view_mut((begin, *k), (together, 1)).copy_from(&belief.rows.column(i));
                }
            }
        }
        ResidualEvaluation { residuals, jacobian: columns }
    }
}

/// An input behind a first-order lag T dx/dt = u - x, exactly at its samples and at three instants between.
fn lagged(drive: &InputDrive, lag: f64) -> InputDrive {
    if lag <= 0.0 || drive.t.len() < 2 {
        return drive.clone();
    }
    let (mut t, mut u) = (Vec::new(), Vec::new());
    let mut x = drive.u[0];
    for k in 0..drive.t.len() - 1 {
        let h = (drive.t[k + 1] - drive.t[k]) / 4.0;
        let slope = match drive.between {
            InputInterpolation::Hold => 0.0,
            InputInterpolation::Linear => (drive.u[k + 1] - drive.u[k]) / (4.0 * h),
        };
        let decay = (-h / lag).exp();
        for i in 0..4 {
            t.push(drive.t[k] + h * f64::from(i));
            u.push(x);
            // Response to a ramp that begins at u0: u0 + slope (h - T) + (x - u0 + slope T) e^(-h/T).
            let u0 = drive.u[k] + slope * h * f64::from(i);
            x = u0 + slope * (h - lag) + (x - u0 + slope * lag) * decay;
        }
    }
    t.push(drive.t[drive.t.len() - 1]);
    u.push(x);
    InputDrive { t, u, between: InputInterpolation::Linear, ..drive.clone() }
}

impl LeastSquares for BalanceProblem<'_> {
    type Error = PredictError;

    fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        let of = |v: f64, u: &BalanceUnknown| if v.is_finite() { u.scale.coordinate(v) } else { v };
        (
            self.unknowns.iter().map(|u| of(u.lower, u)).collect(),
            self.unknowns.iter().map(|u| of(u.upper, u)).collect(),
        )
    }

    /// A large change of an order is one that shifts the last period by a radian.
    fn units(&self, theta: &[f64]) -> DVector<f64> {
        let mut units = DVector::from_element(theta.len(), 1.0);
        for (k, turned) in &self.orders {
            units[*k] = 1.0 / (theta[*k].exp() * turned).max(1.0);
        }
        units
    }

    fn evaluate(&self, theta: &[f64], jacobian: bool) -> Result<ResidualEvaluation, PredictError> {
        let of = |run: usize| match jacobian {
            true => self.derivatives(run, theta, true).map(|(r, columns)| (r, Some(columns))),
            false => self.residual(run, theta).map(|r| (r, None)),
        };
        let all: Result<Vec<_>, PredictError> = parallel::map(0..self.runs.len(), of).into_iter().collect();
        Ok(self.with_priors(theta, all?, jacobian))
    }
}
