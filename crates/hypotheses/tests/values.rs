//! Amplitudes as parameters of effects: an effect's law with these values is what its columns add.

use std::f64::consts::PI;

use trueup_hypotheses::innovations::along::PlantAlong;
use trueup_hypotheses::innovations::law::{LawFit, LawValue};
use trueup_hypotheses::innovations::laws::{arm_law_of, law_of};
use trueup_hypotheses::innovations::place::JointPlace;
use trueup_hypotheses::innovations::shape::LawShape;

use crate::columns::along as arm_along;

const GEAR: f64 = 50.0;
const TORQUE: f64 = 0.01;
const STIFFNESS: f64 = 0.2;
const DRY: f64 = 0.012;
const LOAD: f64 = 0.6;
const DURATION: f64 = 8.0;

fn alike(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{a} {b}");
}

fn named(all: Vec<LawValue>) -> impl Fn(&str) -> f64 {
    move |name| all.iter().rev().find(|v| v.name == name).map(|v| v.with_unit(|_| None)).unwrap()
}

/// Of a joint with a gear.
fn of_joint(id: &str, shape: &LawShape, amplitudes: &[f64]) -> impl Fn(&str) -> f64 + use<> {
    let mut along: PlantAlong<'_> = arm_along();
    let joint = JointPlace {
        torque: TORQUE,
        gear_error: 0.05,
        stiffness: STIFFNESS,
        stiffness_name: "stiffness",
        turns: GEAR,
        dry: DRY,
        link_inertia: LOAD,
        ..along.joints[0].clone()
    };
    (along.joints, along.duration, along.base) = (vec![joint], DURATION, None);
    let fit = LawFit { along: &along, shape, joint: 0, channel: None, amplitudes, put_back: false };
    named(law_of(id).unwrap().values(&fit))
}

/// Of the arm whose motion is written down.
fn of_arm(id: &str, shape: &LawShape, amplitudes: &[f64]) -> impl Fn(&str) -> f64 + use<> {
    let along = arm_along();
    let fit = LawFit { along: &along, shape, joint: 0, channel: None, amplitudes, put_back: false };
    named(arm_law_of(id, shape.place).unwrap().values(&fit))
}

#[test]
fn friction_that_drifts_is_that_of_the_columns() {
    for (time, a) in [(3.0, 0.6), (3.0, -0.4), (0.0, 0.5), (0.0, -0.5)] {
        let of =
            of_joint("friction-drift", &LawShape::new("motor-friction", "time", &[("time", time)]), &[a]);
        let (rate, settles) = (of("frictionDriftRate"), of("frictionDriftTime"));
        for t in [0.0, 1.0, 5.0, 8.0] {
            let course = if time > 0.0 { f64::exp(-t / time) } else { t / DURATION - 0.5 };
            let columns = DRY * (1.0 + a * course);
            let grown = if time > 0.0 { settles * (1.0 - f64::exp(-t / settles)) } else { t };
            alike(of("coulombFriction") * (1.0 + rate * grown), columns);
        }
    }
}

#[test]
fn a_spring_of_two_slopes_is_that_of_the_columns() {
    let (a, bend) = ([-0.5, 0.3], 0.04);
    let of = of_joint("nonlinear-stiffness", &LawShape::new("transmission", "slopes", &[("bend", bend)]), &a);
    for x in [-0.2f64, -0.04, 0.01, 0.039, 0.3] {
        let columns = STIFFNESS * (x + a[0] * x.clamp(-bend, bend) + a[1] * x);
        let beyond = x.signum() * (x.abs() - of("kneeDeflection")).max(0.0);
        alike(of("stiffness") * x + of("kneeStiffness") * beyond, columns);
    }
    // One without a slope inside is play: outside it has the same slope and the same zero.
    let free = of_joint("backlash", &LawShape::new("transmission", "gap", &[("gap", 0.08)]), &[-1.3, 0.3]);
    alike(free("stiffness") * (0.3 - 0.5 * free("backlashGap")), STIFFNESS * (1.3 * 0.3 - 1.3 * 0.04));
}

