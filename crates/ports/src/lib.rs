//! Ports of an FMU: which of its variables are torques or currents of motors, angles and velocities of motors and links, forces on
//! a base or a tip, and readings of sensors. [`guess`](guess::guess) drafts them, [`Experiment`] moves the FMU and shows what each
//! input does, [`checks`](check::checks) compares both, [`insertions`](insert::insertions) derives which effects can act where,
//! [`plant`](plant::plant) makes the FMU a plant with coordinates and readings.
//!
//! The method: an input and an output are conjugate if their product is a power. The matrix d(dy/dt)/du of conjugate velocities y and
//! efforts u is J M^-1 J', which is symmetric with a positive diagonal, whatever the coordinates and the vendor.

pub mod check;
pub mod conjugate;
mod error;
pub mod experiment;
pub mod fits;
pub mod guess;
pub mod insert;
pub mod keys;
pub mod kind;
pub mod plant;
pub mod quantity;
pub mod read;
pub mod roles;
mod words;
pub mod write;

pub use error::PortsError;
pub use experiment::Experiment;
pub use quantity::FmuQuantities;
pub use roles::FmuPorts;
