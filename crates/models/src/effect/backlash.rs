//! `backlash`: play in the transmission.
//!
//! (EF-3) with the gap g and the deflection epsilon: no torque while |epsilon| < g/2, else
//! K (epsilon -+ g/2) + D d(epsilon)/dt.
//!
//! What it gets wrong: the damper acts as soon as the faces touch, so the torque jumps by D d(epsilon)/dt at
//! a contact, and the faces may pull for an instant before they part. The gap 0 is the linear law exactly.

use super::*;

pub(crate) struct Backlash;

impl Effect for Backlash {
    const SPEC: Spec = Spec {
        id: "backlash",
        component: "transmission",
        summary: "play: no torque within a gap",
        scope: Scope::Joint,
        plants: &[Plant::Joint, Plant::Arm],
        parameters: &[ParameterSpec {
            name: "backlashGap",
            unit: "rad",
            description: "Width of the gap between the faces, on the drive's side of the gear, g (EF-3)",
            min: 0.0,
            joint_start: 5.0,
            arm_start: 0.01,
            ..ParameterSpec::NONE
        }],
        modes: 1,
        indicators: 2,
        ..Spec::NONE
    };

    fn spring<T: Scalar>(l: &Local<T>, _d: &Drive<T>, s: &mut Spring<T>) {
        let half_gap = l.p(0) * 0.5;
        if half_gap.value() <= 0.0 {
            return;
        }
        match l.mode(0) {
            0 => (s.deflection, s.rate, s.engaged) = (T::zero(), T::zero(), false),
            side => s.deflection -= half_gap * f64::from(side),
        }
    }
    fn indicators<T: Scalar>(l: &Local<T>, d: &Drive<T>, z: &mut [T]) {
        let half_gap = l.p(0) * 0.5;
        if half_gap.value() > 0.0 {
            (z[0], z[1]) = (d.epsilon - half_gap, d.epsilon + half_gap);
        } else {
            (z[0], z[1]) = (T::one(), T::one());
        }
    }
    fn update(l: &Local<f64>, d: &Drive<f64>, modes: &mut [i32]) {
        let half_gap = 0.5 * l.p(0);
        modes[0] = if d.epsilon > half_gap {
            1
        } else if d.epsilon < -half_gap {
            -1
        } else {
            0
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef3_is_free_in_the_gap_and_linear_beyond() {
        for (epsilon, torque) in [(-0.3, -2.0), (-0.05, 0.0), (0.05, 0.0), (0.2, 1.0)] {
            let d = Drive { epsilon, ..Drive::default() };
            let mut modes = [7];
            Backlash::update(&Local::new(&[0.2], &[], &[0], 0, 1), &d, &mut modes);
            let mut s = Spring::linear(10.0, 0.0, &d);
            Backlash::spring(&Local::new(&[0.2], &[], &modes, 0, 1), &d, &mut s);
            assert!((s.torque() - torque).abs() < 1e-15, "at {epsilon}");
        }
    }
}
