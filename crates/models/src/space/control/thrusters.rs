//! Thrusters of the base: how much each of them gives of a torque, and when they are on (CTS-10, CTS-11).

use super::super::MAX_THRUSTERS;
use super::super::vector::{Vector3, cross};
use trueup_numerics::Scalar;
use trueup_numerics::linear::{ldl_factor, ldl_solve};

/// Weights of the thrusters' own forces against the error of the wrench, 1/m2 and 1, one after the other: of equal wrenches the smaller
/// forces. Each is solved from the solution for the one before.
const ECONOMY: [f64; 7] = [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
/// Newton steps for a weight at most.
const STEPS: usize = 20;
/// Halvings of a step at most.
const HALVINGS: usize = 30;
/// Of free fall, m/s2: what a specific impulse in s is counted by.
pub(super) const STANDARD_GRAVITY: f64 = 9.806_65;

/// Thrusters as the controller has them, base axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct ControlledThruster<T> {
    /// From the base's centre of mass, m.
    pub(super) position: Vector3<T>,
    /// Unit vector of the force on the base.
    pub(super) direction: Vector3<T>,
    /// While it is on, N.
    pub(super) force: T,
}

impl<T: Scalar> ControlledThruster<T> {
    /// Torque and force per its force.
    fn wrench(&self) -> [T; 6] {
        let ([a, b, c], [d, e, f]) = (cross(self.position, self.direction), self.direction);
        [a, b, c, d, e, f]
    }

    /// Its force by z (CTS-10).
    fn by(&self, z: &[T; 6]) -> T {
        let along = self.wrench().iter().zip(z).fold(T::zero(), |sum, (w, z)| sum + *w * *z);
        along.max(T::zero()).min(self.force)
    }
}

/// Forces of the thrusters, 0 to that of each, whose torque is nearest to `torque` with no force on the whole (CTS-10), and the torque
/// that they give.
///
/// By z, the wrench that they leave missing over the weight: each force is the component of z along its thruster, within the limits, so
/// that six unknowns are left, whose equation is the gradient of a convex function; Newton's steps, halved until that falls.
pub(super) fn allocated<T: Scalar>(
    thrusters: &[ControlledThruster<T>],
    torque: Vector3<T>,
) -> ([T; MAX_THRUSTERS], Vector3<T>) {
    let [a, b, c] = torque;
    let wanted = [a, b, c, T::zero(), T::zero(), T::zero()];
    let mut z = [T::zero(); 6];
    for weight in ECONOMY {
        let mut here = slope(thrusters, weight, &wanted, &z);
        for _ in 0..STEPS {
            let mut matrix = [T::zero(); 36];
            (0..6).for_each(|i| matrix[7 * i] = T::one() * weight);
            for t in thrusters {
                let (wrench, force) = (t.wrench(), t.by(&z));
                if force.value() > 0.0 && force.value() < t.force.value() {
                    for i in 0..6 {
                        (0..6).for_each(|j| matrix[6 * i + j] += wrench[i] * wrench[j]);
                    }
                }
            }
            let mut step = here.1;
            if ldl_factor(&mut matrix, 6).is_err() {
                break;
            }
            ldl_solve(&matrix, 6, &mut step);
            let mut shares = (0..HALVINGS).map(|k| 0.5_f64.powi(k as i32));
            let better = shares.find_map(|share| {
                let next = core::array::from_fn(|i| z[i] - step[i] * share);
                let there = slope(thrusters, weight, &wanted, &next);
                (there.0.value() < here.0.value()).then_some((next, there))
            });
            let Some(better) = better else { break };
            (z, here) = better;
        }
    }
    let mut forces = [T::zero(); MAX_THRUSTERS];
    let mut given = [T::zero(); 3];
    for (f, t) in forces.iter_mut().zip(thrusters) {
        *f = t.by(&z); // (CTS-10)
        let wrench = t.wrench();
        (0..3).for_each(|i| given[i] += *f * wrench[i]);
    }
    (forces, given)
}

/// The convex function and its gradient at `z`.
fn slope<T: Scalar>(
    thrusters: &[ControlledThruster<T>],
    weight: f64,
    wanted: &[T; 6],
    z: &[T; 6],
) -> (T, [T; 6]) {
    let mut value = T::zero();
    let mut gradient: [T; 6] = core::array::from_fn(|i| z[i] * weight - wanted[i]);
    for i in 0..6 {
        value += z[i] * (z[i] * (0.5 * weight) - wanted[i]);
    }
    for t in thrusters {
        let (wrench, force) = (t.wrench(), t.by(z));
        let along = wrench.iter().zip(z).fold(T::zero(), |sum, (w, z)| sum + *w * *z);
        value += force * (along - force * 0.5);
        (0..6).for_each(|i| gradient[i] += force * wrench[i]);
    }
    (value, gradient)
}

