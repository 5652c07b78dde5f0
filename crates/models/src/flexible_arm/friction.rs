//! Stick-slip of the arm's motors (ARM-9, in space): what the arm has of it.

use super::model::{FlexibleArm, MAX_STATES};
use crate::friction::{self, Levels};
use crate::space::StickSlip;
use crate::space::tree::Joints;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

impl StickSlip for FlexibleArm {
    fn joints(&self) -> usize {
        FlexibleArm::joints(self)
    }
    fn rate_row(&self, joint: usize) -> usize {
        self.bodies.rate_row(joint)
    }
    fn both_levels<T: Scalar>(&self, at: &At<T>, joint: usize) -> [Levels<T>; 2] {
        [1.0, -1.0].map(|way| self.levels(at, joint, way))
    }
    fn dry(&self, p: &[f64], joint: usize) -> bool {
        let at = &self.parameter;
        p[at.coulomb_friction + joint] > 0.0 || p[at.static_friction + joint] > 0.0
    }
    fn overstep(&self, at: &At<f64>, joint: usize) -> f64 {
        let level = self.levels(at, joint, 1.0).breakaway;
        let inertia = at.p[self.body_parameter.motor_inertia + joint];
        let torque = self.bodies.transmission_torque(at, joint);
        friction::overstep(level + torque.abs(), inertia)
    }
    fn balanced<T: Scalar>(&self, at: &At<T>) -> Joints<T> {
        let mut dx = [T::zero(); MAX_STATES];
        self.rates_and_held(at, &mut dx[..at.x.len()]).into_iter().collect()
    }
    fn jump(&self, at: At<f64>, drives: &[(usize, f64)], jump: &mut [f64]) {
        self.bodies.impulse(at, drives, jump);
    }
}
