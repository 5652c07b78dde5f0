//! Intensities of the latent forces, by the evidence of a base.

use super::evidence::{AmplitudePriors, SetEvidence};
use super::frame::{INTENSITY, InnovationsFrame};
use super::gram::PackedColumns;

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

/// Intensities with what a base has there.
#[derive(Clone, Debug, Default)]
pub struct BestIntensities {
    /// In usual forces.
    pub q: Vec<f64>,
    /// Evidence and amplitudes.
    pub found: SetEvidence,
}

/// Intensities with one of them at another factor, within bounds.
fn moved(q: &[f64], k: usize, by: f64) -> Vec<f64> {
    let mut q = q.to_vec();
    q[k] = (q[k] * by).clamp(INTENSITY[0], INTENSITY[1]);
    q
}

/// A base with the priors of its amplitudes.
pub type BaseWithPriors = (PackedColumns, AmplitudePriors);

impl InnovationsFrame {
    /// Coordinate search by a factor 4 and, with each round, its root.
    pub fn search_intensities(
        &mut self,
        base: &BaseWithPriors,
        from: BestIntensities,
        rounds: usize,
    ) -> BestIntensities {
        let (mut best, mut factor) = (from, 4.0f64);
        for _ in 0..rounds {
            // Mostly no neighbour is better; they are filtered side by side.
            let mut around: Vec<Vec<f64>> = (0..best.q.len())
                .flat_map(|k| [1.0 / factor, factor].map(|by| moved(&best.q, k, by)))
                .collect();
            around.retain(|q| *q != best.q);
            let found = self.evidences_of(base, &around);
            let known: Vec<(Vec<f64>, SetEvidence)> = around.into_iter().zip(found).collect();
            for k in 0..best.q.len() {
                let mut improved = false;
                for by in [1.0 / factor, factor] {
                    loop {
                        let q = moved(&best.q, k, by);
                        if q[k] == best.q[k] {
                            break;
                        }
                        let found = match known.iter().find(|n| n.0 == q) {
                            Some((_, found)) => found.clone(),
                            None => self.evidences_of(base, std::slice::from_ref(&q)).swap_remove(0),
                        };
                        if found.log <= best.found.log + 0.1 {
                            break;
                        }
                        (best, improved) = (BestIntensities { q, found }, true);
                    }
                    if improved {
                        break;
                    }
                }
            }
            factor = factor.sqrt();
        }
        best
    }

    /// That of these intensities at which a base has its best evidence.
    pub fn best_of(&mut self, base: &BaseWithPriors, all: &[Vec<f64>]) -> BestIntensities {
        let mut best: Option<BestIntensities> = None;
        for (q, found) in all.iter().zip(self.evidences_of(base, all)) {
            if best.as_ref().is_none_or(|b| found.log > b.found.log) {
                best = Some(BestIntensities { q: q.clone(), found });
            }
        }
        best.unwrap_or_default()
    }

    /// Intensities and evidence of the model alone, parameters free, about the present trajectory; `wide`: from the best of
    /// several starts.
    pub fn null(&mut self, q: &[f64], rounds: usize, wide: bool) -> (Vec<f64>, f64) {
        let base = self.packed(&[]);
        let mut all = vec![q.to_vec()];
        if wide {
            let starts =
                [(0.3, 0.3), (0.02, 0.02), (0.002, 0.02), (0.02, 0.002), (0.002, 0.002), (0.002, 0.1)];
            all.extend(starts.map(|(driven, others)| self.intensities(driven, others)));
        }
        let from = self.best_of(&base, &all);
        let best = self.search_intensities(&base, from, rounds);
        (best.q, best.found.log)
    }
}
