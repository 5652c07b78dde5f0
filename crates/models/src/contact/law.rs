//! The law of contact of one pair (S2 eq. 20), by modes.
//!
//! What it gets wrong: a linear spring whatever the shapes (no Hertz), no adhesion, a damper that is there at once, so that the
//! force jumps by eta_n v_n where two balls meet; no memory of what the material took.

use super::frame::{ContactVector, dot};
use super::layout::HUNT_CROSSLEY;
use trueup_numerics::Scalar;

/// The balls do not touch, and approach or rest.
pub const FREE: i32 = 0;
/// They touch and approach.
pub const COMPRESSING: i32 = 1;
/// They touch and part.
pub const RESTITUTING: i32 = 2;
/// They do not touch, and part. That is a mode of its own so that a solver whose step is longer than a contact sees that there
/// was one: where balls have passed through each other the depth has the same sign at both ends of the step, their approach
/// has not.
pub const PARTING: i32 = 3;

/// Whether a pair in this mode touches.
pub const fn touches(mode: i32) -> bool {
    matches!(mode, COMPRESSING | RESTITUTING)
}

/// The state of one pair: a ball of the gripper and what it may touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPair<T, const D: usize = 2> {
    /// From the ball towards the other body, length 1, n.
    pub normal: [T; D],
    /// Depth delta in m, above 0 where they overlap.
    pub penetration: T,
    /// v_n in m/s, above 0 while they approach.
    pub approach: T,
}

/// Two balls: vector from the centre of the gripper's to the centre of the other one, the latter's velocity less the former's,
/// sum of the radii. S2 prints the depth as distance less radii, which repels bodies that are apart. (Concentric balls have no
/// normal: it is NaN.)
pub fn balls<T: Scalar>(apart: ContactVector<T>, velocity: ContactVector<T>, radii: T) -> ContactPair<T> {
    let distance = dot(apart, apart).sqrt();
    let normal = apart.map(|a| a / distance); // (CON-1)
    ContactPair { normal, penetration: radii - distance, approach: -dot(normal, velocity) } // (CON-1)
}

/// A ball and a plate: as [`balls`] with a point of the plate in place of the centre, `outward` being the plate's normal.
pub fn plate<T: Scalar>(
    apart: ContactVector<T>,
    velocity: ContactVector<T>,
    outward: ContactVector<T>,
    radius: T,
) -> ContactPair<T> {
    let normal = outward.map(|a| -a);
    ContactPair { normal, penetration: radius - dot(normal, apart), approach: -dot(normal, velocity) }
}

/// A pair is taken to have turned when it moves the other way by this much, m/s: far below anything that can be measured, above the
/// rounding of a pair at rest. The event comes late by this over the acceleration, 1e-10 s in S2.
pub const TURNED: f64 = 1e-12;

/// The approach that turns a pair in this mode, m/s.
fn turn(mode: i32) -> f64 {
    if matches!(mode, FREE | COMPRESSING) { -TURNED } else { TURNED }
}

/// A pair that has parted and goes on parting touches again only from this depth on, m: above the rounding of places metres
/// away, through which a slow parting would else be a hundred events.
pub const PARTED: f64 = 1e-13;

/// The depth from which on a pair in this mode touches, m.
fn threshold(mode: i32) -> f64 {
    if mode == PARTING { PARTED } else { 0.0 }
}

/// The mode that follows for a pair in this state. Where its depth is 0 it touches if it approaches.
pub fn next_mode<T: Scalar, const D: usize>(mode: i32, pair: &ContactPair<T, D>) -> i32 {
    let (depth, approach) = (pair.penetration.value() - threshold(mode), pair.approach.value());
    if depth.is_nan() {
        FREE
    } else if depth < 0.0 || depth == 0.0 && approach <= 0.0 {
        if approach > turn(mode) { FREE } else { PARTING } // (CON-3)
    } else {
        let turned = if touches(mode) { turn(mode) } else { 0.0 };
        if approach > turned { COMPRESSING } else { RESTITUTING } // (CON-3)
    }
}

/// Event indicators of a pair: its depth, and its approach.
pub fn indicators<T: Scalar, const D: usize>(mode: i32, pair: &ContactPair<T, D>) -> [T; 2] {
    [pair.penetration - threshold(mode), pair.approach - turn(mode)] // (CON-3)
}

/// The law's constants.
#[derive(Clone, Copy, Debug)]
pub struct ContactLaw<T> {
    /// k in N/m.
    pub stiffness: T,
    /// eta_n in N.s/m.
    pub damping: T,
    /// Hunt and Crossley's damping: eta_n at this depth in m and in proportion to the depth, both ways.
    pub reference: Option<T>,
}

