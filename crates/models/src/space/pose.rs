//! Where the parts of a robot are at one instant, for pictures: the frames that the equations of motion use, nothing else.

use super::instant::RobotInstant;
use super::model::SpatialFreeFlyer;
use super::spatial::SpatialFrame;
use super::tree::PerBody;
use super::vector::{Vector3, add, times};
use trueup_numerics::hybrid::At;

/// Frames of all bodies, inertial axes; element 0 is the base.
#[derive(Clone, Debug)]
pub struct RobotPose {
    /// Own axes of each body, origin in its joint, m; of the base in its centre of mass.
    pub bodies: PerBody<SpatialFrame<f64>>,
    /// Axes of what each body carries: they move with the end of its link where that bends, else they are the body's own.
    pub ends: PerBody<SpatialFrame<f64>>,
}

impl SpatialFreeFlyer {
    /// Where all bodies are (SFF-2, LNK-2) by these parameters and states.
    pub fn pose(&self, p: &[f64], x: &[f64]) -> RobotPose {
        let mut now = RobotInstant::new();
        now.place(self, &without_inputs(p, x));
        let bodies = now.frames(self);
        let ends = bodies.iter().enumerate().map(|(k, frame)| now.carried(k, frame)).collect();
        RobotPose { bodies, ends }
    }

    /// A point of the axis of appendage `k` (from 0; one that is a beam) at the share `z` (0 .. 1) of its length, inertial axes,
    /// m (SFF-5).
    pub fn beam_point(&self, p: &[f64], x: &[f64], pose: &RobotPose, k: usize, z: f64) -> Vector3<f64> {
        let shapes = &self.structure().appendages;
        let first = self.state.modal_coordinate + shapes[..k].iter().map(|s| s.modes()).sum::<usize>();
        let own = self.beam(&without_inputs(p, x), k).point(shapes[k], &x[first..][..shapes[k].modes()], z);
        let base = &pose.bodies[0];
        add(base.origin, times(&base.rotation, own))
    }
}

/// These values without inputs, which no place depends on.
fn without_inputs<'a>(p: &'a [f64], x: &'a [f64]) -> At<'a, f64> {
    At { t: 0.0, x, u: &[], p, modes: &[] }
}
