//! A joint's angle from what the vision system sees (S0 eq. 21, ARM-11).

use trueup_models::arm::kinematics::joint_angle;

/// A joint's angle over time, with the check that eq. 21 offers for nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct VisionReading {
    /// Angle of the joint in rad, sample by sample.
    pub angle: Vec<f64>,
    /// Measured less known distance from the joint to the tip in m: two equations, one unknown.
    pub mismatch: Vec<f64>,
}

impl VisionReading {
    /// Root mean square of the mismatch in m. Far above the vision's noise: lengths, markers or encoders are wrong.
    pub fn mismatch_rms(&self) -> f64 {
        (self.mismatch.iter().map(|m| m * m).sum::<f64>() / self.mismatch.len().max(1) as f64).sqrt()
    }
}

/// Solves eq. 21 for joint `joint` (from 0) at every sample. `p`: parameters of the manipulator; `base`: x_0, y_0 in m,
/// q_0 in rad; `joints`: all joints' angles in rad (that of `joint` is not read); `tip` in m.
pub fn sight(
    p: &[f64],
    joint: usize,
    base: &[[f64; 3]],
    joints: &[Vec<f64>],
    tip: &[[f64; 2]],
) -> VisionReading {
    let mut seen = VisionReading { angle: Vec::new(), mismatch: Vec::new() };
    let mut q = vec![0.0; 3 + joints.len()];
    for (i, (base, tip)) in base.iter().zip(tip).enumerate() {
        q[..3].copy_from_slice(base);
        for (j, angles) in joints.iter().enumerate() {
            q[3 + j] = if j == joint { 0.0 } else { angles[i] };
        }
        let one = joint_angle(p, &q, *tip, joint + 1);
        seen.angle.push(one.angle);
        seen.mismatch.push(one.mismatch);
    }
    seen
}
