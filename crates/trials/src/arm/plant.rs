//! A satellite with an arm of three links, floating in the plane (file 000), by Jacobians of every body's centre of
//! mass: M = sum of J' m J, what is left at zero acceleration by recursion.

use super::law::{ArmLaw, ArmLawEffect};
use super::solve::{TrialMatrix, TrialVector, factor, solve};
pub(crate) use super::state::{ArmState, COORDINATES, LINKS};
use crate::slip::Slip;

type PlanarPoint = [f64; 2];

/// Parameters that the case may declare known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ArmValues {
    pub(crate) base_mass: f64,
    pub(crate) base_inertia: f64,
    pub(crate) mount: PlanarPoint,
    pub(crate) mass: [f64; LINKS],
    pub(crate) inertia: [f64; LINKS],
    pub(crate) length: [f64; LINKS],
    pub(crate) center: [PlanarPoint; LINKS],
    pub(crate) motor_inertia: [f64; LINKS],
    pub(crate) gear_ratio: f64,
    pub(crate) stiffness: [f64; LINKS],
    pub(crate) damping: [f64; LINKS],
    /// The base takes the reaction of the whole motor inertia (as printed), else that over the gear ratio.
    pub(crate) paper: bool,
    pub(crate) flexible: [bool; LINKS],
}

/// CBK PAN's test-bed: table 1 and section 3.1 of its paper.
pub(crate) const TEST_BED: ArmValues = ArmValues {
    base_mass: 58.69,
    base_inertia: 2.42,
    mount: [0.337, -0.001],
    mass: [2.81, 2.82, 4.64],
    inertia: [0.0637, 0.0635, 0.0515],
    length: [0.449, 0.449, 0.310],
    center: [[0.1362, -0.0017], [0.1340, -0.0005], [0.1511, 0.0004]],
    motor_inertia: [5.6, 0.0, 0.0],
    gear_ratio: 100.0,
    stiffness: [5.47, 0.0, 0.0],
    damping: [0.5, 0.0, 0.0],
    paper: true,
    flexible: [true, false, false],
};

fn turn((s, c): (f64, f64), a: PlanarPoint) -> PlanarPoint {
    [c * a[0] - s * a[1], s * a[0] + c * a[1]]
}
fn plus(a: PlanarPoint, b: PlanarPoint) -> PlanarPoint {
    [a[0] + b[0], a[1] + b[1]]
}

/// A point of body `body` (0: the satellite): where it is, its Jacobian, its acceleration when no coordinate accelerates.
struct BodyPoint {
    #[cfg_attr(not(test), expect(dead_code, reason = "angular momentum, in the tests"))]
    at: PlanarPoint,
    columns: [PlanarPoint; COORDINATES],
    left: PlanarPoint,
}

/// Where the bodies are and how they turn: sine and cosine of their attitude, its rate, their first joint and its
/// acceleration when no coordinate accelerates.
struct ArmPose {
    turned: [(f64, f64); LINKS + 1],
    spin: [f64; LINKS + 1],
    pivot: [PlanarPoint; LINKS + 1],
    left: [PlanarPoint; LINKS + 1],
}

impl ArmPose {
    /// The point `own` of body `body`.
    fn spot(&self, body: usize, own: PlanarPoint) -> BodyPoint {
        let (arm, spin) = (turn(self.turned[body], own), self.spin[body]);
        let at = plus(self.pivot[body], arm);
        let left = plus(self.left[body], [-spin * spin * arm[0], -spin * spin * arm[1]]);
        let mut columns = [[0.0; 2]; COORDINATES];
        (columns[0], columns[1]) = ([1.0, 0.0], [0.0, 1.0]);
        for k in 0..=body {
            columns[2 + k] = [-(at[1] - self.pivot[k][1]), at[0] - self.pivot[k][0]];
        }
        BodyPoint { at, columns, left }
    }
}

/// The arm with what its simulation lacks.
#[derive(Clone, Debug)]
pub(crate) struct TrialArm {
    pub(crate) values: ArmValues,
    pub(crate) effects: Vec<ArmLawEffect>,
    pub(crate) slips: Vec<Slip>,
    pub(crate) span: f64,
}

impl TrialArm {
    pub(crate) fn new(values: ArmValues, effects: Vec<ArmLawEffect>, span: f64) -> Self {
        let slips = effects.iter().map(|e| Slip::new(e.yields())).collect();
        Self { values, effects, slips, span }
    }

