//! `external-force`: a push that comes and goes (contact, collision, thruster firing, an input that was not logged).
//!
//! (EF-25) size times E(t - t_0) - E(t - t_0 - d), E being 0 up to 0, (1 - cos(pi s / r)) / 2 during the edge and 1 after
//! it: the impulse is size times the duration d whatever the edge r, and r = 0 is a rectangle. On the actuator it adds to
//! the command, on the load it is a torque, on the tip and the base a force (inertial frame) with a torque, of three components
//! each in space. Up to three impulses add up; the sizes of the second and the third are 0 unless they are set.
//!
//! Begin and end of the edges are time events. What it gets wrong: a push that depends on the motion, as a contact does.

use super::*;

pub(crate) struct ExternalForce;

/// The largest number of impulses.
pub const PUSHES: usize = 3;
/// Times of a push.
const TIMES: usize = 3;

const ACTUATOR: usize = 3;
const LOAD: usize = 0;
const TIP: usize = 1;
const SPACE_TIP: usize = 4;
const SPACE_BASE: usize = 5;

/// How far an edge that begins at `begin` has come: 0, 1 on it, 2 behind it.
fn stage(t: f64, begin: f64, edge: f64) -> i32 {
    if t >= begin + edge { 2 } else { i32::from(t >= begin) }
}
fn risen<T: Scalar>(stage: i32, t: T, begin: T, edge: T) -> T {
    match stage {
        0 => T::zero(),
        1 => (-((t - begin) / edge * core::f64::consts::PI).cos() + 1.0) * 0.5,
        _ => T::one(),
    }
}
/// How many sizes a push has: one torque, or a force and a torque.
fn sizes<T: Scalar>(l: &Local<T>) -> usize {
    match l.place() {
        LOAD | ACTUATOR => 1,
        SPACE_TIP | SPACE_BASE => 6,
        _ => 3,
    }
}
/// Index of the first parameter of push `n`, and of its times.
fn parameters<T: Scalar>(l: &Local<T>, n: usize) -> (usize, usize) {
    let first = n * (sizes(l) + TIMES);
    (first, first + sizes(l))
}
fn shape<T: Scalar>(l: &Local<T>, t: T, n: usize) -> T {
    let (_, k) = parameters(l, n);
    let (begin, edge) = (l.p(k), l.p(k + 2));
    risen(l.mode(2 * n), t, begin, edge) - risen(l.mode(2 * n + 1), t, begin + l.p(k + 1), edge)
}
/// Size `i` of all impulses together.
fn sum<T: Scalar>(l: &Local<T>, t: T, i: usize) -> T {
    (0..PUSHES).fold(T::zero(), |sum, n| sum + l.p(parameters(l, n).0 + i) * shape(l, t, n))
}
fn wrench<T: Scalar>(l: &Local<T>, t: T) -> BaseWrench<T> {
    BaseWrench { force: [sum(l, t, 0), sum(l, t, 1)], torque: sum(l, t, 2) }
}

fn space_wrench<T: Scalar>(l: &Local<T>, t: T) -> SpatialWrench<T> {
    SpatialWrench { force: [0, 1, 2].map(|i| sum(l, t, i)), torque: [3, 4, 5].map(|i| sum(l, t, i)) }
}

/// What the parameters of each push are called; the second and the third are neutral from the start.
const NAMES: [[&str; 10]; PUSHES] = [
    ["forceX", "forceY", "torque", "start", "duration", "edge", "forceZ", "torqueX", "torqueY", "torqueZ"],
    [
        "secondForceX",
        "secondForceY",
        "secondTorque",
        "secondStart",
        "secondDuration",
        "secondEdge",
        "secondForceZ",
        "secondTorqueX",
        "secondTorqueY",
        "secondTorqueZ",
    ],
    [
        "thirdForceX",
        "thirdForceY",
        "thirdTorque",
        "thirdStart",
        "thirdDuration",
        "thirdEdge",
        "thirdForceZ",
        "thirdTorqueX",
        "thirdTorqueY",
        "thirdTorqueZ",
    ],
];
const fn times(n: usize) -> [ParameterSpec; TIMES] {
    let start = ParameterSpec {
        name: NAMES[n][3],
        unit: "s",
        description: "When the push begins, t_0 (EF-25)",
        joint_start: 0.3,
        arm_start: 1.0,
        role: ParameterRole::Shape,
        scale: EffectScale::of(0.5, &[(Measure::Duration, 1)]),
        ..ParameterSpec::NONE
    };
    let duration = ParameterSpec {
        name: NAMES[n][4],
        unit: "s",
        description: "From the begin of the first edge to that of the second, d (EF-25)",
        above_min: false,
        joint_start: 0.2,
        arm_start: 1.0,
        scale: EffectScale::of(0.1, &[(Measure::Duration, 1)]),
        ..ParameterSpec::SHAPE
    };
    let edge = ParameterSpec {
        name: NAMES[n][5],
        unit: "s",
        description: "Length of an edge, r (EF-25); 0: sharp",
        above_min: false,
        joint_start: 0.01,
        arm_start: 0.05,
        log: false,
        scale: EffectScale::of(0.002, &[(Measure::Duration, 1)]),
        ..ParameterSpec::SHAPE
    };
    [start, duration, edge]
}
/// A size of an impulse: which of [`NAMES`], the first impulse's start value on the joint and on the arm, the value
/// measured by.
struct Size {
    name: usize,
    unit: &'static str,
    start: [f64; 2],
    measure: &'static [(Measure, i32)],
}

