//! Numbers and solvers that know no physics.
//!
//! * [`Scalar`]: what a kernel is written over, so that one formula serves `f64` and [`Dual`].
//! * [`hybrid`]: the form that every model takes here: rates, outputs, event indicators, updates.
//! * [`integrate`], [`event`]: one-step methods and event location; [`driver`] joins them into a simulation.
//! * [`linear`]: small dense systems. [`order`]: lists by a figure. [`ShortNumber`]: a number in a message.

pub mod driver;
pub mod dual;
pub mod event;
mod figure;
pub mod hybrid;
pub mod integrate;
pub mod linear;
pub mod order;
pub mod scalar;

pub use driver::Driver;
pub use dual::Dual;
pub use figure::ShortNumber;
pub use scalar::Scalar;