    /// Coordinate of joint `j`'s motor.
    pub(crate) fn motor(&self, j: usize) -> usize {
        if self.values.flexible[j] { 3 + LINKS + j } else { 3 + j }
    }

    /// How many coordinates count: behind them are motors of rigid joints only.
    fn counted(&self) -> usize {
        let last = self.values.flexible.iter().rposition(|spring| *spring);
        3 + LINKS + last.map_or(0, |j| j + 1)
    }

    fn pose(&self, x: &ArmState) -> ArmPose {
        let v = &self.values;
        let rate = |k: usize| x[COORDINATES + 2 + k];
        let (mut angle, mut spin) = (x[2], rate(0));
        let (mut at, mut left) = ([x[0], x[1]], [0.0, 0.0]);
        let mut pose = ArmPose {
            turned: [angle.sin_cos(); LINKS + 1],
            spin: [spin; LINKS + 1],
            pivot: [at; LINKS + 1],
            left: [left; LINKS + 1],
        };
        for k in 1..=LINKS {
            let arm = turn(pose.turned[k - 1], if k == 1 { v.mount } else { [v.length[k - 2], 0.0] });
            at = plus(at, arm);
            left = plus(left, [-spin * spin * arm[0], -spin * spin * arm[1]]);
            angle += x[2 + k];
            spin += rate(k);
            (pose.turned[k], pose.spin[k], pose.pivot[k], pose.left[k]) = (angle.sin_cos(), spin, at, left);
        }
        pose
    }

    fn bodies(&self, t: f64) -> [(f64, f64, PlanarPoint); LINKS + 1] {
        let v = &self.values;
        let mut all = [(v.base_mass, v.base_inertia, [0.0; 2]); LINKS + 1];
        for k in 0..LINKS {
            all[k + 1] = (v.mass[k], v.inertia[k], v.center[k]);
        }
        for e in &self.effects {
            e.payload(t, self.span, &mut all[LINKS]);
        }
        all
    }

    /// Mass matrix (on and below its diagonal) and generalized forces of the motion.
    fn inertia(&self, t: f64, pose: &ArmPose) -> (TrialMatrix, TrialVector) {
        let mut m: TrialMatrix = [[0.0; COORDINATES]; COORDINATES];
        let mut f: TrialVector = [0.0; COORDINATES];
        let field = self.effects.iter().fold([0.0; 2], |a, e| plus(a, e.field()));
        for (body, (mass, inertia, own)) in self.bodies(t).into_iter().enumerate() {
            let s = pose.spot(body, own);
            let last = 2 + body;
            for j in 0..=last {
                let b = s.columns[j];
                f[j] -= mass * (b[0] * (s.left[0] - field[0]) + b[1] * (s.left[1] - field[1]));
                for (i, a) in s.columns.iter().enumerate().take(last + 1).skip(j) {
                    m[j][i] += mass * (a[0] * b[0] + a[1] * b[1]);
                    if j >= 2 {
                        m[j][i] += inertia;
                    }
                }
            }
        }
        for j in 0..LINKS {
            let row = self.rotor(j);
            let those = || (2..=2 + j).chain([self.motor(j)]);
            for b in those() {
                for a in those().filter(|a| *a >= b) {
                    m[b][a] += row[a] * row[b] * self.values.motor_inertia[j];
                }
            }
            if !self.values.flexible[j] {
                m[3 + LINKS + j][3 + LINKS + j] = 1.0;
            }
        }
        (m, f)
    }

    /// Rate of a rotor as it counts in the energy: share of its carrier's rate plus its own.
    fn rotor(&self, j: usize) -> TrialVector {
        let mut row = [0.0; COORDINATES];
        let share = if self.values.paper { 1.0 } else { 1.0 / self.values.gear_ratio };
        for k in 0..=j {
            row[2 + k] = share;
        }
        row[self.motor(j)] = 1.0;
        row
    }

    /// Torque of joint `j`'s spring on the link.
    pub(crate) fn spring(&self, t: f64, x: &ArmState, j: usize) -> f64 {
        let v = &self.values;
        let (q, m) = (3 + j, self.motor(j));
        let (mut eps, mut rate) = (x[m] - x[q], x[COORDINATES + m] - x[COORDINATES + q]);
        for e in self.effects.iter().filter(|e| e.joint == j) {
            let (error, slope) = e.gear_error(x[m]);
            eps -= error;
            rate -= slope * x[COORDINATES + m];
        }
        let k = self.effects.iter().fold(v.stiffness[j], |k, e| k * e.stiffness_factor(j, t, self.span));
        let mut torque = k * eps + v.damping[j] * rate;
        for (e, s) in self.effects.iter().zip(&self.slips).filter(|(e, _)| e.joint == j) {
            torque = e.spring(v.stiffness[j], v.damping[j], eps, rate, torque);
            if matches!(e.law, ArmLaw::Hysteresis { .. }) {
                torque += s.torque(eps);
            }
        }
        torque
    }

