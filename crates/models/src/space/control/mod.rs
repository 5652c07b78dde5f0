//! Control of a robot in space: the hands follow velocities, by the generalized Jacobian where the base floats (S2 eq. 12, 13), and
//! joint torques are a feedforward and a feedback (S2 eq. 17). Equations CTS-1 .. in `docs/equations/space-control.md`.

mod inverse;
mod law;
pub mod layout;
mod model;
mod pose;
mod reactionless;
mod thrusters;

pub use layout::BaseControl;
pub use model::SpaceController;
