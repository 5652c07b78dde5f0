//! Inner loops that are compiled for the sizes of a plant and for the vector units that the processor has.
//!
//! No product is fused with a sum, so that all processors give the same bits.

use pulp::{Arch, Simd, WithSimd};

/// A combination of sizes that no kernel was made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no filter is made for {states} states with latents and {forces} coordinates; add the size to `kernel::run`"
)]
pub struct SizeError {
    /// States with latents.
    pub states: usize,
    /// Coordinates.
    pub forces: usize,
}

/// A loop over nodes, for N states with latents and F coordinates.
pub(super) trait SizedKernel {
    type Output;
    /// Has to be inlined, so that it is compiled for the vector units.
    fn run<S: Simd, const N: usize, const F: usize>(self, simd: S) -> Self::Output;
}

struct Vectorised<K, const N: usize, const F: usize>(K);

impl<K: SizedKernel, const N: usize, const F: usize> WithSimd for Vectorised<K, N, F> {
    type Output = K::Output;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> K::Output {
        self.0.run::<S, N, F>(simd)
    }
}

/// Runs a kernel for these sizes.
pub(super) fn run<K: SizedKernel>(states: usize, forces: usize, kernel: K) -> Result<K::Output, SizeError> {
    let arch = Arch::new();
    match (states, forces) {
        (6, 2) => Ok(arch.dispatch(Vectorised::<K, 6, 2>(kernel))),
        (8, 2) => Ok(arch.dispatch(Vectorised::<K, 8, 2>(kernel))),
        _ => Err(SizeError { states, forces }),
    }
}
