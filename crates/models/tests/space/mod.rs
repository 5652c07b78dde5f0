//! Trees of bodies on a free base in space.

mod facts;
mod flyer;
mod golden;
mod properties;
