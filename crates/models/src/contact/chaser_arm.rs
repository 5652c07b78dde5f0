//! The planar manipulator as a chaser: its hand is its tip, with the axes of its last link.

use super::chaser::Chaser;
use super::frame::{ContactWrench, PointFrame};
use super::presets::{Capture, SIM2};
use crate::arm::{PlanarManipulator, input, output, parameter};
use trueup_numerics::Scalar;

/// Of the bench against the real thing (S2 Table 7: SIM3).
const BENCH: f64 = 0.3;

impl Chaser for PlanarManipulator {
    fn capture(&self) -> Capture {
        SIM2.scaled(BENCH)
    }
    fn approaching(&self) -> Vec<f64> {
        let mut p = self.defaults();
        p[parameter::initial_base_velocity(self.links())] = self.capture().speed;
        p
    }
    fn fits(&self, p: &[f64]) -> Result<(), (usize, String)> {
        self.check(p)
    }
    fn hand<T: Scalar>(&self, x: &[T], p: &[T]) -> PointFrame<T> {
        let (tip, rate) = self.tip(x, p);
        PointFrame::new(tip.position, tip.attitude, tip.velocity, rate)
    }
    fn push<T: Scalar>(&self, _x: &[T], _p: &[T], wrench: &ContactWrench<T>, u: &mut [T]) {
        let n = self.links();
        for i in 0..2 {
            u[input::tip_force(n) + i] += wrench.force[i];
        }
        u[input::tip_torque(n)] += wrench.torque;
    }
    fn momenta(&self) -> [usize; 3] {
        let n = self.links();
        [output::linear_momentum(n), output::angular_momentum(n), output::kinetic_energy(n)]
    }
}