/// What a thruster remembers from sample to sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ThrusterMemory {
    /// Impulse that is due, N.s.
    pub(super) owed: f64,
    /// Samples for which it stays on.
    pub(super) left: f64,
}

/// Whether a thruster is on for the sample that begins, which lasts `period` s (CTS-11): it waits until what it owes is its smallest
/// impulse, and then stays on for that.
pub(super) fn fires(
    memory: ThrusterMemory,
    wanted: f64,
    (force, least, period): (f64, f64, f64),
) -> (bool, ThrusterMemory) {
    let one = force * period;
    let owed = memory.owed + wanted * period;
    let begins = owed >= least.max(one);
    let left = if memory.left > 0.0 {
        memory.left - 1.0
    } else if begins {
        (least / one).ceil().max(1.0) - 1.0
    } else {
        return (false, ThrusterMemory { owed, left: 0.0 });
    };
    (true, ThrusterMemory { owed: owed - one, left }) // (CTS-11)
}

#[cfg(test)]
mod tests {
    use super::super::super::attitude::unit;
    use super::super::super::vector::{add, dot, scale, sub};
    use super::*;

    /// Torque and force that thrusters give.
    fn wrench(thrusters: &[ControlledThruster<f64>], forces: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        let mut sum = ([0.0; 3], [0.0; 3]);
        for (t, f) in thrusters.iter().zip(forces) {
            sum.0 = add(sum.0, scale(*f, cross(t.position, t.direction)));
            sum.1 = add(sum.1, scale(*f, t.direction));
        }
        sum
    }

    /// Checks CTS-10: forces stay within 0 and that of the thruster, what they give is what is reported of them, and none could be
    /// changed for the better.
    #[test]
    fn thrusters_give_the_torque_that_they_can() {
        let mut seed = 70_u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let mut worst: f64 = 0.0;
        for trial in 0..200 {
            let count = 8 + trial % 9;
            let mut three = || [draw(), draw(), draw()];
            let thrusters: Vec<_> = (0..count)
                .map(|_| ControlledThruster { position: three(), direction: unit(three()), force: 10.0 })
                .collect();
            let torque = scale(if trial % 4 == 0 { 40.0 } else { 4.0 }, three());
            let (forces, given) = allocated(&thrusters, torque);
            let (turns, pushes) = wrench(&thrusters, &forces);
            let apart = sub(turns, given);
            assert!(dot(apart, apart) < 1e-20, "{trial}: {turns:?} {given:?}");
            let missing = sub(torque, turns);
            for (t, f) in thrusters.iter().zip(&forces) {
                assert!((0.0..=10.0).contains(f), "{trial}: {f}");
                // What is missing along it: 0, or it is at a limit.
                let gain = dot(cross(t.position, t.direction), missing) - dot(t.direction, pushes) - 1e-6 * f;
                let wrong = if *f == 0.0 {
                    gain.max(0.0)
                } else if *f == 10.0 {
                    (-gain).max(0.0)
                } else {
                    gain.abs()
                };
                worst = worst.max(wrong);
            }
        }
        println!("{worst:.1e} N.m");
        // Values of the function decide, and resolve its gradient to the root of their rounding.
        assert!(worst < 1e-6, "{worst}");
    }

    /// Checks CTS-11: what is due is given in the mean, no pulse is shorter than the smallest impulse.
    #[test]
    fn pulses_give_what_is_wanted_in_the_mean() {
        for (wanted, least) in [(0.3, 0.5), (4.0, 0.5), (9.9, 0.1), (0.01, 2.0)] {
            let (mut memory, mut given, mut length) = (ThrusterMemory { owed: 0.0, left: 0.0 }, 0.0, 0.0);
            for _ in 0..100_000 {
                let (on, next) = fires(memory, wanted, (10.0, least, 0.01));
                memory = next;
                if on {
                    given += 10.0 * 0.01;
                    length += 10.0 * 0.01;
                } else {
                    assert!(length == 0.0 || length > least - 1e-9, "{wanted} {least}: {length}");
                    length = 0.0;
                }
            }
            assert!((given - wanted * 1000.0).abs() <= least.max(0.1) * 1.001, "{wanted} {least}: {given}");
        }
    }
}
