//! `base-drag`: air bearings that drag on the satellite mock-up.
//!
//! (EF-9) force -c_t v_0 at the base's centre of mass, torque -c_r omega_0; in space the same in three dimensions.
//!
//! What it gets wrong: bearings that touch the table brake with dry friction too.

use super::*;

pub(crate) struct BaseDrag;

impl Effect for BaseDrag {
    const SPEC: Spec = Spec {
        id: "base-drag",
        component: "base",
        summary: "air bearings that drag: a force against the base's velocity, a torque against its rate",
        noun: "drag of the base's air bearings",
        check: "Push the base and let it glide: does it slow down? Check air pressure, pads and the hoses.",
        scope: Scope::Once,
        plants: &[PlantKind::Arm, PlantKind::Space],
        parameters: &[
            ParameterSpec {
                name: "baseDrag",
                unit: "N.s/m",
                description: "Force per velocity of the base, c_t (EF-9)",
                min: 0.0,
                arm_start: 2.0,
                scale: EffectScale::of(0.3, &[(Measure::Force, 1), (Measure::Velocity, -1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "baseRotationalDrag",
                unit: "N.m.s/rad",
                description: "Torque per rate of the base, c_r (EF-9)",
                min: 0.0,
                arm_start: 0.2,
                scale: EffectScale::of(0.3, &[(Measure::BaseTorque, 1), (Measure::BaseRate, -1)]),
                ..ParameterSpec::NONE
            },
        ],
        passive: true,
        affine: true,
        ..Spec::NONE
    };

    fn space_base<T: Scalar>(l: &Local<T>, b: &FlyerBase<T>) -> SpatialWrench<T> {
        SpatialWrench { force: b.velocity.map(|v| -l.p(0) * v), torque: b.rate.map(|w| -l.p(1) * w) } // (EF-9)
    }
    fn base<T: Scalar>(l: &Local<T>, b: &BaseMotion<T>) -> BaseWrench<T> {
        BaseWrench { force: [-l.p(0) * b.velocity[0], -l.p(0) * b.velocity[1]], torque: -l.p(1) * b.rate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef9_takes_energy_out() {
        let b = BaseMotion { velocity: [0.3, -0.4], rate: 0.5, ..BaseMotion::default() };
        let w = BaseDrag::base(&Local::new(&[2.0, 0.1], &[], &[], 0, 1), &b);
        let power: f64 = w.force[0] * b.velocity[0] + w.force[1] * b.velocity[1] + w.torque * b.rate;
        assert!((power + 2.0 * 0.25 + 0.1 * 0.25).abs() < 1e-15);
    }
}
