//! Rigid bodies in a row on revolute joints, the first one on ground that does not move, with a rotor per joint.
//!
//! All in the ground's axes about its origin: velocities and accelerations outward (Newton and Euler), what they take
//! inward; the mass matrix by composite bodies. A rotor turns about the axis of its joint on the body that carries the
//! joint: energy I (sigma k . omega + rate)^2 / 2 with sigma = 1 / gear ratio.

use super::space::{Arrow, LEVEL, Turning, about, after, apply, cross, dot, minus, plus, seen, times};

pub(crate) const JOINTS: usize = 6;

/// A body and the joint that it hangs on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ChainBody {
    /// kg.
    pub(crate) mass: f64,
    /// From its joint, own axes, m.
    pub(crate) center: Arrow,
    /// About its centre of mass, own axes, kg.m2.
    pub(crate) inertia: Turning,
    /// Of its joint in the axes of its carrier, m.
    pub(crate) position: Arrow,
    /// Own axes at angle 0 to those of its carrier, quaternion w, x, y, z.
    pub(crate) orientation: [f64; 4],
    /// The same as a matrix.
    pub(crate) turned: Turning,
    /// Of its joint, own axes, length 1.
    pub(crate) axis: Arrow,
}

/// The bodies and what pulls at them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SerialChain {
    pub(crate) bodies: [ChainBody; JOINTS],
    /// m/s2.
    pub(crate) gravity: Arrow,
    /// Inertia of each rotor, joint side of its gear, kg.m2.
    pub(crate) rotor: [f64; JOINTS],
    pub(crate) gear_ratio: [f64; JOINTS],
}

/// Where the bodies are and how they move when no joint accelerates.
pub(super) struct ChainMotion {
    turned: [Turning; JOINTS],
    /// From each joint to the centre of mass of its body, and the body's inertia about it.
    arm: [Arrow; JOINTS],
    inertia: [Turning; JOINTS],
    /// Of each joint: its place and its axis.
    at: [Arrow; JOINTS],
    axis: [Arrow; JOINTS],
    spin: [Arrow; JOINTS],
    spin_rate: [Arrow; JOINTS],
    /// Of the joint's place.
    acceleration: [Arrow; JOINTS],
}

impl SerialChain {
    pub(super) fn motion(&self, q: &[f64], rate: &[f64]) -> ChainMotion {
        let mut m = ChainMotion {
            turned: [LEVEL; JOINTS],
            arm: [[0.0; 3]; JOINTS],
            inertia: [LEVEL; JOINTS],
            at: [[0.0; 3]; JOINTS],
            axis: [[0.0; 3]; JOINTS],
            spin: [[0.0; 3]; JOINTS],
            spin_rate: [[0.0; 3]; JOINTS],
            acceleration: [[0.0; 3]; JOINTS],
        };
        let (mut turned, mut at) = (LEVEL, [0.0; 3]);
        let (mut spin, mut spin_rate, mut acceleration) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for (j, b) in self.bodies.iter().enumerate() {
            let arm = apply(&turned, b.position);
            at = plus(at, arm);
            let turns = cross(spin, cross(spin, arm));
            acceleration = plus(acceleration, plus(cross(spin_rate, arm), turns));
            turned = after(&turned, &b.turned);
            let axis = apply(&turned, b.axis);
            turned = after(&turned, &about(b.axis, q[j]));
            spin_rate = plus(spin_rate, times(rate[j], cross(spin, axis)));
            spin = plus(spin, times(rate[j], axis));
            (m.arm[j], m.inertia[j]) = (apply(&turned, b.center), seen(&turned, &b.inertia));
            (m.turned[j], m.at[j], m.axis[j]) = (turned, at, axis);
            (m.spin[j], m.spin_rate[j], m.acceleration[j]) = (spin, spin_rate, acceleration);
        }
        m
    }