#[test]
fn weight_tips_and_pushes_are_those_of_the_columns() {
    let of = of_joint("gravity-torque", &LawShape::new("load", "weight", &[]), &[-0.3, 0.8]);
    for q in [-2.0f64, 0.1, 1.4] {
        let columns = TORQUE * GEAR * (-0.3 * q.sin() + 0.8 * q.cos());
        alike(-of("gravityTorque") * (q - of("gravityAngle")).sin(), columns);
    }
    // Motor and load free, tip and hub swing against each other at the pole; together they are the load.
    let of = of_joint("flexible-link", &LawShape::new("load", "pole", &[("f", 7.0), ("z", 0.03)]), &[0.25]);
    let (tip, hub) = (of("tipInertia"), of("loadInertia"));
    alike(tip + hub, LOAD);
    alike((of("linkStiffness") * (1.0 / tip + 1.0 / hub)).sqrt(), 2.0 * PI * 7.0);
    alike(tip / hub, 0.25);
    // The largest three of four, in the order of their times.
    let pulses = vec![[3.0, 0.4], [1.0, 0.2], [5.0, 0.6], [2.0, 0.1]];
    let shape = LawShape { pulses, ..LawShape::new("load", "pulses", &[]) };
    let of = of_joint("external-force", &shape, &[1.0, -2.0, 0.5, 0.1]);
    assert_eq!(["start", "secondStart", "thirdStart"].map(&of), [1.0, 3.0, 5.0]);
    let risen = |s: f64, edge: f64| match s / edge {
        x if x <= 0.0 => 0.0,
        x if x >= 1.0 => 1.0,
        x => 0.5 * (1.0 - (PI * x).cos()),
    };
    for t in [2.9f64, 3.05, 3.2, 3.39, 3.5] {
        let since = t - of("secondStart");
        let edge = of("secondEdge");
        let push = of("secondTorque") * (risen(since, edge) - risen(since - of("secondDuration"), edge));
        let inside = t > 3.0 && t < 3.4;
        let columns = if inside { 0.5 * (1.0 - (2.0 * PI * (t - 3.0) / 0.4).cos()) } else { 0.0 };
        alike(push, TORQUE * GEAR * columns);
    }
}

/// Impulses of single recordings: each recording has its largest, with both forces of the tip.
#[test]
fn each_recording_has_its_own_push() {
    let pulses = vec![[0.5, 0.2], [0.9, 0.2], [0.3, 0.4]];
    let shape = LawShape { pulses, only: vec![1, 0, 1], ..LawShape::new("tip", "pulses", &[]) };
    let along = arm_along();
    let amplitudes = [1.0, -1.0, 0.5, 0.2, 2.0, 3.0];
    let fit = LawFit {
        along: &along,
        shape: &shape,
        joint: 0,
        channel: None,
        amplitudes: &amplitudes,
        put_back: false,
    };
    let values = arm_law_of("external-force", "tip").unwrap().values(&fit);
    let unit = along.tip_unit();
    let of = |recording: usize, name: &str| {
        let mine = values.iter().filter(|v| v.recording == Some(recording) && v.name == name);
        mine.map(|v| v.value).collect::<Vec<_>>()
    };
    assert_eq!([of(0, "start"), of(1, "start")], [vec![0.9], vec![0.3]]);
    assert_eq!([of(0, "forceX"), of(1, "forceY")], [vec![0.5 * unit], vec![3.0 * unit]]);
}

