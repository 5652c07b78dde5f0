//! Inner loops that are compiled for the sizes of a plant and for the vector units that the processor has.
//!
//! No product is fused with a sum, so that all processors give the same bits.

use pulp::{Arch, Simd, WithSimd};

/// A loop over nodes, for N states with latents and F coordinates.
pub(super) trait SizedKernel {
    type Output;
    /// Has to be inlined, so that it is compiled for the vector units.
    fn run<S: Simd, const N: usize, const F: usize>(self, simd: S) -> Self::Output;
    /// The same for sizes that no kernel was made for, slower; has to be inlined, too.
    fn run_any<S: Simd>(self, simd: S) -> Self::Output;
}

struct AnySize<K>(K);

impl<K: SizedKernel> WithSimd for AnySize<K> {
    type Output = K::Output;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> K::Output {
        self.0.run_any(simd)
    }
}

struct Vectorised<K, const N: usize, const F: usize>(K);

impl<K: SizedKernel, const N: usize, const F: usize> WithSimd for Vectorised<K, N, F> {
    type Output = K::Output;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> K::Output {
        self.0.run::<S, N, F>(simd)
    }
}

/// What decides which kernel takes a recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct KernelSizes {
    /// States with latents.
    pub(super) states: usize,
    /// Coordinates.
    pub(super) forces: usize,
    /// Steps are those of modes, and only forces are latent.
    pub(super) by_mode: bool,
}

/// Runs the kernel for any sizes. A closure in its place would be compiled apart, without the vector units.
pub(super) fn run_any_size<K: SizedKernel>(kernel: K) -> K::Output {
    Arch::new().dispatch(AnySize(kernel))
}

/// Runs a kernel: one that is made for these sizes, or the one for any.
pub(super) fn run<K: SizedKernel>(sizes: KernelSizes, kernel: K) -> K::Output {
    let arch = Arch::new();
    match (sizes.states, sizes.forces) {
        _ if !sizes.by_mode => run_any_size(kernel),
        (6, 2) => arch.dispatch(Vectorised::<K, 6, 2>(kernel)),
        (8, 2) => arch.dispatch(Vectorised::<K, 8, 2>(kernel)),
        _ => run_any_size(kernel),
    }
}
