//! Trees of bodies on a free base in space.

mod affected;
mod claims;
mod control;
mod effects;
mod facts;
mod flexible_golden;
mod flexible_lagrange;
mod flexible_limits;
mod flexible_properties;
mod flyer;
mod golden;
mod machine;
mod properties;
