//! Numbers and solvers that know no physics.
//!
//! * [`Scalar`]: what a kernel is written over, so that one formula serves `f64` and [`Dual`].
//! * [`hybrid`]: the form that every model takes here: rates, outputs, event indicators, updates.

pub mod dual;
pub mod hybrid;
pub mod scalar;

pub use dual::Dual;
pub use scalar::Scalar;
