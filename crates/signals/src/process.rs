//! Signal processing on evenly sampled values, as SciPy does it: filters, derivatives, spectra, whiteness, metrics.
//!
//! Why own filters: no kept crate has zero-phase filtering with SciPy's padding, Savitzky-Golay derivatives to the
//! ends, or Welch's estimates; the transform itself is realfft's. tests/python/test_signals.py compares all with SciPy.

mod butterworth;
mod difference;
mod grid;
mod metric;
mod savitzky_golay;
mod spectrum;
mod whiteness;

pub use butterworth::Butterworth;
pub use difference::gradient;
pub use grid::ChannelGrid;
pub use metric::{Misfit, nrmse, overall, rms};
pub use savitzky_golay::savitzky_golay;
pub use spectrum::{Spectrum, coherence, welch};
pub use whiteness::{LjungBox, autocorrelation, ljung_box};
