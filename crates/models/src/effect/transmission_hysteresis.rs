//! `transmission-hysteresis`: friction inside the compliant element.
//!
//! (EF-5) adds tau_h z to the spring torque, with dz/dt = (d(delta)/dt - |d(delta)/dt| z) / x_h (Dahl's law,
//! rate-independent, |z| <= 1).
//!
//! What it gets wrong: small loops drift slowly under a constant load (Dahl's law is not strictly closed).

use super::*;

pub(crate) struct TransmissionHysteresis;

impl Effect for TransmissionHysteresis {
    const SPEC: Spec = Spec {
        id: "transmission-hysteresis",
        component: "transmission",
        summary: "friction inside the compliant element: its torque depends on its history",
        noun: "hysteresis of the transmission",
        check: "Block the load, raise and lower the motor torque slowly: does the twist come back by another way?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        parameters: &[
            ParameterSpec {
                name: "hysteresisTorque",
                unit: "N.m",
                description: "Half width of the loop, tau_h (EF-5)",
                min: 0.0,
                joint_start: 1.0e-5,
                arm_start: 0.02,
                scale: EffectScale::of(0.2, &[(Measure::Torque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "hysteresisDisplacement",
                unit: "rad",
                description: "Deflection over which the loop closes after a reversal, x_h (EF-5)",
                joint_start: 0.5,
                arm_start: 0.002,
                scale: EffectScale::of(0.3, &[(Measure::Deflection, 1)]),
                ..ParameterSpec::SHAPE
            },
        ],
        compliant: true,
        passive: true,
        states: &[SignalSpec {
            name: "hysteresis",
            arm_name: "",
            nominal: 0.01,
            unit: "1",
            description: "Share of the hysteresis torque, z (EF-5)",
            rate_unit: "1/s",
            boolean: false,
        }],
        bristles: true,
        ..Spec::NONE
    };

    fn spring<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, s: &mut Spring<T>) {
        if s.engaged {
            s.extra += l.p(0) * l.x(0);
        }
    }
    fn rates<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, s: &Spring<T>, dx: &mut [T]) {
        dx[0] = (s.rate - s.rate.abs() * l.x(0)) / l.p(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef5_follows_the_exponential_of_dahls_law() {
        // Loaded in one direction, z = 1 - exp(-delta / x_h) exactly; integrate dz/d(delta) finely.
        let (p, x_h) = ([1.0, 0.1], 0.1);
        let (mut z, n, span) = (0.0f64, 20_000, 0.3);
        for _ in 0..n {
            let slope = |z: f64| {
                let s = Spring { rate: 1.0, ..Spring::default() };
                let mut dx = [0.0];
                TransmissionHysteresis::rates(
                    &Local::new(&p, &[z], &[], 0, 1),
                    &DriveTrain::default(),
                    &s,
                    &mut dx,
                );
                dx[0]
            };
            let h = span / f64::from(n);
            z += h * slope(z + 0.5 * h * slope(z));
        }
        assert!((z - (1.0 - (-span / x_h).exp())).abs() < 1e-7);
    }
}
