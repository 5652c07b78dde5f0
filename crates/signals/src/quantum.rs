//! Steps in which a reading goes.

/// A reading counts where so many values occur, each in so many readings on average.
const COUNTS: usize = 20;
const EACH: usize = 4;

/// Steps of the reading.
pub(crate) struct Quantum {
    /// Least difference of two values.
    pub(crate) least: f64,
    /// All differences are multiples of it.
    pub(crate) regular: bool,
    /// Number of different values.
    pub(crate) distinct: usize,
}

impl Quantum {
    /// Of values in any order. What is tiny is measured by what nearly all of them reach: one wild reading changes nothing.
    pub(crate) fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let mut sizes: Vec<f64> = values.iter().map(|x| x.abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let tiny = 1e-9 * sizes.get(sizes.len() * 19 / 20).copied().unwrap_or(0.0);
        let steps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > tiny).collect();
        let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
        let multiple = |d: &&f64| (*d / least - (*d / least).round()).abs() < 0.05;
        let regular = steps.iter().filter(multiple).count() * 20 >= steps.len() * 19;
        let least = if least.is_finite() { least } else { 0.0 };
        Self { least, regular, distinct: steps.len() + 1 }
    }

    /// So many values occur that steps between them are those of the sensor.
    pub(crate) fn has_many_values(&self) -> bool {
        self.distinct >= COUNTS
    }

    /// Each value occurs in several of so many readings.
    pub(crate) fn repeats(&self, readings: usize) -> bool {
        self.distinct * EACH < readings
    }
}