    /// Rates under joint torques `past(joint, t)`.
    pub(crate) fn rates(&self, t: f64, x: &ArmState, past: impl Fn(usize, f64) -> f64) -> ArmState {
        let pose = self.pose(x);
        let (mut m, mut f) = self.inertia(t, &pose);
        for j in 0..LINKS {
            let (motor, q) = (self.motor(j), 3 + j);
            let omega = x[COORDINATES + motor];
            let mut torque = 0.0;
            let late: f64 = self.effects.iter().filter(|e| e.joint == j).map(ArmLawEffect::dead_time).sum();
            torque += past(j, t - late);
            for (e, s) in self.effects.iter().zip(&self.slips).filter(|(e, _)| e.joint == j) {
                torque = e.motor(t, x[motor], omega, torque, s);
            }
            f[motor] += torque;
            if self.values.flexible[j] {
                let mut slope = 0.0;
                for e in self.effects.iter().filter(|e| e.joint == j) {
                    slope += e.gear_error(x[motor]).1;
                }
                let spring = self.spring(t, x, j);
                f[motor] -= spring * (1.0 - slope);
                f[q] += spring;
            }
            for (e, s) in self.effects.iter().zip(&self.slips).filter(|(e, _)| e.joint == j) {
                f[q] += e.joint(t, x, s);
            }
        }
        let at = 2 * COORDINATES;
        let mut own = [0.0; 2];
        for (e, s) in self.effects.iter().zip(&self.slips) {
            let (force, moment) = e.base(t, x, s);
            (f[0], f[1], f[2]) = (f[0] + force[0], f[1] + force[1], f[2] + moment);
            let push = e.tip(t);
            if push != [0.0; 2] {
                let tip = pose.spot(LINKS, [self.values.length[LINKS - 1], 0.0]);
                for i in 0..=2 + LINKS {
                    f[i] += tip.columns[i][0] * push[0] + tip.columns[i][1] * push[1];
                }
            }
            if let Some((inertia, w, ratio)) = e.appendage() {
                // A body turning on a spring: J (dd eta + dd q_0) = -spring.
                let spring = inertia * (w * w * x[at] + 2.0 * ratio * w * x[at + 1]);
                f[2] += spring;
                own = [inertia, spring];
            }
        }
        for j in (0..LINKS).filter(|j| !self.values.flexible[*j]) {
            f[3 + LINKS + j] = 0.0;
        }
        // Not positive definite: NaN, and the case is drawn again.
        let n = self.counted();
        if factor(&mut m, n) {
            solve(&m, n, &mut f)
        } else {
            f = [f64::NAN; COORDINATES]
        }
        let mut dx = [0.0; 2 * COORDINATES + 2];
        dx[..COORDINATES].copy_from_slice(&x[COORDINATES..2 * COORDINATES]);
        dx[COORDINATES..2 * COORDINATES].copy_from_slice(&f[..COORDINATES]);
        for j in (0..LINKS).filter(|j| !self.values.flexible[*j]) {
            (dx[3 + LINKS + j], dx[COORDINATES + 3 + LINKS + j]) = (0.0, 0.0);
        }
        if own[0] > 0.0 {
            dx[at] = x[at + 1];
            dx[at + 1] = -own[1] / own[0] - f[2];
        }
        dx
    }

    /// Inertia about motor `j` with everything else free, for a controller.
    pub(crate) fn felt(&self, x: &ArmState, j: usize) -> f64 {
        let (mut m, _) = self.inertia(0.0, &self.pose(x));
        let (i, n) = (self.motor(j), self.counted());
        let mut unit = [0.0; COORDINATES];
        unit[i] = 1.0;
        if factor(&mut m, n) {
            solve(&m, n, &mut unit);
        }
        1.0 / unit[i]
    }

