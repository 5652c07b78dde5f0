//! The same engine about the trajectory of a nonlinear plant.
//!
//! ```text
//! z = (dx, d, e)     dx: deviation of coordinates and rates from the smoothed trajectory x^
//!                    d: latent force on each coordinate; e: latent error of each reading (Ornstein-Uhlenbeck both)
//! dx+ = A_t dx + B_t (d + sum a_k g_k) + c_t + noise      c_t: what the model does from x^_t, less x^_(t+1)
//! y   = h(x^) + H_t dx + e + sum a_k r_k + noise
//! ```
//!
//! Everything of the plant comes from its model, [`trueup_plant::Plant`], by dual numbers: [`plant`] has accelerations, forces that
//! a motion takes, and outputs with their gradients; [`steps`] A, B and c; [`unknowns`] the forces that a change of a parameter is
//! worth. [`structures`] makes the plant of a case, [`case_frame`] its frame. [`nodes`] takes recordings to nodes; [`frame`] holds the trajectory, and [`fit`] moves it.

pub mod case_frame;
mod doubted;
pub mod estimate;
pub mod fit;
pub mod frame;
pub mod nodes;
pub mod plant;
pub mod readings;
pub mod run;
pub mod steps;
pub mod structures;
pub mod unknowns;
