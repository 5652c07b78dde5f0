//! The noise of measured inputs, carried through a simulation.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueup_identification::parallel;

/// Noise of deviation 1 with this correlation of successive readings.
pub(crate) fn coloured(correlation: f64, rng: &mut impl Rng) -> impl Iterator<Item = f64> {
    let new = (1.0 - correlation * correlation).sqrt();
    let first = rng.sample::<f64, _>(StandardNormal);
    std::iter::successors(Some(first), move |last| {
        Some(correlation * last + new * rng.sample::<f64, _>(StandardNormal))
    })
}

/// What noise of the inputs leaves in each output: the root mean square over `realisations` and samples of
/// `simulate(inputs + noise) - simulate(inputs)`.
///
/// `inputs` are the measured ones, sample by sample, `noise` deviation and correlation from sample to sample of their noise in
/// the same order (deviation 0: known).
/// `simulate` gives the free-running outputs; where the initial state is estimated again for every recording, it should do
/// so here too, for part of the noise goes into it. Without any noise it runs once. Same bits for the same seed.
///
/// # Errors
/// The result of `simulate`.
pub fn carried<E: Send>(
    inputs: &[Vec<f64>],
    noise: &[[f64; 2]],
    realisations: usize,
    seed: u64,
    simulate: impl Fn(&[Vec<f64>]) -> Result<Vec<Vec<f64>>, E> + Sync,
) -> Result<Vec<f64>, E> {
    let base = simulate(inputs)?;
    let mut power = vec![0.0; base.len()];
    if realisations == 0 || noise.iter().all(|n| n[0] == 0.0) {
        return Ok(power);
    }
    let one = |k: usize| -> Result<Vec<f64>, E> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(k as u64);
        let noisy: Vec<Vec<f64>> = inputs
            .iter()
            .zip(noise)
            .map(|(u, [sd, correlation])| match *sd {
                0.0 => u.clone(),
                sd => {
                    u.iter().zip(coloured(*correlation, &mut rng)).map(|(u, noise)| u + sd * noise).collect()
                }
            })
            .collect();
        let square = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            let n = a.len().min(b.len()).max(1);
            a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / n as f64
        };
        Ok(simulate(&noisy)?.iter().zip(&base).map(square).collect())
    };
    let all: Vec<_> = parallel::map(0..realisations, one);
    for found in all {
        power.iter_mut().zip(found?).for_each(|(p, x)| *p += x);
    }
    Ok(power.iter().map(|p| (p / realisations as f64).sqrt()).collect())
}