    pub(crate) fn commit(&mut self, x: &ArmState) {
        self.remember(x, Slip::commit);
    }
    pub(crate) fn rest(&mut self, x: &ArmState) {
        self.remember(x, Slip::rest);
    }
    fn remember(&mut self, x: &ArmState, how: impl Fn(&mut Slip, f64)) {
        let motor: [usize; LINKS] = std::array::from_fn(|j| self.motor(j));
        for (e, s) in self.effects.iter().zip(&mut self.slips) {
            how(s, e.place(x, motor[e.joint]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::run::ArmRun;
    use super::*;

    fn momentum(arm: &TrialArm, x: &ArmState) -> ([f64; 3], f64) {
        let (mut p, mut l, mut energy) = ([0.0; 2], 0.0, 0.0);
        let mut spin = 0.0;
        for (body, (mass, inertia, own)) in arm.bodies(0.0).into_iter().enumerate() {
            let s = arm.pose(x).spot(body, own);
            spin += x[COORDINATES + 2 + body];
            let v = (0..COORDINATES).fold([0.0; 2], |v, i| {
                plus(v, [s.columns[i][0] * x[COORDINATES + i], s.columns[i][1] * x[COORDINATES + i]])
            });
            p = plus(p, [mass * v[0], mass * v[1]]);
            l += inertia * spin + mass * (s.at[0] * v[1] - s.at[1] * v[0]);
            energy += 0.5 * (mass * (v[0] * v[0] + v[1] * v[1]) + inertia * spin * spin);
        }
        for j in 0..LINKS {
            let row = arm.rotor(j);
            let rate: f64 = (0..COORDINATES).map(|i| row[i] * x[COORDINATES + i]).sum();
            let share = if arm.values.paper { 1.0 } else { 1.0 / arm.values.gear_ratio };
            l += share * arm.values.motor_inertia[j] * rate;
            energy += 0.5 * arm.values.motor_inertia[j] * rate * rate;
            let eps = x[3 + LINKS + j] - x[3 + j];
            if arm.values.flexible[j] {
                energy += 0.5 * arm.values.stiffness[j] * eps * eps;
            }
        }
        ([p[0], p[1], l], energy)
    }

    #[test]
    fn left_alone_it_keeps_momenta_and_energy() {
        for paper in [true, false] {
            let values = ArmValues { damping: [0.0; 3], paper, ..TEST_BED };
            let mut x = [0.0; 2 * COORDINATES + 2];
            for (i, v) in [0.1, -0.2, 0.3, 0.7, -0.5, 0.4, 0.75].into_iter().enumerate() {
                x[i] = v;
                x[COORDINATES + i] = 0.3 * (i as f64 + 1.0).sin();
            }
            let mut run = ArmRun::new(TrialArm::new(values, Vec::new(), 10.0), 0.0, x, 1e-3);
            let (before, energy) = momentum(&run.arm, &x);
            run.hold(10.0, [0.0; 3]);
            let (after, left) = momentum(&run.arm, &run.state);
            for (a, b) in before.iter().zip(after) {
                assert!((a - b).abs() < 1e-9 * a.abs().max(1.0), "{before:?} {after:?}");
            }
            assert!((energy - left).abs() < 1e-8 * energy, "{energy} {left}");
        }
    }

    #[test]
    fn inertia_of_the_test_bed_about_joint_1_is_the_published_one() {
        // Rigid and without rotor at (7.5, -15, -22.5) degrees, base floating: 1.15438 kg.m2.
        let values = ArmValues { flexible: [false; 3], motor_inertia: [0.0; 3], ..TEST_BED };
        let mut x = [0.0; 2 * COORDINATES + 2];
        for (i, degrees) in [7.5f64, -15.0, -22.5].into_iter().enumerate() {
            x[3 + i] = degrees.to_radians();
        }
        let arm = TrialArm::new(values, Vec::new(), 1.0);
        // All joints but the first locked: strike out their rows.
        let (m, _) = arm.inertia(0.0, &arm.pose(&x));
        let m = nalgebra::SMatrix::<f64, COORDINATES, COORDINATES>::from_fn(|i, j| m[i.min(j)][i.max(j)]);
        let a = m.fixed_view::<3, 3>(0, 0).into_owned();
        let c = nalgebra::Vector3::new(m[(0, 3)], m[(1, 3)], m[(2, 3)]);
        let felt = m[(3, 3)] - (c.transpose() * a.try_inverse().unwrap() * c)[(0, 0)];
        assert!((felt - 1.154_379_945_1).abs() < 1e-9, "{felt}");
        assert!((m[(2, 2)] - 14.179_750_625_265_62).abs() < 1e-9);
    }
}
