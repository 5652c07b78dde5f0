//! Random numbers from a seed that messages print.

use rand::{Rng, SeedableRng, rngs::StdRng};

/// Draws from a seed.
pub(crate) struct Draws {
    seed: u64,
    rng: StdRng,
}

impl Draws {
    /// `TRUEUP_SEED` instead of this seed, if it is set.
    pub(crate) fn new(seed: u64) -> Self {
        let seed = std::env::var("TRUEUP_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(seed);
        Self { seed, rng: StdRng::seed_from_u64(seed) }
    }
    /// Evenly between these.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.rng.random_range(low..high)
    }
}

impl std::fmt::Display for Draws {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "seed {}", self.seed)
    }
}
