//! Hypotheses about a chain in frames of their own: late channels, and a spring in a rigid joint.

use std::f64::consts::PI;
use std::rc::Rc;

use trueup_estimation::innovations::trajectory::fit::TrajectoryFit;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::nodes::START;
use trueup_estimation::innovations::trajectory::plant::TrajectoryError;

use super::chain_effect::ChainEffect;
use super::chain_fits::{ChainFits, frame_with};
use super::chain_form::EffectForm;
use super::laws::arm_law_of;
use super::levels::CHAIN_SEARCH;
use super::shape::LawShape;
use super::spline::CubicSpline;

/// Times that readings are put back, the change of the delay below which they stay, s, and the least and largest delay, s.
const RETIMED: (usize, f64, [f64; 2]) = (4, 2e-4, [5e-4, 0.53]);
/// Rounds of a fit in a frame of its own, and of a spring's last one.
const ROUNDS: [usize; 2] = [3, 6];
/// Long delays: step and end of those that are tried, s; the least that counts, s; share of the squares without delay that it leaves at
/// most.
const LONG: (f64, f64, f64, f64) = (0.01, 0.535, 0.05, 0.35);
/// Standard deviation of the first angle of what is not shown, rad.
const NOT_SHOWN: f64 = 0.1;
/// Frequencies with which a spring begins, Hz; its damping in periods of them over the stiffness; standard deviation of both logarithms.
const SPRING: ([f64; 4], f64, f64) = ([0.6, 1.2, 2.5, 6.0], 0.06, 1.5);

