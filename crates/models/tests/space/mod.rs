//! Trees of bodies on a free base in space.

mod facts;
mod golden;
mod properties;
