//! Reversals of what has dry friction: no kernel can follow them, so they are bridged.

use trueup_numerics::Scalar;

use super::links::Links;
use super::prescribed::GriddedRecording;

/// Over so many kernels a series fades into a reversal and out of it.
const FADE: f64 = 16.0;
/// Share of a recording in reversals from which on the rest gives no information: its octaves are those of the bridges.
const BRIDGED: f64 = 0.75;

impl GriddedRecording {
    /// What counts of a series: reversals, which no kernel can follow, are bridged by straight lines. The series fades into
    /// them and out of them, and their ends are means under a bell: what an abrupt cut would leave of the noise of
    /// accelerations outweighs all else that is slow.
    pub fn counted<T: Scalar>(&self, series: &[T]) -> Vec<T> {
        let raw = &series[self.counts.clone()];
        let masked = &self.reversal[self.counts.clone()];
        let mut all = raw.to_vec();
        let fade = (FADE * self.kernel).ceil() as usize;
        // Where the last bridge ended.
        let mut last = 0;
        while let Some(begin) = masked[last..].iter().position(|m| *m).map(|n| last + n) {
            let end = masked[begin..].iter().position(|m| !m).map_or(raw.len(), |n| begin + n);
            let next = masked[end..].iter().position(|m| *m).map_or(raw.len(), |n| end + n);
            // Centres of the bells and their means.
            let from = begin.saturating_sub(2 * fade).max(last);
            let to = next.min(end + 2 * fade);
            let before = bell(&raw[from..begin]).map(|v| (0.5 * (from + begin) as f64 - 0.5, v));
            let after = bell(&raw[end..to]).map(|v| (0.5 * (end + to) as f64 - 0.5, v));
            let bridge = |i: usize| match (before, after) {
                (Some((a, v)), Some((b, w))) => v + (w - v) * ((i as f64 - a) / (b - a)),
                (one, other) => one.or(other).map_or(T::zero(), |o| o.1),
            };
            // No further than half the way to the next one.
            let (left, right) = (fade.min((begin - last) / 2), fade.min((next - end) / 2));
            for i in begin - left..end + right {
                let own = if i < begin {
                    rise((begin - i) as f64 / (left + 1) as f64)
                } else {
                    rise((i + 1).saturating_sub(end) as f64 / (right + 1) as f64)
                };
                all[i] = bridge(i) * (1.0 - own) + raw[i] * own;
            }
            last = end;
        }
        all
    }

    /// Nearly all of it is reversals.
    pub fn is_bridged(&self) -> bool {
        let masked = self.reversal[self.counts.clone()].iter().filter(|m| **m).count();
        masked as f64 > BRIDGED * self.counts.len() as f64
    }

    /// Marks where something with dry friction turns.
    pub fn mark_reversals(&mut self, links: &Links) {
        let kernel = 5.0 * self.kernel * self.step;
        for &i in &links.held {
            let Some((c, _, rate)) = links.leads[i] else { continue };
            self.turning.push(c);
            let s = &self.channels[c];
            let (v, a) = if rate { (&s.y, &s.dy) } else { (&s.dy, &s.ddy) };
            for k in 0..self.t.len() {
                if v[k].abs() < 7.0 * s.rate_sigma + kernel * a[k].abs() {
                    self.reversal[k] = true;
                }
            }
        }
        // What is between two of them and too short to fade gives no information either.
        let least = (FADE * self.kernel).ceil() as usize;
        let mut last = None;
        for k in 0..self.reversal.len() {
            if self.reversal[k] {
                if let Some(l) = last.filter(|l| k - l <= least) {
                    self.reversal[l..k].fill(true);
                }
                last = Some(k);
            }
        }
    }
}

/// Mean under a bell (Hann), which the noise of accelerations hardly reaches.
fn bell<T: Scalar>(values: &[T]) -> Option<T> {
    let n = values.len() as f64 + 1.0;
    let weight = |k: usize| (std::f64::consts::PI * (k + 1) as f64 / n).sin().powi(2);
    let sum = values.iter().enumerate().fold(T::zero(), |sum, (k, v)| sum + *v * weight(k));
    (!values.is_empty()).then(|| sum / (0..values.len()).map(weight).sum::<f64>())
}

/// From 0 at 0 to 1 at 1, level at both.
fn rise(x: f64) -> f64 {
    0.5 - 0.5 * (std::f64::consts::PI * x).cos()
}