impl ChainFits<'_> {
    /// Channels late by about `delay` s, their readings put back; what is left of the delay is a column.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn retimed(
        &self,
        from: &TrajectoryFrame,
        channels: &[usize],
        mut delay: f64,
        q: &[f64],
    ) -> Result<Option<ChainEffect>, TrajectoryError> {
        let Some(law) = arm_law_of("sensor-delay", "sensor") else { return Ok(None) };
        let mut best: Option<ChainEffect> = None;
        for _ in 0..RETIMED.0 {
            let late: Vec<(usize, f64)> = channels.iter().map(|c| (*c, delay)).collect();
            let plant = self.structures.plant.clone();
            let mut z = frame_with(self.loaded, plant, &self.structures.nominal, &from.theta, &late)?;
            z.start()?;
            let floors = z.bounds();
            let begin: Vec<f64> = q
                .iter()
                .zip(&z.intensities)
                .zip(&floors)
                .map(|((q, own), [low, _])| own.min(q.max(*low)))
                .collect();
            let rest = EffectForm::new(law, LawShape::new("sensor", "rest", &[]).of(channels));
            let fit = self.fit(&mut z, std::slice::from_ref(&rest), &begin, ROUNDS[0])?;
            let half = 0.5 * z.runs.first().map_or(0.0, |r| r.nodes.step[0]);
            let step = half * fit.amplitudes.first().copied().unwrap_or(0.0);
            if best.as_ref().is_none_or(|b| fit.evidence > b.of_fit) {
                let shape = LawShape::new("sensor", "delay", &[("d", delay)]).of(channels);
                best =
                    Some(ChainEffect::apart("sensor-delay", shape, Some(rest), fit, z, CHAIN_SEARCH.delay));
            }
            if step.abs() < RETIMED.1 {
                break;
            }
            delay = (delay + step).clamp(RETIMED.2[0], RETIMED.2[1]);
        }
        Ok(best)
    }

    /// A long delay of channels, s: the model is refitted without their readings, and what it gives for them is compared with what was
    /// read; `None`: no delay explains that.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn long_delay(
        &self,
        from: &TrajectoryFrame,
        channels: &[usize],
    ) -> Result<Option<f64>, TrajectoryError> {
        let plant = self.structures.plant.clone();
        let mut z = frame_with(self.loaded, plant, &self.structures.nominal, &from.theta, &[])?;
        let width = z.channels();
        for c in channels {
            for r in &mut z.runs {
                let readings = Rc::make_mut(&mut r.readings);
                for at in (*c..readings.count.len()).step_by(width) {
                    (readings.mean[at], readings.count[at], readings.counted[at]) = (0.0, 0.0, false);
                }
            }
            let position = z.intake.channels[*c].state.filter(|k| *k < z.coordinates());
            position.into_iter().for_each(|k| z.first_deviation[k] = NOT_SHOWN);
        }
        z.linearise(&[])?;
        z.start()?;
        let q = z.intensities.clone();
        self.fit(&mut z, &[], &q, ROUNDS[0])?;
        let (step, end, least, share) = LONG;
        let delays: Vec<f64> = (0..).map(|k| step * f64::from(k)).take_while(|d| *d < end).collect();
        let mut squares = vec![0.0; delays.len()];
        for (r, read) in z.runs.iter().zip(&from.runs) {
            for c in channels {
                let variance = z.intake.channels[*c].variance;
                let begin = r.nodes.time[0];
                let said: Vec<f64> = r.model_readings.iter().skip(*c).step_by(width).copied().collect();
                let spline = CubicSpline::new(&r.nodes.time, &said);
                let there: Vec<(f64, f64)> = (0..r.nodes.len())
                    .filter(|t| read.readings.count[width * t + c] > 0.0 && r.nodes.time[*t] - begin > START)
                    .map(|t| {
                        let at = width * t + c;
                        (r.nodes.time[t] + read.readings.moments[at][0], read.readings.mean[at])
                    })
                    .collect();
                for (sum, delay) in squares.iter_mut().zip(&delays) {
                    let off: Vec<f64> = there.iter().map(|(t, y)| y - spline.value(t - delay)).collect();
                    let mean = off.iter().sum::<f64>() / off.len().max(1) as f64;
                    *sum += off.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / variance;
                }
            }
        }
        let best = (0..delays.len()).fold(0, |a, b| if squares[b] < squares[a] { b } else { a });
        Ok((delays[best] > least && squares[best] < share * squares[0]).then_some(delays[best]))
    }

    /// A rigid joint on a spring: stiffness and damping among the unknowns, from several frequencies.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn with_spring(
        &self,
        from: &TrajectoryFrame,
        joint: usize,
    ) -> Result<Option<ChainEffect>, TrajectoryError> {
        let table = from.plant.plant().table();
        let index = |name: &str| table.parameter(&format!("{name}[{}]", joint + 1));
        let (Some(inertia), Some(stiffness), Some(damping)) =
            (index("motorInertia"), index("jointStiffness"), index("jointDamping"))
        else {
            return Ok(None);
        };
        if from.theta[inertia] <= 0.0 {
            return Ok(None);
        }
        let mut best: Option<ChainEffect> = None;
        for hz in SPRING.0 {
            let k = from.theta[inertia] * (2.0 * PI * hz).powi(2);
            let with = |theta: &[f64]| {
                let mut theta = theta.to_vec();
                (theta[stiffness], theta[damping]) = (k, SPRING.1 * k / hz);
                theta
            };
            let (nominal, theta) = (with(&self.structures.nominal), with(&from.theta));
            let Some(plant) = self.structures.with_spring(joint, &nominal) else { return Ok(None) };
            let mut z = frame_with(self.loaded, plant, &nominal, &theta, &[])?;
            for u in
                Rc::make_mut(&mut z.unknown).iter_mut().filter(|u| u.index == stiffness || u.index == damping)
            {
                u.deviation = SPRING.2;
            }
            let fitted = z.start().and_then(|()| {
                let q = z.intensities.clone();
                self.fit(&mut z, &[], &q, ROUNDS[0])
            });
            // A trajectory that diverges with a spring is none with it.
            let Some(fit) = followed(fitted)? else { continue };
            if best.as_ref().is_none_or(|b| fit.evidence > b.of_fit) {
                let shape = LawShape::new("transmission", "spring", &[("f", hz)]).at(&[joint]);
                best =
                    Some(ChainEffect::apart("joint-flexibility", shape, None, fit, z, CHAIN_SEARCH.spring));
            }
        }
        let Some(b) = best else { return Ok(None) };
        let mut z = b.frame.clone();
        let again = followed(self.fit(&mut z, &[], &b.fit.intensities, ROUNDS[1]))?;
        Ok(Some(match again {
            Some(fit) if fit.evidence >= b.of_fit => {
                ChainEffect::apart(b.id, b.shape, None, fit, z, CHAIN_SEARCH.spring)
            }
            _ => b,
        }))
    }
}

/// A fit whose trajectory could be followed; `None`: it diverged.
fn followed(fit: Result<TrajectoryFit, TrajectoryError>) -> Result<Option<TrajectoryFit>, TrajectoryError> {
    match fit {
        Ok(fit) => Ok(Some(fit).filter(|f| f.evidence.is_finite())),
        Err(TrajectoryError::Singular(_)) => Ok(None),
        Err(e) => Err(e),
    }
}
