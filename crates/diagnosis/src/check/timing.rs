//! When an input acts between its samples: held until the next one, or along the line to it.
//!
//! With steps h, q(k+1) - 2 q(k) + q(k-1) of an angle that u accelerates is a weighted sum of u(k-1), u(k), u(k+1): (1/2, 1/2, 0) if u
//! is held, (1/6, 4/6, 1/6) along lines. The centre of the weights is -1/2 or 0 of a step. It is estimated by least squares next to
//! viscous and dry friction, its standard deviation by leaving eighths of the recording out.

use nalgebra::{SMatrix, SVector};
use trueup_signals::{Interpolation, Recording};

const PARTS: usize = 8;
const COLUMNS: usize = 6;
/// An uneven clock has no step: largest deviation of a step from the usual one.
const UNEVEN: f64 = 0.05;
/// Standard deviations between what is declared and what is found.
const SURE: f64 = 3.0;
/// Less sure than that, in steps, the centre does not separate 0 from -1/2.
const BLUNT: f64 = 0.1;

type NormalEquations = (SMatrix<f64, COLUMNS, COLUMNS>, SVector<f64, COLUMNS>);

/// Centre of an input's weights in steps, and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InputCentre {
    pub(super) value: f64,
    pub(super) deviation: f64,
}

impl InputCentre {
    /// Of an input by the angle that it accelerates; `None` where the recording does not give it.
    pub(super) fn of(run: &Recording, input: &str, angle: &str) -> Option<Self> {
        let (u, q) = (run.channel(input)?, run.channel(angle)?);
        let step = q.median_step()?;
        let even = |w: &[f64]| (w[1] - w[0] - step).abs() <= UNEVEN * step;
        if q.len() < 200 || !q.time.windows(2).all(even) {
            return None;
        }
        // By the nearest sample: a line between samples would smooth.
        let mut at = 0;
        let sampled: Option<Vec<f64>> = q
            .time
            .iter()
            .map(|t| {
                while u.time.get(at).is_some_and(|own| *own < t - 0.25 * step) {
                    at += 1;
                }
                let near = u.time.get(at).is_some_and(|own| (own - t).abs() <= 0.25 * step);
                near.then(|| u.values[at])
            })
            .collect();
        let u = sampled?;
        let scale = |x: &[f64]| x.iter().fold(0.0, |m: f64, v| m.max(v.abs())).max(f64::MIN_POSITIVE);
        let [of_u, of_q] = [scale(&u), scale(&q.values)];
        let row = |k: usize| {
            let rate = (q.values[k + 1] - q.values[k - 1]) / of_q;
            let [a, b, c] = [u[k - 1], u[k], u[k + 1]].map(|x| x / of_u);
            let second = (q.values[k + 1] - 2.0 * q.values[k] + q.values[k - 1]) / of_q;
            (SVector::from([a, b, c, rate, rate.signum(), 1.0]), second)
        };
        let n = q.len() - 2;
        let part = |p: usize| {
            (1 + p * n / PARTS..1 + (p + 1) * n / PARTS)
                .map(row)
                .fold(zero(), |(m, v), (x, y)| (m + x * x.transpose(), v + x * y))
        };
        let parts: Vec<NormalEquations> = (0..PARTS).map(part).collect();
        let all = parts.iter().fold(zero(), |s, p| (s.0 + p.0, s.1 + p.1));
        let value = centre(&all)?;
        let each: Option<Vec<f64>> = parts.iter().map(|p| centre(&(all.0 - p.0, all.1 - p.1))).collect();
        let variance =
            each?.iter().map(|c| (c - value).powi(2)).sum::<f64>() * (PARTS - 1) as f64 / PARTS as f64;
        let own = Self { value, deviation: variance.sqrt() };
        (own.value.is_finite() && own.deviation.is_finite()).then_some(own)
    }

    /// What it speaks for, where it contradicts what is declared.
    pub(super) fn proposes(&self, declared: Interpolation) -> Option<Interpolation> {
        let (own, other) = match declared {
            Interpolation::Linear => (0.0, (-0.5, Interpolation::Hold)),
            Interpolation::Hold => (-0.5, (0.0, Interpolation::Linear)),
        };
        let off = |centre: f64| (self.value - centre).abs() / self.deviation.max(f64::MIN_POSITIVE);
        (self.deviation < BLUNT
            && off(own) > SURE
            && (off(other.0) < SURE || (self.value - other.0).abs() < BLUNT))
            .then_some(other.1)
    }
}

fn zero() -> NormalEquations {
    (SMatrix::zeros(), SVector::zeros())
}

fn centre((matrix, right): &NormalEquations) -> Option<f64> {
    let weights = matrix.cholesky()?.solve(right);
    let sum = weights[0] + weights[1] + weights[2];
    Some((weights[2] - weights[0]) / sum).filter(|c| c.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_signals::Channel;

    /// A mass with friction, driven at 100 Hz, integrated in steps of 0.1 ms.
    fn run(held: bool, noise: f64) -> Recording {
        let command = |k: usize| ((k / 7) as f64 * 1.7).sin() + 0.3 * (k as f64 * 0.9).sin();
        let (mut q, mut v, mut time, mut angle, mut current) = (0.0, 0.0, Vec::new(), Vec::new(), Vec::new());
        for k in 0..2000 {
            time.push(0.01 * k as f64);
            angle.push(q + noise * ((k * 7919 % 1000) as f64 / 500.0 - 1.0));
            current.push(command(k));
            for i in 0..100 {
                let part = if held { 0.0 } else { i as f64 / 100.0 };
                let u = command(k) + part * (command(k + 1) - command(k));
                v += 1e-4 * (u - 0.5 * v);
                q += 1e-4 * v;
            }
        }
        let channels =
            vec![Channel::new("u", "A", time.clone(), current), Channel::new("q", "rad", time, angle)];
        Recording { channels, ..Recording::default() }
    }

    #[test]
    fn a_held_input_and_one_along_lines_are_told_apart() {
        for (held, right, wrong) in [
            (true, Interpolation::Hold, Interpolation::Linear),
            (false, Interpolation::Linear, Interpolation::Hold),
        ] {
            let found = InputCentre::of(&run(held, 1e-6), "u", "q").unwrap();
            let expected = if held { -0.5 } else { 0.0 };
            assert!((found.value - expected).abs() < 0.05, "{held}: {found:?}");
            assert_eq!((found.proposes(wrong), found.proposes(right)), (Some(right), None), "{found:?}");
        }
    }

    #[test]
    fn noise_that_hides_it_leaves_it_open() {
        let found = InputCentre::of(&run(true, 0.1), "u", "q");
        assert!(found.is_none_or(|f| f.proposes(Interpolation::Linear).is_none()), "{found:?}");
    }
}
