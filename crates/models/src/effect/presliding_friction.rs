//! `presliding-friction`: hysteretic, spring-like friction before sliding.
//!
//! (EF-17) the share s of the dry friction is carried by bristles: (1 - s) times the break-away and sliding levels, as
//! they are without the effect, and s tau_c z, with dz/dt = (omega - |omega| z tau_c / g) / x_p, g being the sliding
//! level at this speed (Dahl's law; with Stribeck friction that of LuGre without its damping).
//!
//! For s = 1 there is no sticking left, only strained bristles; the events that remain are the turns of the motor. The
//! stored energy x_p s tau_c z^2 / 2 makes it passive.
//!
//! What it gets wrong: the bristles yield from the first strain on, so that a motor under a vibrating load creeps.

use super::*;

pub(crate) struct PreslidingFriction;

impl Effect for PreslidingFriction {
    const SPEC: Spec = Spec {
        id: "presliding-friction",
        component: "motor-friction",
        summary: "hysteretic, spring-like friction before sliding",
        noun: "spring-like friction before sliding",
        check: "Apply a torque well below break-away and take it away: does the motor move a little and spring back?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        friction: true,
        passive: true,
        parameters: &[
            ParameterSpec {
                name: "preslidingShare",
                unit: "1",
                description: "Share of the dry friction that bristles carry, s (EF-17)",
                min: 0.0,
                max: 1.0,
                joint_start: 1.0,
                arm_start: 1.0,
                scale: EffectScale::plain(0.5),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "preslidingDisplacement",
                unit: "rad",
                description: "Motor angle over which the bristles yield, x_p (EF-17)",
                joint_start: 0.5,
                arm_start: 0.002,
                scale: EffectScale::of(0.1, &[(Measure::Deflection, 1)]),
                ..ParameterSpec::SHAPE
            },
        ],
        states: &[SignalSpec {
            name: "bristle",
            arm_name: "",
            nominal: 0.01,
            unit: "1",
            description: "Strain of the bristles, z (EF-17)",
            rate_unit: "1/s",
            boolean: false,
        }],
        bristles: true,
        ..Spec::NONE
    };

    fn friction<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, direction: f64, levels: &mut Levels<T>) {
        levels.bristles = levels.sliding;
        let rest = -l.p(0) + 1.0;
        let bristles = l.p(0) * levels.nominal * l.x(0) * direction;
        levels.breakaway = levels.breakaway * rest + bristles;
        levels.sliding = levels.sliding * rest + bristles;
    }
    fn rates<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, _s: &Spring<T>, dx: &mut [T]) {
        let Levels { nominal, bristles, .. } = d.levels;
        // Where the level is next to nothing the bristles let go at once.
        let pull = if nominal.value() > 0.0 { nominal / bristles.max(nominal * 1e-3) } else { T::one() };
        dx[0] = (d.omega - d.omega.abs() * l.x(0) * pull) / l.p(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::paper;

    #[test]
    fn ef17_settles_at_the_sliding_level_and_takes_energy_out() {
        // Pushed to and fro by 0.5 rad: the torque against the exact solution of the first stroke, and the loop's work.
        let (p, h, mut z) = ([1.0, 0.1], 1e-4, 0.0f64);
        let at = |omega: f64, z: f64| {
            let mut levels = paper(2.0, 3.0, 0.0, omega.abs());
            let (x, d) = ([z], DriveTrain { omega, ..DriveTrain::default() });
            let l = Local::new(&p, &x, &[], 0, 1);
            PreslidingFriction::friction(&l, &d, omega.signum(), &mut levels);
            let mut dx = [0.0];
            PreslidingFriction::rates(&l, &DriveTrain { levels, ..d }, &Spring::default(), &mut dx);
            (levels.braking() * omega.signum(), dx[0])
        };
        let mut work = 0.0;
        for k in 0..20_000 {
            let omega = if k % 10_000 < 5000 { 1.0 } else { -1.0 };
            let middle = z + 0.5 * h * at(omega, z).1;
            let (torque, rate) = at(omega, middle);
            (z, work) = (z + h * rate, work + h * torque * omega);
            if k == 999 {
                assert!((at(1.0, z).0 - 2.0 * (1.0 - (-1.0f64).exp())).abs() < 1e-6);
            }
            if k == 4999 {
                assert!((at(1.0, z).0 - 2.0 * (1.0 - (-5.0f64).exp())).abs() < 1e-6);
            }
        }
        // Four strokes of 0.5 rad, each but the first from nearly -1 to nearly 1.
        assert!(work > 0.6 * 4.0 * 0.5 * 2.0 && work < 4.0 * 0.5 * 2.0, "{work}");
    }
}
