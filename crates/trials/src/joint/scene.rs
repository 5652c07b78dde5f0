//! The runs of a case, and the nominal model of the drive.

use super::bench::{Done, record};
use super::drive::Drive;
use super::law::Effect;
use super::plant::Joint;
use super::values::Values;
use crate::draw::Draw;
use crate::motion::Motion;

/// The runs of a case and what they are measured with.
pub(super) struct Scene {
    pub(super) drive: Drive,
    pub(super) motions: Vec<Motion>,
    pub(super) times: Vec<Vec<f64>>,
    /// For the controller's encoder noise.
    pub(super) seeds: u64,
    pub(super) span: f64,
    /// The drive has no spring.
    pub(super) rigid: bool,
    /// What is declared known.
    pub(super) known: Vec<Effect>,
}

impl Scene {
    pub(super) fn run(&self, values: Values, effects: &[Effect], which: &[usize]) -> Vec<Done> {
        let one = |i: &usize| {
            let mut d = Draw::new("encoders", self.seeds, *i, 0);
            let there = self.known.iter().chain(effects).map(|e| e.in_run(*i)).collect();
            let joint = Joint::new(values, self.rigid, there, self.span);
            record(joint, &self.drive, &self.motions[*i], &self.times[*i], &mut d)
        };
        which.iter().map(one).collect()
    }
}

/// What the nominal model has.
pub(super) struct Believed {
    pub(super) values: Values,
    pub(super) rigid: bool,
    pub(super) frictionless: bool,
}

/// The nominal values with their standard deviations, by name.
pub(super) struct Nominal {
    pub(super) values: [f64; 8],
    pub(super) doubts: Vec<(usize, f64)>,
}
