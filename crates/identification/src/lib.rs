//! Parameters from recordings, with uncertainty.

pub mod carried;
pub mod covariance;
pub mod estimate;
pub mod fit;
pub mod flexible_joint;
pub mod fmu;
pub mod identify;
pub mod intake;
mod interval;
mod law;
pub mod lsq;
pub mod model;
pub mod nelder_mead;
pub mod output_error;
pub mod parallel;
pub mod predict;
pub mod predictor;
pub mod quasi_static;
pub mod recorded;
pub mod regress;
pub mod run;
mod scatter;
pub mod sensors;
pub mod sizes;
pub mod subject;
pub mod tangent;
pub mod unknown;
