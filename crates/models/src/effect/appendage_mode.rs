//! `appendage-mode`: a flexible appendage of the base (solar panel, sloshing).
//!
//! (EF-24) dd(q_a) = -omega_a^2 (q_a - q_0) - 2 zeta omega_a (d(q_a) - d(q_0)), and -J_a dd(q_a) acts on the base: a body of
//! inertia J_a on a spring about the base's centre of mass. `baseInertia` is that of the stiff part.
//!
//! What it gets wrong: one mode, rotation only; the appendage does not shake the base's position.

use super::*;

pub(crate) struct AppendageMode;

/// Acceleration of the appendage.
fn acceleration<T: Scalar>(l: &Local<T>, b: &BaseMotion<T>) -> T {
    let omega = l.p(1);
    -omega * (omega * (l.x(0) - b.attitude) + l.p(2) * 2.0 * (l.x(1) - b.rate))
}

const fn signal(
    name: &'static str,
    unit: &'static str,
    rate_unit: &'static str,
    description: &'static str,
) -> SignalSpec {
    SignalSpec { name, unit, arm_name: "", description, nominal: 1e-3, rate_unit, boolean: false }
}

/// Of a panel of common size, rad/s.
const FREQUENCY: f64 = 5.0;
/// From slow sloshing to a stiff panel, as multiples of [`FREQUENCY`]: nothing of the arm determines it.
const FREQUENCIES: SearchRange = SearchRange {
    looks: &[0.06, 0.12, 0.24, 0.48, 0.8, 1.3, 2.1, 3.6, 7.2],
    doubt: 2.0,
    ..SearchRange::USUAL
};
/// Resonances are narrow.
const DAMPINGS: SearchRange = SearchRange { looks: &[0.1, 0.5, 2.5], doubt: 2.0, ..SearchRange::USUAL };

impl Effect for AppendageMode {
    const SPEC: Spec = Spec {
        id: "appendage-mode",
        component: "base",
        summary: "a flexible appendage (solar panel, sloshing)",
        noun: "a flexible appendage on the base",
        check: "Tap the base, or stop it short, with the arm at rest: does it go on swinging at one frequency?",
        scope: Scope::Once,
        plants: &[PlantKind::Arm],
        not_in_space: "panels are appendages with modes of their own, in all directions: give the robot an appendage",
        passive: true,
        parameters: &[
            ParameterSpec {
                name: "appendageInertia",
                unit: "kg.m2",
                description: "Moment of inertia of the appendage, J_a (EF-24)",
                min: 0.0,
                arm_start: 0.5,
                scale: EffectScale::of(0.2, &[(Measure::BaseInertia, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "appendageFrequency",
                unit: "rad/s",
                description: "Natural frequency with the base held, omega_a (EF-24)",
                arm_start: FREQUENCY,
                scale: EffectScale::plain(FREQUENCY),
                search: FREQUENCIES,
                ..ParameterSpec::SHAPE
            },
            ParameterSpec {
                name: "appendageDampingRatio",
                unit: "1",
                description: "Share of critical damping, zeta (EF-24)",
                min: 0.0,
                above_min: false,
                arm_start: 0.02,
                scale: EffectScale::plain(0.02),
                search: DAMPINGS,
                ..ParameterSpec::SHAPE
            },
        ],
        states: &[
            signal("appendageAngle", "rad", "rad/s", "Angle of the appendage, q_a (EF-24)"),
            signal("appendageRate", "rad/s", "rad/s2", "Rate of the appendage (EF-24)"),
        ],
        ..Spec::NONE
    };

    fn start<T: Scalar>(_l: &Local<T>, d: &DriveTrain<T>, x: &mut [T]) {
        (x[0], x[1]) = (d.base.attitude, d.base.rate);
    }
    fn rates<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, _s: &Spring<T>, dx: &mut [T]) {
        (dx[0], dx[1]) = (l.x(1), acceleration(l, &d.base));
    }
    fn base<T: Scalar>(l: &Local<T>, b: &BaseMotion<T>) -> BaseWrench<T> {
        BaseWrench { torque: -l.p(0) * acceleration(l, b), ..BaseWrench::default() }
    }
    fn energy<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> [T; 2] {
        let twist = (l.x(0) - d.base.attitude) * l.p(1);
        [l.p(0) * l.x(1) * l.x(1) * 0.5, l.p(0) * twist * twist * 0.5]
    }
    fn angular_momentum<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>) -> T {
        l.p(0) * l.x(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef24_acts_and_reacts() {
        let (p, x) = ([0.5, 4.0, 0.1], [0.3, -0.2]);
        let l = Local::new(&p, &x, &[], 0, 1);
        let base = BaseMotion { attitude: 0.1, rate: 0.4, ..BaseMotion::default() };
        let mut dx = [0.0; 2];
        AppendageMode::rates(&l, &DriveTrain { base, ..DriveTrain::default() }, &Spring::default(), &mut dx);
        let torque: f64 = AppendageMode::base(&l, &base).torque;
        // Stiffness J omega^2 = 8, damping 2 J zeta omega = 0.4.
        assert!((torque - (8.0 * 0.2 + 0.4 * -0.6)).abs() < 1e-14);
        assert!((0.5 * dx[1] + torque).abs() < 1e-14);
    }

    #[test]
    fn frequencies_are_sought_from_slow_sloshing_to_a_stiff_panel() {
        let of = |p: &&ParameterSpec| p.name == "appendageFrequency";
        let frequency = AppendageMode::SPEC.parameters.iter().find(of).unwrap();
        // In rad/s: no size of the arm enters.
        let size = frequency.scale.value(|_| f64::NAN);
        let sought: Vec<f64> = frequency.search_in(PlantKind::Arm).looks.iter().map(|l| l * size).collect();
        assert!(
            (sought[0] - 0.3).abs() < 1e-9 && (sought[sought.len() - 1] - 36.0).abs() < 1e-9,
            "{sought:?}"
        );
        assert!(sought.windows(2).all(|w| w[0] < w[1] && w[1] < 2.01 * w[0]), "{sought:?}");
    }
}
