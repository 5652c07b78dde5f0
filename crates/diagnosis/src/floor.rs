//! The noise floor of compared channels and measured inputs, and the gap against it.
//!
//! A gap is meaningless until it is known what noise alone leaves: that of the compared channels ([`output`]) *and* that of
//! the measured inputs ([`input`]), carried through the free-running simulation ([`carried`]).

mod carried;
mod estimate;
mod gap;

pub use carried::carried;
pub(crate) use carried::coloured;
pub(crate) use estimate::correlation;
pub use estimate::{ChannelFloor, ChannelFloorSource, input, output};
pub use gap::{GapShares, Gaps, Pooled, ReplayedChannel, gaps};
