//! `flexible-link`: a vibration mode of the link.
//!
//! (EF-6) the link carries a tip of inertia J_2 on a spring:
//! J_2 dd(q_2) = -tau_2 with tau_2 = K_2 (q_2 - q_l) + D_2 (d(q_2) - d(q_l)), and +tau_2 acts on the link.
//! On the joint `loadInertia` is the hub's then, on the arm `linkInertia` that of the stiff part.
//!
//! What it gets wrong: one mode only; the tip turns about the link's own axis, so on the arm the bending does
//! not move the tip's position.

use super::*;

pub(crate) struct FlexibleLink;

fn tip_torque<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> T {
    // A tip without inertia is none.
    if l.p(0).value() <= 0.0 {
        return T::zero();
    }
    l.p(1) * (l.x(0) - d.link_angle) + l.p(2) * (l.x(1) - d.link_rate)
}

impl Effect for FlexibleLink {
    const SPEC: Spec = Spec {
        id: "flexible-link",
        component: "load",
        summary: "a vibration mode of the link: a tip inertia on a spring",
        noun: "flexibility of the link",
        check: "Lock the joint and tap the end of the link: at which frequency does it ring, and how long?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm],
        not_in_space: "links of a robot bend by shapes or tables of modes, which move what hangs on them: give its file a [body.link]",
        parameters: &[
            ParameterSpec {
                name: "tipInertia",
                unit: "kg.m2",
                description: "Moment of inertia of the tip, J_2 (EF-6)",
                joint_start: 6.0,
                arm_start: 0.05,
                min: 0.0,
                scale: EffectScale::of(0.5, &[(Measure::LoadInertia, 1)]),
                log: true,
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "linkStiffness",
                unit: "N.m/rad",
                description: "Stiffness between hub and tip, K_2 (EF-6)",
                min: 0.0,
                joint_start: 1555.0,
                arm_start: 5.0,
                log: true,
                role: ParameterRole::Shape,
                scale: EffectScale::of(0.5, &[(Measure::LoadInertia, 1), (Measure::Mode, 2)]),
                search: SearchRange { doubt: 3.0, ..SearchRange::USUAL },
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "linkDamping",
                unit: "N.m.s/rad",
                description: "Damping between hub and tip, D_2 (EF-6)",
                min: 0.0,
                joint_start: 0.966,
                arm_start: 0.02,
                role: ParameterRole::Shape,
                scale: EffectScale::of(0.02, &[(Measure::LoadInertia, 1), (Measure::Mode, 1)]),
                ..ParameterSpec::NONE
            },
        ],
        passive: true,
        states: &[
            SignalSpec {
                name: "tipAngle",
                arm_name: "linkTipAngle",
                nominal: 1e-5,
                unit: "rad",
                description: "Angle of the tip, q_2 (EF-6)",
                rate_unit: "rad/s",
                boolean: false,
            },
            SignalSpec {
                name: "tipVelocity",
                arm_name: "linkTipVelocity",
                nominal: 1e-4,
                unit: "rad/s",
                description: "Velocity of the tip (EF-6)",
                rate_unit: "rad/s2",
                boolean: false,
            },
        ],
        outputs: &[
            SignalSpec {
                name: "tipAngle",
                arm_name: "linkTipAngle",
                nominal: 1e-5,
                unit: "rad",
                description: "Angle of the tip, q_2 (EF-6)",
                rate_unit: "",
                boolean: false,
            },
            SignalSpec {
                name: "tipVelocity",
                arm_name: "linkTipVelocity",
                nominal: 1e-4,
                unit: "rad/s",
                description: "Velocity of the tip (EF-6)",
                rate_unit: "",
                boolean: false,
            },
        ],
        shows_motion: true,
        resonator: true,
        affine: true,
        ..Spec::NONE
    };

    fn start<T: Scalar>(_l: &Local<T>, d: &DriveTrain<T>, x: &mut [T]) {
        (x[0], x[1]) = (d.link_angle, d.link_rate);
    }
    fn link_torque<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> T {
        tip_torque(l, d)
    }
    fn rates<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, _s: &Spring<T>, dx: &mut [T]) {
        if l.p(0).value() > 0.0 {
            (dx[0], dx[1]) = (l.x(1), -tip_torque(l, d) / l.p(0));
        }
    }
    fn outputs<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, y: &mut [T]) {
        (y[0], y[1]) = (l.x(0), l.x(1));
    }
    fn energy<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> [T; 2] {
        let twist = if l.p(0).value() > 0.0 { l.x(0) - d.link_angle } else { T::zero() };
        [l.p(0) * l.x(1) * l.x(1) * 0.5, l.p(1) * twist * twist * 0.5]
    }
    fn angular_momentum<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>) -> T {
        l.p(0) * l.x(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef6_acts_and_reacts() {
        let l = Local::new(&[2.0, 30.0, 0.5], &[0.4, 1.5], &[], 0, 1);
        let d = DriveTrain { link_angle: 0.1, link_rate: -0.5, ..DriveTrain::default() };
        let mut dx = [0.0; 2];
        FlexibleLink::rates(&l, &d, &Spring::default(), &mut dx);
        let on_link: f64 = FlexibleLink::link_torque(&l, &d);
        assert!((on_link - (30.0 * 0.3 + 0.5 * 2.0)).abs() < 1e-14);
        assert!((2.0 * dx[1] + on_link).abs() < 1e-14);
    }
}
