//! Intensities of the latent forces, by the evidence of a base.

use super::evidence::AmplitudePriors;
use super::frame::{INTENSITY, InnovationsFrame};
use super::gram::PackedColumns;
use super::kernel::SizeError;

/// Logarithm of the factor up to which two intensities are about the same (4.5).
pub const ALIKE: f64 = 1.5;

/// Whether intensities are about the same.
pub fn alike(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a / b).ln().abs() < ALIKE)
}

/// Sum of squares: the power of the latents.
pub fn power(q: &[f64]) -> f64 {
    q.iter().map(|q| q * q).sum()
}

impl InnovationsFrame {
    /// Coordinate search from `q` by a factor 4 and, with each round, its root; also their evidence.
    ///
    /// # Errors
    /// Where no filter was made for the plant's size.
    pub fn search_intensities(
        &mut self,
        base: &(PackedColumns, AmplitudePriors),
        q: &[f64],
        rounds: usize,
    ) -> Result<(Vec<f64>, f64), SizeError> {
        let (mut q, mut factor) = (q.to_vec(), 4.0f64);
        let mut best = self.evidence_of(base, &q)?.log;
        for _ in 0..rounds {
            for k in 0..q.len() {
                let mut moved = false;
                for by in [1.0 / factor, factor] {
                    loop {
                        let mut tried = q.clone();
                        tried[k] = (tried[k] * by).clamp(INTENSITY[0], INTENSITY[1]);
                        if tried[k] == q[k] {
                            break;
                        }
                        let log = self.evidence_of(base, &tried)?.log;
                        if log <= best + 0.1 {
                            break;
                        }
                        (best, q, moved) = (log, tried, true);
                    }
                    if moved {
                        break;
                    }
                }
            }
            factor = factor.sqrt();
        }
        Ok((q, best))
    }

    /// That of these intensities at which a base has its best evidence, and that evidence.
    ///
    /// # Errors
    /// Where no filter was made for the plant's size.
    pub fn best_of(
        &mut self,
        base: &(PackedColumns, AmplitudePriors),
        all: &[Vec<f64>],
    ) -> Result<(Vec<f64>, f64), SizeError> {
        let mut best = (Vec::new(), f64::NEG_INFINITY);
        for q in all {
            let log = self.evidence_of(base, q)?.log;
            if log > best.1 || best.0.is_empty() {
                best = (q.clone(), log);
            }
        }
        Ok(best)
    }

    /// Intensities and evidence of the model alone, parameters free, about the present trajectory; `wide`: from the best of
    /// several starts.
    ///
    /// # Errors
    /// Where no filter was made for the plant's size.
    pub fn null(&mut self, q: &[f64], rounds: usize, wide: bool) -> Result<(Vec<f64>, f64), SizeError> {
        let base = self.packed(&[]);
        let mut q = q.to_vec();
        if wide {
            let starts =
                [(0.3, 0.3), (0.02, 0.02), (0.002, 0.02), (0.02, 0.002), (0.002, 0.002), (0.002, 0.1)];
            let mut all = vec![q];
            all.extend(starts.map(|(driven, others)| self.intensities(driven, others)));
            q = self.best_of(&base, &all)?.0;
        }
        self.search_intensities(&base, &q, rounds)
    }
}
