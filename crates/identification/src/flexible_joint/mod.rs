//! The flexible joint of a free-floating arm (S0, sections 3.3 and 4): motor inertia I_m, stiffness k, damping b and the
//! initial offset lambda = q(0) - q_m(0) of its spring, from the joint's angle as the vision system shows it (eq. 21).
//!
//! The other joints follow their encoders. The flexible joint's motor is driven by its torque, or follows its encoder
//! too ([`MotorDrive`]); then I_m acts on the satellite alone and is hardly identifiable.

mod fit;
mod replay;
mod vision;

pub use fit::{JointEstimate, JointFit, JointSearchMethod, NAMES, fit};
pub use replay::{FlexibleJoint, MotorDrive, RunError, TestBedRun};
pub use vision::{VisionReading, sight};