/// The parameters of all impulses, `N` of them, with `S` sizes each.
const fn pushes<const S: usize, const N: usize>(sizes: [Size; S]) -> [ParameterSpec; N] {
    let each = S + TIMES;
    assert!(N == PUSHES * each, "sizes and times of all impulses");
    let mut all = [ParameterSpec::NONE; N];
    let mut i = 0;
    while i < N {
        let (n, k) = (i / each, i % each);
        all[i] = if k < S { size(&sizes[k], n) } else { times(n)[k - S] };
        i += 1;
    }
    all
}
const fn size(s: &Size, n: usize) -> ParameterSpec {
    let [joint_start, arm_start] = if n == 0 { s.start } else { [0.0; 2] };
    ParameterSpec {
        name: NAMES[n][s.name],
        unit: s.unit,
        description: "Size of the push (EF-25)",
        joint_start,
        arm_start,
        scale: EffectScale::of(0.3, s.measure),
        ..ParameterSpec::NONE
    }
}
const fn torque(start: [f64; 2], measure: &'static [(Measure, i32)]) -> Size {
    Size { name: 2, unit: "N.m", start, measure }
}
const fn force(name: usize, start: [f64; 2]) -> Size {
    Size { name, unit: "N", start, measure: &[(Measure::Force, 1)] }
}
const LOAD_PUSHES: [ParameterSpec; 12] = pushes([torque([5.0, 0.0], &[(Measure::LoadTorque, 1)])]);
const ACTUATOR_PUSHES: [ParameterSpec; 12] = pushes([torque([3.0e-4, 0.1], &[(Measure::Torque, 1)])]);
const WRENCHES: [ParameterSpec; 18] =
    pushes([force(0, [0.0, 0.5]), force(1, [0.0; 2]), torque([0.0; 2], &[(Measure::BaseTorque, 1)])]);

const fn about(name: usize) -> Size {
    Size { name, unit: "N.m", start: [0.0; 2], measure: &[(Measure::BaseTorque, 1)] }
}
const SPACE_WRENCHES: [ParameterSpec; 27] =
    pushes([force(0, [0.0, 0.5]), force(1, [0.0; 2]), force(6, [0.0; 2]), about(7), about(8), about(9)]);

const fn place(
    name: &'static str,
    prefix: &'static str,
    plants: &'static [PlantKind],
    scope: Scope,
    parameters: &'static [ParameterSpec],
) -> EffectPlace {
    EffectPlace { name, prefix, component: name, plants, scope, unit: "", parameters }
}

impl Effect for ExternalForce {
    const SPEC: Spec = Spec {
        id: "external-force",
        component: "load",
        summary: "a push that comes and goes (contact, collision, thruster firing, an input that was not logged)",
        noun: "an unrecorded push from outside",
        check: "Look at video or notes of the times of the largest residuals: contact, a collision, a thruster, a hand, an input that was not logged?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        modes: 2 * PUSHES,
        pulses: PUSHES,
        places: &[
            place("load", "loadPush", &[PlantKind::Joint], Scope::Joint, &LOAD_PUSHES),
            place("tip", "tipPush", &[PlantKind::Arm], Scope::Once, &WRENCHES),
            place("base", "basePush", &[PlantKind::Arm], Scope::Once, &WRENCHES),
            place(
                "actuator",
                "actuatorPush",
                &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
                Scope::Joint,
                &ACTUATOR_PUSHES,
            ),
            place("tip", "tipPush", &[PlantKind::Space], Scope::Once, &SPACE_WRENCHES),
            place("base", "basePush", &[PlantKind::Space], Scope::Once, &SPACE_WRENCHES),
        ],
        ..Spec::NONE
    };

