//! What readings show of their sensor: step, noise, motion, and how an input goes between its samples.

use crate::noise::{by_differences, second_differences};
use crate::quantum::Quantum;
use crate::recording::{Channel, Interpolation};

/// White noise is as large by second and by fourth differences, up to this factor.
const SAME: f64 = 1.3;
/// A reversal goes back by this share of the range, and by so many standard deviations of the noise.
const TURN: f64 = 0.05;
const BEYOND_NOISE: f64 = 6.0;
/// Steps of which more than this share leaves the value as it is are those of a command that is held.
const HELD: f64 = 0.5;
/// A step of the reading is larger than so many last digits of the text,
const DIGITS: f64 = 1.5;
/// and than these shares of the range: where values repeat, and where they are no decimals (a unit was converted).
const FINE: [f64; 2] = [1e-4, 1e-6];
/// Steps of so many counts are no longer rounded to the right number of them.
const MANY: f64 = 9.5;
/// Steps within which a reading at rest stays.
const FEW: f64 = 4.5;

/// Figures of a channel in one recording, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelFigures {
    /// Number of readings.
    pub readings: usize,
    /// Readings a second, by the median step; 0: one reading.
    pub rate: f64,
    /// Largest step between readings, s.
    pub longest_step: f64,
    /// Least and largest value.
    pub range: [f64; 2],
    /// Standard deviation about the mean.
    pub deviation: f64,
    /// Step of the readings; `None`: they are not seen to count.
    pub resolution: Option<f64>,
    /// Standard deviation of white noise, by differences of neighbouring readings; `None`: too few of them, or the motion or the resolution
    /// hides it.
    pub noise: Option<f64>,
    /// How often the motion turns back.
    pub reversals: usize,
    /// All readings are within a few steps of the reading.
    pub few_counts: bool,
    /// How it goes between samples, where the readings show that alone: a value that stays for several readings is held.
    pub interpolation: Option<Interpolation>,
}

impl ChannelFigures {
    /// Of a channel with at least one reading.
    pub fn of(c: &Channel) -> Option<Self> {
        let (low, high) = c.range()?;
        let n = c.len() as f64;
        let mean = c.values.iter().sum::<f64>() / n;
        let deviation = (c.values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
        let quantum = Quantum::of(&c.values);
        let resolution = counted(&c.values, &quantum, high - low);
        let noise =
            white(&c.values).filter(|noise| resolution.is_none_or(|step| *noise > step / 12f64.sqrt()));
        let steps = || c.time.windows(2).map(|w| w[1] - w[0]);
        let same = c.values.windows(2).filter(|w| w[0] == w[1]).count();
        let jumps = low < high && same as f64 > HELD * n && resolution.is_none();
        Some(Self {
            readings: c.len(),
            rate: c.median_step().filter(|h| *h > 0.0).map_or(0.0, f64::recip),
            longest_step: steps().fold(0.0, f64::max),
            range: [low, high],
            deviation,
            resolution,
            noise,
            reversals: reversals(&c.values, (TURN * (high - low)).max(BEYOND_NOISE * noise.unwrap_or(0.0))),
            few_counts: quantum.regular && quantum.repeats(c.len()) && high - low <= FEW * quantum.least,
            interpolation: jumps.then_some(Interpolation::Hold),
        })
    }

    /// The reading hardly leaves its noise.
    pub fn is_at_rest(&self) -> bool {
        let error = self.noise.unwrap_or(0.0).max(self.resolution.unwrap_or(0.0));
        self.few_counts || self.range[0] == self.range[1] || self.deviation < 3.0 * error
    }
}

/// The step of a reading that counts: all differences are multiples of it, and it is not the last digit that was written.
fn counted(values: &[f64], quantum: &Quantum, span: f64) -> Option<f64> {
    if !quantum.regular || !quantum.has_many_values() {
        return None;
    }
    let digit = (0..=9).map(|k| 10f64.powi(-k)).find(|digit| {
        let off = |x: &f64| (x / digit - (x / digit).round()).abs() > 1e-4;
        !values.iter().any(off)
    });
    let repeats = quantum.repeats(values.len()) && quantum.least > FINE[0] * span;
    let coarse = match digit {
        Some(digit) => quantum.least > DIGITS * digit,
        None => quantum.least > FINE[1] * span,
    };
    // Many steps together give one to more digits than the smallest.
    let (mut whole, mut counts) = (0.0, 0.0);
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    for step in sorted.windows(2).map(|w| w[1] - w[0]).filter(|d| *d < MANY * quantum.least) {
        whole += step;
        counts += (step / quantum.least).round();
    }
    (repeats || coarse).then_some(if counts > 0.0 { whole / counts } else { quantum.least })
}

/// Standard deviation of white noise in readings of a smooth motion, by the median of fourth differences, of which those of white
/// noise have the variance 70; by second differences (6) it is the same, else it is no white noise but the motion.
/// `None`: that, too few readings, or most differences are 0.
fn white(values: &[f64]) -> Option<f64> {
    if values.len() < 24 {
        return None;
    }
    let second = second_differences(values);
    let fourth = by_differences(&second_differences(&second), 70.0);
    let second = by_differences(&second, 6.0);
    (fourth > 0.0 && second < SAME * fourth).then_some(fourth)
}

/// How often values turn back by more than `least`.
fn reversals(values: &[f64], least: f64) -> usize {
    let Some(&first) = values.first() else { return 0 };
    let (mut low, mut high, mut rising, mut turns) = (first, first, None, 0);
    for &x in values {
        (low, high) = (low.min(x), high.max(x));
        let turned = match rising {
            Some(true) => high - x > least,
            Some(false) => x - low > least,
            None if high - low > least => {
                rising = Some(x == high);
                false
            }
            None => false,
        };
        if turned {
            turns += 1;
            rising = rising.map(|r| !r);
        }
        match rising {
            Some(true) => low = x,
            Some(false) => high = x,
            None => {}
        }
        if turned {
            (low, high) = (x, x);
        }
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(f: impl Fn(f64) -> f64) -> ChannelFigures {
        let time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        let values = time.iter().map(|t| f(*t)).collect();
        ChannelFigures::of(&Channel::new("x", "", time, values)).unwrap()
    }

    #[test]
    fn reversals_of_a_sine_and_of_a_ramp() {
        // 10 s of 1 Hz: two extremes a second.
        assert_eq!(of(|t| (std::f64::consts::TAU * t).sin()).reversals, 20);
        assert_eq!(of(|t| 3.0 * t).reversals, 0);
        assert_eq!(of(|_| 1.0).reversals, 0);
    }

    #[test]
    fn steps_and_holds_are_seen() {
        let counted = of(|t| (t.sin() / 0.01).round() * 0.01);
        assert!((counted.resolution.unwrap() - 0.01).abs() < 1e-12);
        let held = of(|t| (t / 0.1).floor().sin());
        assert_eq!((held.interpolation, held.resolution), (Some(Interpolation::Hold), None));
        assert_eq!(of(|t| t.sin()).interpolation, None);
        assert!(of(|_| 2.0).is_at_rest() && !counted.is_at_rest());
    }

    #[test]
    fn white_noise_is_estimated_beside_a_motion() {
        // A linear congruential sequence, uniform: standard deviation 1/sqrt(12).
        let mut state = 1_u64;
        let values: Vec<f64> = (0..20_000)
            .map(|k| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64 + (0.001 * f64::from(k)).sin() * 50.0
            })
            .collect();
        let noise = white(&values).unwrap();
        assert!((noise * 12f64.sqrt() - 1.0).abs() < 0.1, "{noise}");
    }
}