    /// Mass matrix of the bodies, on and above its diagonal.
    pub(super) fn mass_matrix(&self, m: &ChainMotion) -> [[f64; JOINTS]; JOINTS] {
        let mut all = [[0.0; JOINTS]; JOINTS];
        let (mut mass, mut first, mut second) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        for j in (0..JOINTS).rev() {
            let b = &self.bodies[j];
            let (c, own) = (plus(m.at[j], m.arm[j]), &m.inertia[j]);
            mass += b.mass;
            first = plus(first, times(b.mass, c));
            let square = dot(c, c);
            for i in 0..3 {
                for k in 0..3 {
                    let apart = if i == k { square } else { 0.0 } - c[i] * c[k];
                    second[i][k] += own[i][k] + b.mass * apart;
                }
            }
            // All that joint j carries turns about it at 1 rad/s.
            let (axis, drift) = (m.axis[j], cross(m.at[j], m.axis[j]));
            let momentum = plus(cross(axis, first), times(mass, drift));
            let angular = plus(apply(&second, axis), cross(first, drift));
            for i in 0..=j {
                all[i][j] = dot(m.axis[i], minus(angular, cross(m.at[i], momentum)));
            }
        }
        all
    }

    /// Torques on the joints that keep them from accelerating, with a force at a place and a torque on the last body.
    pub(super) fn bias(
        &self,
        m: &ChainMotion,
        (force, place, torque): (Arrow, Arrow, Arrow),
    ) -> [f64; JOINTS] {
        let mut all = [0.0; JOINTS];
        let mut pull = times(-1.0, force);
        let mut turn = times(-1.0, plus(torque, cross(place, force)));
        for j in (0..JOINTS).rev() {
            let b = &self.bodies[j];
            let (arm, own) = (m.arm[j], &m.inertia[j]);
            let (spin, rate) = (m.spin[j], m.spin_rate[j]);
            let a = plus(m.acceleration[j], plus(cross(rate, arm), cross(spin, cross(spin, arm))));
            let f = times(b.mass, minus(a, self.gravity));
            let n = plus(apply(own, rate), cross(spin, apply(own, spin)));
            pull = plus(pull, f);
            turn = plus(turn, plus(n, cross(plus(m.at[j], arm), f)));
            all[j] = dot(m.axis[j], minus(turn, cross(m.at[j], pull)));
        }
        all
    }

    /// Torques that hold the joints at rest at `q`.
    pub(super) fn weight(&self, q: &[f64]) -> [f64; JOINTS] {
        self.bias(&self.motion(q, &[0.0; JOINTS]), ([0.0; 3], [0.0; 3], [0.0; 3]))
    }
}

impl ChainMotion {
    /// A point of the last body.
    pub(super) fn place(&self, own: Arrow) -> Arrow {
        plus(self.at[JOINTS - 1], apply(&self.turned[JOINTS - 1], own))
    }
    /// How much rotor `j` turns with each joint before its own, by sigma.
    pub(super) fn share(&self, j: usize, sigma: f64) -> [f64; JOINTS] {
        let mut row = [0.0; JOINTS];
        for (k, r) in row.iter_mut().enumerate().take(j) {
            *r = sigma * dot(self.axis[k], self.axis[j]);
        }
        row
    }
    /// Torques on the joints, and on the motor, that rotor `j` takes when nothing accelerates; `rate`: its own.
    pub(super) fn rotor_bias(&self, j: usize, sigma: f64, inertia: f64, rate: f64) -> ([f64; JOINTS], f64) {
        let mut row = [0.0; JOINTS];
        if j == 0 {
            return (row, 0.0);
        }
        let (axis, spin) = (self.axis[j], self.spin[j - 1]);
        let own = inertia * sigma * dot(axis, self.spin_rate[j - 1]);
        let angular = inertia * (sigma * dot(axis, spin) + rate);
        let turn = times(sigma, plus(times(own, axis), times(angular, cross(spin, axis))));
        for (k, r) in row.iter_mut().enumerate().take(j) {
            *r = dot(self.axis[k], turn);
        }
        (row, own)
    }
}
