//! `backlash`: play in the transmission.
//!
//! (EF-3) with the gap g and the deflection epsilon: no torque while |epsilon| < g/2, else
//! K (epsilon -+ g/2) + D d(epsilon)/dt.
//!
//! What it gets wrong: the damper acts as soon as the faces touch, so the torque jumps by D d(epsilon)/dt at
//! a contact, and the faces may pull for an instant before they part. The gap 0 is the linear law exactly.

use super::*;

pub(crate) struct Backlash;

/// Which faces touch: +1, -1, or 0 for none. An event is located on the edge of the gap, to either side of it or
/// exactly there, as the solver has it: within a hair of the edge the direction of motion decides.
fn side(epsilon: f64, epsilon_dot: f64, half_gap: f64, present: i32) -> i32 {
    let beyond = |outward: f64, velocity: f64| match outward - half_gap {
        d if d.abs() > 1e-9 * half_gap => d > 0.0,
        _ if velocity != 0.0 => velocity > 0.0,
        _ => present != 0,
    };
    i32::from(beyond(epsilon, epsilon_dot)) - i32::from(beyond(-epsilon, -epsilon_dot))
}

impl Effect for Backlash {
    const SPEC: Spec = Spec {
        id: "backlash",
        component: "transmission",
        summary: "play: no torque within a gap",
        noun: "backlash in the transmission",
        check: "Hold the load and turn the motor back and forth by hand or with little current: through which angle does it turn freely?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        parameters: &[ParameterSpec {
            name: "backlashGap",
            unit: "rad",
            description: "Width of the gap between the faces, on the drive's side of the gear, g (EF-3)",
            min: 0.0,
            joint_start: 5.0,
            scale: EffectScale::of(0.3, &[(Measure::Deflection, 1)]),
            arm_start: 0.01,
            ..ParameterSpec::NONE
        }],
        compliant: true,
        passive: true,
        modes: 1,
        indicators: 2,
        ..Spec::NONE
    };

    fn spring<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, s: &mut Spring<T>) {
        let half_gap = l.p(0) * 0.5;
        if half_gap.value() <= 0.0 {
            return;
        }
        match l.mode(0) {
            0 => (s.deflection, s.rate, s.engaged) = (T::zero(), T::zero(), false),
            side => s.deflection -= half_gap * f64::from(side),
        }
    }
    fn indicators<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, z: &mut [T]) {
        let half_gap = l.p(0) * 0.5;
        if half_gap.value() > 0.0 {
            (z[0], z[1]) = (d.epsilon - half_gap, d.epsilon + half_gap);
        } else {
            (z[0], z[1]) = (T::one(), T::one());
        }
    }
    fn update(l: &Local<f64>, d: &DriveTrain<f64>, modes: &mut [i32]) {
        modes[0] = side(d.epsilon, d.epsilon_dot, 0.5 * l.p(0), modes[0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef3_on_the_edge_the_direction_of_motion_decides() {
        for (epsilon, velocity, present, expected) in
            [(0.1, 1.0, 0, 1), (0.1, -1.0, 1, 0), (0.1, 0.0, 1, 1), (-0.1, -1.0, 0, -1), (-0.1, 1.0, -1, 0)]
        {
            for off in [-1e-15, 0.0, 1e-15] {
                assert_eq!(side(epsilon + off, velocity, 0.1, present), expected, "{epsilon} {velocity}");
            }
        }
    }

    #[test]
    fn ef3_is_free_in_the_gap_and_linear_beyond() {
        for (epsilon, torque) in [(-0.3, -2.0), (-0.05, 0.0), (0.05, 0.0), (0.2, 1.0)] {
            let d = DriveTrain { epsilon, ..DriveTrain::default() };
            let mut modes = [7];
            Backlash::update(&Local::new(&[0.2], &[], &[0], 0, 1), &d, &mut modes);
            let mut s = Spring::linear(10.0, 0.0, &d);
            Backlash::spring(&Local::new(&[0.2], &[], &modes, 0, 1), &d, &mut s);
            assert!((s.torque() - torque).abs() < 1e-15, "at {epsilon}");
        }
    }
}