impl<T: Scalar> ContactLaw<T> {
    /// By the parameters stiffness, normalDamping, damping and referencePenetration.
    pub fn chosen(stiffness: T, damping: T, law: T, reference: T) -> Self {
        let smooth = law.value() == HUNT_CROSSLEY;
        Self { stiffness, damping, reference: smooth.then_some(reference) }
    }
    /// Damping in N.s/m of a pair in this mode at this depth.
    pub fn damping(&self, mode: i32, penetration: T) -> T {
        match (mode, self.reference) {
            (COMPRESSING | RESTITUTING, Some(reference)) => self.damping * penetration / reference,
            (COMPRESSING, None) => self.damping,
            _ => T::zero(),
        }
    }
    /// Normal force in N, never pulling; jumps by eta_n v_n where a pair begins to touch, unless the damping is Hunt and
    /// Crossley's.
    pub fn force(&self, mode: i32, penetration: T, approach: T) -> T {
        if !touches(mode) {
            return T::zero();
        }
        let force = self.stiffness * penetration + self.damping(mode, penetration) * approach; // (CON-2)
        if self.reference.is_some() { force.max(T::zero()) } else { force }
    }
    /// Energy of the spring in J.
    pub fn energy(&self, mode: i32, penetration: T) -> T {
        if touches(mode) { self.stiffness * penetration * penetration * 0.5 } else { T::zero() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: ContactLaw<f64> = ContactLaw { stiffness: 20000.0, damping: 900.0, reference: None };

    /// Checks CON-1.
    #[test]
    fn depth_grows_as_balls_near_and_the_normal_leads_to_the_other_one() {
        let pair = balls([0.06, 0.08], [-0.3, 0.4], 0.11);
        assert!((pair.normal[0] - 0.6).abs() < 1e-15 && (pair.normal[1] - 0.8).abs() < 1e-15);
        assert!((pair.penetration - 0.01).abs() < 1e-16);
        assert!((pair.approach + 0.14).abs() < 1e-15, "{pair:?}");
        let flat = plate([0.04, 9.0], [-0.3, 5.0], [-1.0, 0.0], 0.05);
        assert_eq!(flat.normal, [1.0, 0.0]);
        assert!((flat.penetration - 0.01).abs() < 1e-16 && (flat.approach - 0.3).abs() < 1e-16);
    }

    /// Checks CON-2.
    #[test]
    fn the_damper_acts_while_balls_approach() {
        let at = |approach| {
            let pair = ContactPair { normal: [1.0, 0.0], penetration: 1e-3, approach };
            LAW.force(next_mode(FREE, &pair), 1e-3, approach)
        };
        assert_eq!([at(0.01), at(0.0), at(-0.01)], [29.0, 20.0, 20.0]);
        assert_eq!(LAW.force(FREE, -1e-3, 0.01), 0.0);
        assert_eq!(LAW.energy(RESTITUTING, 1e-3), 0.01);
    }

    /// Checks CON-3 and C12: the onset of SIM2 and of SIM3.
    #[test]
    fn the_force_jumps_where_balls_meet_unless_it_is_hunt_and_crossleys() {
        let sim3 = ContactLaw { stiffness: 6000.0, damping: 81.0, reference: None };
        assert!((LAW.force(COMPRESSING, 0.0, 0.005) - 4.5).abs() < 1e-12);
        assert!((sim3.force(COMPRESSING, 0.0, 0.005) - 0.405).abs() < 1e-12);
        let soft = ContactLaw { reference: Some(1e-3), ..LAW };
        assert_eq!(soft.force(COMPRESSING, 0.0, 0.005), 0.0);
        assert_eq!(soft.force(COMPRESSING, 1e-3, 0.005), 24.5);
        assert_eq!(soft.force(RESTITUTING, 1e-3, -0.005), 15.5);
        assert_eq!(soft.force(RESTITUTING, 1e-3, -5.0), 0.0, "it never pulls");
        let pair = |penetration, approach| ContactPair { normal: [1.0, 0.0], penetration, approach };
        assert_eq!(indicators(COMPRESSING, &pair(2.0, 3.0)), [2.0, 3.0 + TURNED]);
        assert_eq!(indicators(RESTITUTING, &pair(2.0, 3.0)), [2.0, 3.0 - TURNED]);
        assert_eq!(indicators(FREE, &pair(-2.0, 3.0)), [-2.0, 3.0 + TURNED]);
        assert_eq!(indicators(PARTING, &pair(-2.0, -3.0)), [-2.0 - PARTED, -3.0 - TURNED]);
    }

    /// A pair at rest stays as it is: rounding turns nothing.
    #[test]
    fn modes_follow_depth_and_approach() {
        let next = |mode, penetration, approach| {
            next_mode(mode, &ContactPair { normal: [1.0, 0.0], penetration, approach })
        };
        assert_eq!(
            [next(FREE, -0.0, 0.0), next(COMPRESSING, -1e-18, -1.0), next(RESTITUTING, f64::NAN, 0.0)],
            [FREE, PARTING, FREE]
        );
        for approach in [1e-15, 1.0] {
            let at = |mode| next(mode, threshold(mode), approach);
            assert_eq!([FREE, PARTING, COMPRESSING].map(at), [COMPRESSING; 3], "approaching at depth 0");
            assert_eq!(
                at(COMPRESSING),
                next_mode(at(FREE), &ContactPair { normal: [1.0, 0.0], penetration: 0.0, approach })
            );
        }
        assert_eq!([next(PARTING, -1.0, 1e-9), next(FREE, -1.0, -1e-9)], [FREE, PARTING]);
        assert_eq!([next(PARTING, 1e-9, 1e-15), next(PARTING, 1e-9, -1.0)], [COMPRESSING, RESTITUTING]);
        // Rounding of a depth makes no touch of a parting.
        assert_eq!([next(PARTING, 1e-15, -1e-4), next(RESTITUTING, -1e-17, -1e-4)], [PARTING, PARTING]);
        assert_eq!([next(FREE, 1e-9, 1e-15), next(FREE, 1e-9, 0.0)], [COMPRESSING, RESTITUTING]);
        for noise in [-1e-15, 0.0, 1e-15] {
            assert_eq!(
                [next(COMPRESSING, 1e-3, noise), next(RESTITUTING, 1e-3, noise)],
                [COMPRESSING, RESTITUTING]
            );
            assert_eq!([next(FREE, -1e-3, noise), next(PARTING, -1e-3, noise)], [FREE, PARTING]);
        }
        assert_eq!(
            [next(COMPRESSING, 1e-3, -1e-9), next(RESTITUTING, 1e-3, 1e-9)],
            [RESTITUTING, COMPRESSING]
        );
    }
}
