//! `load-friction`: friction on the load side.
//!
//! (EF-21) torque -(tau_l z + D_l omega) between the link and the body that carries it, omega being the joint's velocity
//! (load side), with dz/dt = (omega - |omega| z) / x_l (Dahl's law): a load that turns is braked by tau_l, one at rest is
//! held up to tau_l by bristles that yield over x_l, ever more like dry friction as x_l goes to 0.
//!
//! What it gets wrong: under a vibrating load it creeps where dry friction would hold.

use super::*;

pub(crate) struct LoadFriction;

impl Effect for LoadFriction {
    const SPEC: Spec = Spec {
        id: "load-friction",
        component: "load",
        summary: "friction on the load side",
        noun: "friction on the load side",
        check: "Release the load from the gear, or turn it by hand: does its bearing or seal drag?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        passive: true,
        parameters: &[
            ParameterSpec {
                name: "loadFriction",
                unit: "N.m",
                description: "Dry friction on the load side, tau_l (EF-21)",
                min: 0.0,
                joint_start: 2.0,
                arm_start: 0.01,
                scale: EffectScale::of(0.15, &[(Measure::LoadTorque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "loadViscousFriction",
                unit: "N.m.s/rad",
                description: "Viscous friction on the load side, D_l (EF-21)",
                min: 0.0,
                scale: EffectScale::of(0.15, &[(Measure::LoadTorque, 1), (Measure::LoadSpeed, -1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "loadFrictionDisplacement",
                unit: "rad",
                description: "Load angle over which the bristles yield, x_l (EF-21)",
                joint_start: 1.0e-5,
                arm_start: 0.001,
                scale: EffectScale::of(0.003, &[(Measure::LoadAngle, 1)]),
                ..ParameterSpec::SHAPE
            },
        ],
        states: &[SignalSpec {
            name: "loadBristle",
            arm_name: "",
            nominal: 0.01,
            unit: "1",
            description: "Strain of the bristles, z (EF-21)",
            rate_unit: "1/s",
            boolean: false,
        }],
        bristles: true,
        ..Spec::NONE
    };

    fn joint_torque<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> T {
        -(l.p(0) * l.x(0) + l.p(1) * d.joint_rate)
    }
    fn rates<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, _s: &Spring<T>, dx: &mut [T]) {
        dx[0] = (d.joint_rate - d.joint_rate.abs() * l.x(0)) / l.p(2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef21_holds_strain_and_brakes_at_its_level() {
        // Steady strain in either direction, and the stored energy x_l tau_l z^2 / 2 never grows by more than the work.
        let p = [2.0, 0.3, 0.01];
        for (rate, z) in [(0.5, 1.0), (-0.5, -1.0), (0.5, 0.4), (-0.2, 0.9)] {
            let (x, d) = ([z], DriveTrain { joint_rate: rate, ..DriveTrain::default() });
            let l = Local::new(&p, &x, &[], 0, 1);
            let mut dx = [0.0];
            LoadFriction::rates(&l, &d, &Spring::default(), &mut dx);
            let torque: f64 = LoadFriction::joint_torque(&l, &d);
            let stored = 0.01 * 2.0 * z * dx[0];
            let lost = 2.0 * f64::abs(rate) * z * z + 0.3 * rate * rate;
            assert!((-torque * rate - stored - lost).abs() < 1e-14, "{rate} {z}");
            assert!((torque + 2.0 * z + 0.3 * rate).abs() < 1e-15 && (z.abs() < 1.0 || dx[0] == 0.0));
        }
    }
}
