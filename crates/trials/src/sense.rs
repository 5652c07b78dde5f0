//! From what happens to what is read: instants, noise, resolution, gaps.

use crate::draw::SeededDraw;

/// A sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meter {
    /// Standard deviation.
    pub(crate) noise: f64,
    /// Smallest step; 0: none.
    pub(crate) step: f64,
    /// Correlation of the noise from sample to sample.
    pub(crate) color: f64,
}

impl Meter {
    /// Standard deviation of all of it.
    pub(crate) fn deviation(&self) -> f64 {
        (self.noise * self.noise + self.step * self.step / 12.0).sqrt()
    }
    pub(crate) fn round(&self, value: f64) -> f64 {
        if self.step > 0.0 { (value / self.step).round() * self.step } else { value }
    }
    /// One reading; `last` is the state of the noise.
    pub(crate) fn read(&self, value: f64, last: &mut f64, d: &mut SeededDraw) -> f64 {
        *last = self.color * *last + (1.0 - self.color * self.color).sqrt() * d.normal();
        self.round(value + self.noise * *last)
    }
}

/// Instants of `count` samples, `jitter` as a share of the period.
pub(crate) fn instants(rate: f64, count: usize, jitter: f64, d: &mut SeededDraw) -> Vec<f64> {
    (0..count)
        .map(|i| {
            let off = if i == 0 || i + 1 == count { 0.0 } else { (jitter * d.normal()).clamp(-0.3, 0.3) };
            // Time stamps have 10 us.
            ((i as f64 + off) / rate * 1e5).round() / 1e5
        })
        .collect()
}

/// Takes samples away, alone and in short bursts.
pub(crate) fn drop_out(values: &mut [f64], share: f64, d: &mut SeededDraw) {
    if share <= 0.0 {
        return;
    }
    let mut i = 1;
    while i + 1 < values.len() {
        if d.chance(share) {
            let burst = if d.chance(0.1) { 8 } else { 1 };
            for v in values.iter_mut().skip(i).take(burst) {
                *v = f64::NAN;
            }
            i += burst;
        }
        i += 1;
    }
}
