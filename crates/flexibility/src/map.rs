//! What bends of an arm at a pose, and over the angles of two of its joints.

use super::droop::droop;
use super::elements::{Contribution, contributions};
use super::equilibrium::{EquilibriumError, equilibrium, modes, weight};
use super::ground::Standing;

/// An arm at rest at a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct RestPose {
    /// Angles of the motors, joint side, rad (m of prismatic joints).
    pub motors: Vec<f64>,
    /// Frequencies with the motors held, Hz, ascending.
    pub modes: Vec<f64>,
    /// The first tip against where it would be unbent, m, inertial axes; `None` without a tip.
    pub tip_deflection: Option<[f64; 3]>,
    /// See [`droop`]: `VWBC` runs away above K_p over this.
    pub droop: f64,
    /// Joints with a spring, then links.
    pub elements: Vec<Contribution>,
}

/// Why an arm has no rest at the angles of a grid.
pub type UnstablePose = ([f64; 2], EquilibriumError);

/// Poses over the angles of two joints.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseGrid {
    /// Which joints, from 0.
    pub joints: [usize; 2],
    /// Their angles, ascending.
    pub at: [Vec<f64>; 2],
}

impl RestPose {
    /// The arm at rest with its motors at these angles.
    ///
    /// # Errors
    /// Those of [`equilibrium`] and of [`contributions`].
    pub fn of(on: &Standing, motors: &[f64]) -> Result<Self, EquilibriumError> {
        let (arm, p) = (&on.arm, &on.parameters);
        let rest = equilibrium(arm, p, motors, [0.0; 3])?;
        let (frequencies, _) = modes(&rest.mass, &rest.stiffness)?;
        Ok(Self {
            motors: motors.to_vec(),
            modes: frequencies.iter().map(|f| f / std::f64::consts::TAU).collect(),
            tip_deflection: rest.tip_deflection(arm, p),
            droop: if rest.joints.is_empty() { 0.0 } else { droop(&rest)? },
            elements: contributions(arm, p, &rest, [0.0; 3])?,
        })
    }

    /// How far the tip is displaced, m; not a number without a tip.
    pub fn tip(&self) -> f64 {
        self.tip_deflection.map_or(f64::NAN, |d| d.iter().map(|x| x * x).sum::<f64>().sqrt())
    }
}

impl PoseGrid {
    /// From `from` to `to` in so many steps, of both joints.
    pub fn even(joints: [usize; 2], from: [f64; 2], to: [f64; 2], steps: [usize; 2]) -> Self {
        let along = |k: usize| {
            let share = |i: usize| i as f64 / steps[k].max(1) as f64;
            (0..=steps[k]).map(|i| from[k] + (to[k] - from[k]) * share(i)).collect()
        };
        Self { joints, at: [along(0), along(1)] }
    }

    /// How many poses there are.
    pub fn count(&self) -> usize {
        self.at[0].len() * self.at[1].len()
    }

    /// All poses at which the arm rests, the second joint changing fastest and all other joints as in `motors`, and those at which
    /// it does not. `tell` hears how many are done.
    ///
    /// # Errors
    /// An arm that bends nowhere, angles that are not one a joint.
    pub fn poses(
        &self,
        on: &Standing,
        motors: &[f64],
        mut tell: impl FnMut(usize),
    ) -> Result<(Vec<RestPose>, Vec<UnstablePose>), EquilibriumError> {
        let (mut poses, mut fallen) = (Vec::with_capacity(self.count()), Vec::new());
        let mut motors = motors.to_vec();
        for a in &self.at[0] {
            for b in &self.at[1] {
                for (joint, angle) in self.joints.iter().zip([*a, *b]) {
                    if let Some(to) = motors.get_mut(*joint) {
                        *to = angle;
                    }
                }
                match RestPose::of(on, &motors) {
                    Ok(pose) => poses.push(pose),
                    Err(e @ (EquilibriumError::Angles { .. } | EquilibriumError::Rigid)) => return Err(e),
                    Err(e) => fallen.push(([*a, *b], e)),
                }
                tell(poses.len() + fallen.len());
            }
        }
        Ok((poses, fallen))
    }
}

/// Joints (from 0) whose angles change what the weight does to joints and links, the others being as in `motors`.
///
/// # Errors
/// Those of [`weight`].
pub fn weighed(on: &Standing, motors: &[f64]) -> Result<Vec<usize>, EquilibriumError> {
    // Angles at which a moment that goes with the sine or the cosine of any shifted angle is not the same again.
    const TURNS: [f64; 2] = [0.7, 1.9];
    let (arm, p) = (&on.arm, &on.parameters);
    let before = weight(arm, p, motors)?;
    let mut found = Vec::new();
    for joint in 0..motors.len() {
        let mut changes = false;
        for turn in TURNS {
            let mut other = motors.to_vec();
            other[joint] += turn;
            let after = weight(arm, p, &other)?;
            let size = before.iter().chain(&after).fold(0.0_f64, |m, f| m.max(f.abs()));
            let change = before.iter().zip(&after).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            changes |= change > 1e-9 * size;
        }
        if changes {
            found.push(joint);
        }
    }
    Ok(found)
}
