//! `position-servo`: the drive holds a commanded angle by itself, as hobby and industrial servos do.
//!
//! (EF-33) adds k_P e - k_D d(theta) + r z to the motor's torque, dz/dt = k_P e - k_D d(theta), with the error
//! e = n q_ref - (theta - epsilon): P on the load's angle, D on the motor's velocity, both on the drive's side; theta is the
//! motor's angle, epsilon the transmission's deflection, n the gear ratio of TwoMassJoint, 1 of an arm. A cascade of P and PI (CTL-1, CTL-7) is
//! k_P = K_v K_p / n^2, k_D = K_v / n^2, r = 1 / T_i. The reference is an input more; what the motor is commanded in addition is
//! fed forward.
//!
//! It is a part that the user declares (`[effects]` of a case): no diagnosis looks for it.
//!
//! What it gets wrong: it has no sample period, and of what limits it (`current-saturation`) its integral contains nothing; an
//! error of the gear is not in the angle that it reads.

use super::*;

pub(crate) struct PositionServo;

/// What the controller answers to at once, N.m.
fn proportional<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> T {
    let error = l.u(0) * d.ratio - (d.theta - d.epsilon);
    l.p(0) * error - l.p(1) * d.omega
}

impl Effect for PositionServo {
    const SPEC: Spec = Spec {
        id: "position-servo",
        component: "actuator",
        summary: "the drive holds a commanded angle by itself: an input positionReference more",
        noun: "a position servo",
        check: "Turn the joint by hand while the drive is on: does it push back?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        parameters: &[
            ParameterSpec {
                name: "servoProportionalGain",
                unit: "N.m/rad",
                description: "Torque per error of the load's angle, drive's side, k_P (EF-33)",
                min: 0.0,
                joint_start: 1e-4,
                arm_start: 1.0,
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "servoDerivativeGain",
                unit: "N.m.s/rad",
                description: "Torque against the motor's velocity, k_D (EF-33)",
                min: 0.0,
                joint_start: 2e-5,
                arm_start: 0.5,
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "servoIntegralRate",
                unit: "1/s",
                description: "1 over the time after which the integral has added as much again, r (EF-33)",
                min: 0.0,
                ..ParameterSpec::NONE
            },
        ],
        inputs: &[SignalSpec {
            name: "positionReference",
            unit: "rad",
            arm_name: "",
            description: "Angle of the joint, load side, that its servo holds, q_ref (EF-33)",
            nominal: 1.0,
            rate_unit: "",
            boolean: false,
        }],
        states: &[SignalSpec {
            name: "servoIntegral",
            unit: "N.m.s",
            arm_name: "",
            description: "Integral of the servo's torque, z (EF-33)",
            nominal: 1e-4,
            rate_unit: "N.m",
            boolean: false,
        }],
        installed: true,
        servo: true,
        affine: true,
        ..Spec::NONE
    };

    fn rates<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, _s: &Spring<T>, dx: &mut [T]) {
        dx[0] = proportional(l, d);
    }
    fn actuator<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, torque: T) -> T {
        torque + proportional(l, d) + l.p(2) * l.x(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef33_holds_the_loads_angle_and_damps_the_motor() {
        let (p, x, u) = ([2.0, 0.1, 4.0], [0.3], [0.5]);
        let l = Local::new(&p, &x, &[], 0, 1).with_inputs(&u);
        let d = DriveTrain { ratio: 10.0, theta: 4.0, epsilon: 0.5, omega: 3.0, ..DriveTrain::default() };
        // e = 5 - 3.5, 2 e - 0.3 = 2.7
        assert!((PositionServo::actuator(&l, &d, 0.2) - (0.2f64 + 2.7 + 4.0 * 0.3)).abs() < 1e-15);
        let mut dx = [0.0];
        PositionServo::rates(&l, &d, &Spring::default(), &mut dx);
        assert!((dx[0] - 2.7).abs() < 1e-14);
    }
}
