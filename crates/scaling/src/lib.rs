//! Laws of scaling: conclusions from a model of another size.
//!
//! A quantity P of the full size is P_s = lambda^w P of the scaled one (paper 002, eq. 19), and its unit alone gives the
//! exponent: w = 3 kg + m + s ([`ScalingLaw`], docs/scaling.md). [Tables](table), [systems](system), [cases](case) and
//! [recordings](recording) are scaled by it; units are those of the FMUs, or are next to the numbers.

pub mod case;
mod error;
mod law;
pub mod recording;
pub mod system;
pub mod table;
mod toml;

pub use error::ScalingError;
pub use law::{AffineScale, GivenExponent, Lawless, ScalingLaw, UnitDimension};
