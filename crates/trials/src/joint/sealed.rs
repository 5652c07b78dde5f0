//! A joint that is sealed, but runs what is proposed.

use super::bench::{JointRecord, RUN_IN, converted};
use super::law::JointLawEffect;
use super::plant::TrialJoint;
use super::run::JointRun;
use super::scene::JointScene;
use super::values::JointValues;
use super::write::recorded;
use crate::case::TrialRecording;
use crate::draw::SeededDraw;
use crate::sense;

/// Step of the truth, s.
const FINE: f64 = 1e-4;
/// Half of what a time stamp shows, s: what is written as the same time is the same.
const HALF_STAMP: f64 = 5e-6;

/// The rig of a case.
pub(crate) struct SealedJoint {
    pub(super) scene: JointScene,
    pub(super) effects: Vec<JointLawEffect>,
    pub(super) truth: JointValues,
    pub(super) current_noise: f64,
}

impl SealedJoint {
    /// Records `currents` (A, each held from its time on, s), from rest at load angle `begin` in rad. Where the load leaves `within`,
    /// in rad, the drive is switched off and the recording ends: `true`.
    pub(crate) fn run(
        &self,
        name: String,
        (time, currents): (&[f64], &[f64]),
        begin: f64,
        within: [f64; 2],
        (most, seed, round): (f64, u64, usize),
    ) -> (TrialRecording, bool) {
        let drive = &self.scene.drive;
        let mut d = SeededDraw::new("lab", seed, round, 0);
        let span = time.last().copied().unwrap_or(0.0);
        let samples = (span * drive.rate).floor() as usize + 1;
        let instants = sense::instants(drive.rate, samples, drive.jitter, &mut d);
        let there = self.effects.iter().map(|e| e.in_run(self.scene.motions.len() + round)).collect();
        let joint = TrialJoint::new(self.truth, self.scene.rigid, there, self.scene.span);
        let mut state = [0.0; 12];
        (state[0], state[2]) = (self.truth.gear_ratio * begin, begin);
        // The drive is off before an experiment.
        let mut run = JointRun::new(joint, -RUN_IN, state, FINE);
        run.hold(instants[0], 0.0);
        let (start, mut current, mut kept) = (run.state, 0.0, Vec::new());
        let mut tripped = false;
        for t in &instants {
            run.hold(*t, current);
            if !(within[0]..=within[1]).contains(&run.state[2]) {
                tripped = true;
                break;
            }
            let at = time.partition_point(|begin| *begin <= t + HALF_STAMP).saturating_sub(1);
            current = converted(currents[at], most);
            kept.push(current);
        }
        let time = instants[..kept.len()].to_vec();
        let record = JointRecord { time, current: kept, track: run.track, start };
        (recorded(&self.scene, &self.effects, self.current_noise, name, &record, &mut d), tripped)
    }
}