/// Forces of the base by the effects' equations (EF-9, EF-22, EF-23) are those of the columns.
#[test]
fn wrenches_on_a_base_are_those_of_the_columns() {
    let along = arm_along();
    let base = along.base.as_ref().unwrap();
    let at = [0.23, -0.17, 0.4];
    // A cable whose potential is that of one spring.
    let width = base.reach[0].max(base.reach[1]);
    let amplitudes = [0.3, -0.2, 0.1, 0.6, 0.0, 0.0, 0.8, 0.8, 0.0];
    let of = of_arm("cable-stiffness", &LawShape::new("base", "potential", &[("n", 1.0)]), &amplitudes);
    for (axis, name) in ["cablePositionX", "cablePositionY"].into_iter().enumerate() {
        let x = (at[axis] - base.middle[axis]) / width;
        let columns = 0.1 * base.force[axis] * (amplitudes[axis] - 0.8 * x);
        alike(-of("cableStiffness") * (at[axis] - of(name)), columns);
    }
    let turned = (at[2] - base.middle[2]) / base.reach[2];
    let columns = 0.1 * base.force[2] * (0.1 - 0.6 * turned);
    alike(-of("cableRotationalStiffness") * (at[2] - of("cableAttitude")), columns);
    // A thrust in the axes of the ground at the base's middle attitude, and in its own axes.
    for form in ["ground", "body"] {
        let of = of_arm("base-thrust", &LawShape::new("base", form, &[]), &[0.7, -0.4, 0.2]);
        let (sin, cos) = (if form == "ground" { base.middle[2] } else { 0.0f64 }).sin_cos();
        let [x, y] = ["thrustForceX", "thrustForceY"].map(&of);
        alike(cos * x - sin * y, 0.1 * base.force[0] * 0.7);
        alike(sin * x + cos * y, 0.1 * base.force[1] * -0.4);
    }
    // Drag is that of the usual speed.
    let usual = base.speed[0].max(base.speed[1]);
    let shape = LawShape::new("base", "viscous", &[("v0", 0.0), ("p", 2.0)]);
    let of = of_arm("base-drag", &shape, &[0.5, 0.25]);
    alike(of("baseDrag") * usual, 0.3 * 0.5 * base.force[0]);
    alike(of("baseRotationalDrag") * base.speed[2], 0.3 * 0.25 * base.force[2]);
}

/// The line and the cube of a spring are nearest to its other powers up to the usual twist: what is left is orthogonal to both.
#[test]
fn a_spring_of_powers_is_nearest_to_that_of_the_columns() {
    let joint = &arm_along().joints[0];
    let (k, w) = (joint.stiffness, joint.twist);
    for a in [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.4, -0.2, 0.3, 0.1]] {
        let of = of_arm("nonlinear-stiffness", &LawShape::new("transmission", "power", &[]), &a);
        let left = |x: f64| {
            let columns = k * w * ((1.0 + a[3]) * x + a[0] * x * x + a[1] * x.powi(3) + a[2] * x.powi(5));
            columns - (of("jointStiffness") * w * x + of("cubicStiffness") * (w * x).powi(3))
        };
        for p in [1, 3] {
            let n = 20_000;
            let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
            let product: f64 = (0..n).map(|i| left(at(i)) * at(i).powi(p)).sum::<f64>() / f64::from(n);
            assert!(product.abs() < 1e-7 * k * w, "{a:?} {p}: {product}");
        }
    }
}

/// Two equal lags and a lag with a dead time: the same mean delay and the same spread. Friction that falls with speed is friction.
#[test]
fn other_laws_of_an_effect_have_its_nearest_parameters() {
    let of = of_arm("actuator-lag", &LawShape::new("actuator", "two", &[("two", 0.04)]), &[1.0]);
    alike(of("actuatorLag") + of("actuatorDelay"), 0.04);
    alike(of("actuatorLag").powi(2), 2.0 * 0.02f64.powi(2));
    let falling = arm_law_of("stribeck-friction", "motor-friction").unwrap();
    let shape = LawShape::new("motor-friction", "stribeck", &[("speed", 0.1), ("k", 1.0), ("x", 1e-3)]);
    assert_eq!(falling.cause(&shape), "motor-friction");
    let of = of_arm("stribeck-friction", &shape, &[0.4, 0.1, 0.1, 0.0, 0.3]);
    let joint = &arm_along().joints[0];
    alike(of("coulombFriction"), 0.1 * joint.torque * 0.5);
    alike(of("preslidingDisplacement"), 1e-3);
    // The order of a motor's coordinate is one of its rotor, which turns more often.
    let of =
        of_arm("torque-ripple", &LawShape::new("actuator", "order", &[("h", 200.0)]), &[0.5, 0.0, 0.0, 0.0]);
    alike(of("rippleOrder"), 200.0 / joint.rotor_turns);
    alike(of("rippleSine"), 0.5 * 0.3 * joint.torque);
}
