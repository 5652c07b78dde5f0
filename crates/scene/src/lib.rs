//! Moving pictures of plants: the recorded outputs of a run in, bodies as simple shapes with their poses over time out.
//!
//! Poses come from the models' own kinematics; nothing is integrated and nothing is drawn here. A page draws a [`Scene`].
//!
//! ```
//! use trueup_models::joint::TwoMassJoint;
//! use trueup_scene::{MotionRecord, joint_scene};
//!
//! let time = [0.0, 0.5, 1.0];
//! let (motor, load) = ([0.0, 1.0, 2.0], [0.0, 0.009, 0.02]);
//! let column = |name: &str| match name {
//!     "motorAngle" => Some(&motor[..]),
//!     "loadAngle" => Some(&load[..]),
//!     _ => None,
//! };
//! let record = MotionRecord::new(&time, &column);
//! let scene = joint_scene(100.0, &record).map_err(|missing| missing.to_string())?;
//! assert!(scene.planar);
//! assert_eq!(scene.time, [0.0, 0.5, 1.0]);
//! # Ok::<(), String>(())
//! ```

mod capture;
mod joint;
mod planar;
mod record;
mod scene;
mod space_capture;
mod spatial;

pub use capture::{HAND, arm_capture_scene, body_scene, capture_scene, hand_reach};
pub use joint::{exaggeration, joint_as_is, joint_scene};
pub use planar::planar_scene;
pub use record::{MissingColumn, MotionRecord};
pub use scene::{PartLook, Scene, ScenePart, ScenePose, SceneShape, SceneWindow};
pub use space_capture::space_capture_scene;
pub use spatial::robot_scene;
