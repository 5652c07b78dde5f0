//! Random draws; a case depends on its own numbers only, so that shards give the same cases.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sha2::{Digest, Sha256};

/// The generator of one case.
pub(crate) struct SeededDraw(ChaCha8Rng);

impl SeededDraw {
    /// Of the case with these numbers; `attempt`: a case that came out useless is drawn again.
    pub(crate) fn new(what: &str, seed: u64, index: usize, attempt: usize) -> Self {
        let text = format!("{what}/{seed}/{index}/{attempt}");
        Self(ChaCha8Rng::from_seed(Sha256::digest(text.as_bytes()).into()))
    }
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }
    pub(crate) fn log(&mut self, low: f64, high: f64) -> f64 {
        self.uniform(low.ln(), high.ln()).exp()
    }
    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
    pub(crate) fn chance(&mut self, p: f64) -> bool {
        self.0.random::<f64>() < p
    }
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0.random_range(0..n.max(1))
    }
    pub(crate) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
    pub(crate) fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }
    pub(crate) fn phase(&mut self) -> f64 {
        self.uniform(0.0, std::f64::consts::TAU)
    }
}