    fn actuator<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, torque: T) -> T {
        if l.place() == ACTUATOR { torque + sum(l, d.t, 0) } else { torque }
    }
    fn link_torque<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> T {
        if l.place() == LOAD { sum(l, d.t, 0) } else { T::zero() }
    }
    fn tip<T: Scalar>(l: &Local<T>, b: &BaseMotion<T>) -> BaseWrench<T> {
        if l.place() == TIP { wrench(l, b.t) } else { BaseWrench::default() }
    }
    fn base<T: Scalar>(l: &Local<T>, b: &BaseMotion<T>) -> BaseWrench<T> {
        if l.place() == LOAD || l.place() == TIP || l.place() == ACTUATOR {
            BaseWrench::default()
        } else {
            wrench(l, b.t)
        }
    }
    fn space_tip<T: Scalar>(l: &Local<T>, b: &FlyerBase<T>) -> SpatialWrench<T> {
        if l.place() == SPACE_TIP { space_wrench(l, b.t) } else { SpatialWrench::zero() }
    }
    fn space_base<T: Scalar>(l: &Local<T>, b: &FlyerBase<T>) -> SpatialWrench<T> {
        if l.place() == SPACE_BASE { space_wrench(l, b.t) } else { SpatialWrench::zero() }
    }
    fn update(l: &Local<f64>, d: &DriveTrain<f64>, modes: &mut [i32]) {
        for n in 0..PUSHES {
            let (_, k) = parameters(l, n);
            modes[2 * n] = stage(d.t, l.p(k), l.p(k + 2));
            modes[2 * n + 1] = stage(d.t, l.p(k) + l.p(k + 1), l.p(k + 2));
        }
    }
    fn next_event(l: &Local<f64>) -> f64 {
        let of = |n: usize| {
            let (first, k) = parameters(l, n);
            if (first..k).all(|i| l.p(i) == 0.0) {
                return f64::INFINITY;
            }
            let next = |stage: i32, begin: f64| match stage {
                0 => begin,
                1 => begin + l.p(k + 2),
                _ => f64::INFINITY,
            };
            next(l.mode(2 * n), l.p(k)).min(next(l.mode(2 * n + 1), l.p(k) + l.p(k + 1)))
        };
        (0..PUSHES).map(of).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Torque of the load over time, from impulses as parameters.
    fn torque(p: &[f64], t: f64) -> f64 {
        let mut modes = [0; 2 * PUSHES];
        let d = DriveTrain { t, ..DriveTrain::default() };
        ExternalForce::update(&Local::new(p, &[], &[0; 2 * PUSHES], 0, 1), &d, &mut modes);
        let l = Local::new(p, &[], &modes, 0, 1);
        assert!(ExternalForce::next_event(&l) > t);
        ExternalForce::link_torque(&l, &d)
    }
    fn impulse(p: &[f64], until: f64) -> f64 {
        let n = 40_000;
        let h = until / f64::from(n);
        (0..n).map(|i| torque(p, (f64::from(i) + 0.5) * h) * h).sum()
    }

    #[test]
    fn ef25_the_impulse_is_size_times_duration() {
        for (duration, edge) in [(0.4, 0.1), (0.05, 0.2), (0.3, 0.0)] {
            let mut p = [0.0; 12];
            p[..4].copy_from_slice(&[5.0, 1.0, duration, edge]);
            let all = impulse(&p, 2.0);
            assert!((all - 5.0 * duration).abs() < 1e-9, "{duration} {edge}: {all}");
            assert!(
                torque(&p, 0.9) == 0.0 && torque(&p, 1.9) == 0.0 && torque(&p, 1.0 + 0.5 * duration) > 0.0
            );
        }
    }

    #[test]
    fn ef25_pushes_add_up() {
        let p = [5.0, 1.0, 0.4, 0.1, -2.0, 1.2, 0.3, 0.0, 1.0, 1.6, 0.2, 0.05];
        let all = impulse(&p, 2.0);
        assert!((all - (5.0 * 0.4 - 2.0 * 0.3 + 0.2)).abs() < 1e-9, "{all}");
        assert_eq!(torque(&p, 1.3), 3.0);
    }
}
