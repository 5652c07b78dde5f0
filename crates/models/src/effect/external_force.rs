//! `external-force`: a push that comes and goes (contact, collision, thruster firing, an input that was not logged).
//!
//! (EF-25) size times E(t - t_0) - E(t - t_0 - d), E being 0 up to 0, (1 - cos(pi s / r)) / 2 during the edge and 1 after
//! it: the impulse is size times the duration d whatever the edge r, and r = 0 is a rectangle. On the actuator it adds to
//! the command, on the load it is a torque, on the tip and the base a force (inertial frame) with a torque.
//!
//! Begin and end of the edges are time events. What it gets wrong: a push that depends on the motion, as a contact does.

use super::*;

pub(crate) struct ExternalForce;

const ACTUATOR: usize = 3;
const LOAD: usize = 0;
const TIP: usize = 1;

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
/// Index of the first time parameter: behind one torque, or a force and a torque.
fn times<T: Scalar>(l: &Local<T>) -> usize {
    if l.place() == LOAD || l.place() == ACTUATOR { 1 } else { 3 }
}
fn shape<T: Scalar>(l: &Local<T>, t: T) -> T {
    let k = times(l);
    let (begin, edge) = (l.p(k), l.p(k + 2));
    risen(l.mode(0), t, begin, edge) - risen(l.mode(1), t, begin + l.p(k + 1), edge)
}
fn wrench<T: Scalar>(l: &Local<T>, t: T) -> Wrench<T> {
    let now = shape(l, t);
    Wrench { force: [l.p(0) * now, l.p(1) * now], torque: l.p(2) * now }
}

const START: ParameterSpec = ParameterSpec {
    name: "start",
    unit: "s",
    description: "When the push begins, t_0 (EF-25)",
    joint_start: 0.3,
    arm_start: 1.0,
    role: Role::Shape,
    scale: Scale::of(0.5, &[(Measure::Duration, 1)]),
    ..ParameterSpec::NONE
};
const DURATION: ParameterSpec = ParameterSpec {
    name: "duration",
    unit: "s",
    description: "From the begin of the first edge to that of the second, d (EF-25)",
    above_min: false,
    joint_start: 0.2,
    arm_start: 1.0,
    scale: Scale::of(0.1, &[(Measure::Duration, 1)]),
    ..ParameterSpec::SHAPE
};
const EDGE: ParameterSpec = ParameterSpec {
    name: "edge",
    unit: "s",
    description: "Length of an edge, r (EF-25); 0: sharp",
    above_min: false,
    joint_start: 0.01,
    arm_start: 0.05,
    log: false,
    scale: Scale::of(0.002, &[(Measure::Duration, 1)]),
    ..ParameterSpec::SHAPE
};
const fn size(
    name: &'static str,
    unit: &'static str,
    start: [f64; 2],
    measure: &'static [(Measure, i32)],
) -> ParameterSpec {
    ParameterSpec {
        name,
        unit,
        description: "Size of the push (EF-25)",
        joint_start: start[0],
        arm_start: start[1],
        scale: Scale::of(0.3, measure),
        ..ParameterSpec::NONE
    }
}
const PUSH_WRENCH: &[ParameterSpec] = &[
    size("forceX", "N", [0.0, 0.5], &[(Measure::Force, 1)]),
    size("forceY", "N", [0.0, 0.0], &[(Measure::Force, 1)]),
    size("torque", "N.m", [0.0, 0.0], &[(Measure::BaseTorque, 1)]),
    START,
    DURATION,
    EDGE,
];
const fn place(
    name: &'static str,
    prefix: &'static str,
    plants: &'static [Plant],
    scope: Scope,
    parameters: &'static [ParameterSpec],
) -> Place {
    Place { name, prefix, component: name, plants, scope, unit: "", parameters }
}

impl Effect for ExternalForce {
    const SPEC: Spec = Spec {
        id: "external-force",
        component: "load",
        summary: "a push that comes and goes (contact, collision, thruster firing, an input that was not logged)",
        scope: Scope::Joint,
        plants: &[Plant::Joint, Plant::Arm],
        modes: 2,
        places: &[
            place(
                "load",
                "loadPush",
                &[Plant::Joint],
                Scope::Joint,
                &[size("torque", "N.m", [5.0, 0.0], &[(Measure::LoadTorque, 1)]), START, DURATION, EDGE],
            ),
            place("tip", "tipPush", &[Plant::Arm], Scope::Once, PUSH_WRENCH),
            place("base", "basePush", &[Plant::Arm], Scope::Once, PUSH_WRENCH),
            place(
                "actuator",
                "actuatorPush",
                &[Plant::Joint, Plant::Arm],
                Scope::Joint,
                &[size("torque", "N.m", [3.0e-4, 0.1], &[(Measure::Torque, 1)]), START, DURATION, EDGE],
            ),
        ],
        ..Spec::NONE
    };

    fn actuator<T: Scalar>(l: &Local<T>, d: &Drive<T>, torque: T) -> T {
        if l.place() == ACTUATOR { torque + l.p(0) * shape(l, d.t) } else { torque }
    }
    fn link_torque<T: Scalar>(l: &Local<T>, d: &Drive<T>) -> T {
        if l.place() == LOAD { l.p(0) * shape(l, d.t) } else { T::zero() }
    }
    fn tip<T: Scalar>(l: &Local<T>, b: &Base<T>) -> Wrench<T> {
        if l.place() == TIP { wrench(l, b.t) } else { Wrench::default() }
    }
    fn base<T: Scalar>(l: &Local<T>, b: &Base<T>) -> Wrench<T> {
        if l.place() == LOAD || l.place() == TIP || l.place() == ACTUATOR {
            Wrench::default()
        } else {
            wrench(l, b.t)
        }
    }
    fn update(l: &Local<f64>, d: &Drive<f64>, modes: &mut [i32]) {
        let k = times(l);
        (modes[0], modes[1]) = (stage(d.t, l.p(k), l.p(k + 2)), stage(d.t, l.p(k) + l.p(k + 1), l.p(k + 2)));
    }
    fn next_event(l: &Local<f64>) -> f64 {
        let k = times(l);
        if (0..k).all(|i| l.p(i) == 0.0) {
            return f64::INFINITY;
        }
        let next = |stage: i32, begin: f64| match stage {
            0 => begin,
            1 => begin + l.p(k + 2),
            _ => f64::INFINITY,
        };
        next(l.mode(0), l.p(k)).min(next(l.mode(1), l.p(k) + l.p(k + 1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef25_the_impulse_is_size_times_duration() {
        for (duration, edge) in [(0.4, 0.1), (0.05, 0.2), (0.3, 0.0)] {
            let p = [5.0, 1.0, duration, edge];
            let (n, span) = (40_000, 2.0);
            let torque = |t: f64| {
                let mut modes = [0, 0];
                let d = Drive { t, ..Drive::default() };
                ExternalForce::update(&Local::new(&p, &[], &[0, 0], 0, 1), &d, &mut modes);
                let l = Local::new(&p, &[], &modes, 0, 1);
                assert!(ExternalForce::next_event(&l) > t);
                ExternalForce::link_torque(&l, &d)
            };
            let impulse: f64 = (0..n)
                .map(|i| torque((f64::from(i) + 0.5) * span / f64::from(n)) * span / f64::from(n))
                .sum();
            assert!((impulse - 5.0 * duration).abs() < 1e-9, "{duration} {edge}: {impulse}");
            assert!(torque(0.9) == 0.0 && torque(1.9) == 0.0 && torque(1.0 + 0.5 * duration) > 0.0);
        }
    }
}
