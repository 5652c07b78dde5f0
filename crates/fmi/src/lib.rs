//! FMI as data: what a model declares of itself ([`table`]), what is written into a packed library
//! ([`configuration`]), and the types that cross the C boundary ([`abi`]).
//! Loads nothing, writes nothing, depends on nothing.

pub mod abi;
pub mod configuration;
pub mod table;
pub mod units;
