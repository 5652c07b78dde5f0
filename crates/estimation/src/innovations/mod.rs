//! The gap read from the innovations of a Kalman filter about a smoothed trajectory of the nominal plant.
//!
//! What a model lacks is a generalised force on a coordinate or an error of a reading; what has no name is a latent force on
//! every coordinate (Ornstein-Uhlenbeck, estimated intensities). State of the filter: z = (deviation of the plant's state, latent
//! forces). Whatever is unknown and enters linearly is a [`column::FilterColumn`] along the smoothed trajectory; for given gains the
//! log evidence of every set of columns follows from one Gram matrix ([`gram`], [`evidence`]). The engine requires a
//! [`plant::ForcedPlant`] and names none; [`two_mass`] is the two-mass joint as such a plant, [`foreign`] a joint that is an FMU of others. About the trajectory of a nonlinear plant
//! the same filter, columns and evidence take steps of their own and latent errors of the readings: [`trajectory`].

mod any_size;
mod any_smoother;
pub mod bank;
pub mod column;
pub mod estimate;
pub mod evidence;
pub mod filter;
pub mod filter_data;
pub mod fixed_point;
pub mod foreign;
pub mod frame;
pub mod gram;
pub mod intake;
pub mod intake_channel;
pub mod intensity;
pub mod joint_frame;
pub mod kernel;
mod known_along;
pub mod known_effects;
pub mod lanes;
pub mod linear;
pub mod nuisance;
pub mod null;
pub mod numeric;
pub mod plant;
pub mod recording;
pub mod retimed;
pub mod rig;
pub mod sensed;
pub mod settle;
pub mod signs;
pub mod smoother;
pub mod trajectory;
pub mod two_mass;
pub mod unread;
