//! The runs of a case, and the nominal model of the drive.

use super::bench::{JointRecord, record};
use super::drive::TrialDrive;
use super::law::JointLawEffect;
use super::plant::TrialJoint;
use super::values::JointValues;
use crate::draw::SeededDraw;
use crate::motion::ReferenceMotion;

/// The runs of a case and what they are measured with.
pub(super) struct JointScene {
    pub(super) drive: TrialDrive,
    pub(super) motions: Vec<ReferenceMotion>,
    pub(super) times: Vec<Vec<f64>>,
    /// For the controller's encoder noise.
    pub(super) seeds: u64,
    pub(super) span: f64,
    /// The drive has no spring.
    pub(super) rigid: bool,
    /// What is declared known.
    pub(super) known: Vec<JointLawEffect>,
}

impl JointScene {
    pub(super) fn run(
        &self,
        values: JointValues,
        effects: &[JointLawEffect],
        which: &[usize],
    ) -> Vec<JointRecord> {
        let one = |i: &usize| {
            let mut d = SeededDraw::new("encoders", self.seeds, *i, 0);
            let there = self.known.iter().chain(effects).map(|e| e.in_run(*i)).collect();
            let joint = TrialJoint::new(values, self.rigid, there, self.span);
            record(joint, &self.drive, &self.motions[*i], &self.times[*i], &mut d)
        };
        which.iter().map(one).collect()
    }
}

/// What the nominal model has.
pub(super) struct BelievedJoint {
    pub(super) values: JointValues,
    pub(super) rigid: bool,
    pub(super) frictionless: bool,
}

/// The nominal values with their standard deviations, by name.
pub(super) struct NominalJoint {
    pub(super) values: [f64; 8],
    pub(super) doubts: Vec<(usize, f64)>,
}
