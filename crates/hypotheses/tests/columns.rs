//! Columns of effects on a plant whose motion is written down here: coordinates are parabolas of time, so that positions at the
//! middles of parts are exact. Checks COL-1, COL-3, COL-4, COL-5, COL-6, COL-7, COL-8, COL-9, COL-10, COL-11, COL-12, COL-13, COL-14,
//! COL-15, COL-17, COL-18, COL-19, COL-20, COL-21, COL-22, COL-23, COL-24, COL-25; of the drive COL-2, of tangents COL-26.

use std::f64::consts::PI;
use std::rc::Rc;

use trueup_estimation::innovations::column::ColumnPart;
use trueup_hypotheses::innovations::along::PlantAlong;
use trueup_hypotheses::innovations::drive::DriveAlong;
use trueup_hypotheses::innovations::laws::{ARM_LAWS, arm_law_of};
use trueup_hypotheses::innovations::mechanics::{ChainMechanics, HingeAlong};
use trueup_hypotheses::innovations::operator::resonance;
use trueup_hypotheses::innovations::place::{BasePlace, ChannelPlace, JointPlace, MotionInStep, ShownBy};
use trueup_hypotheses::innovations::run_along::RunAlong;
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_hypotheses::innovations::slope::as_matrices;
use trueup_hypotheses::innovations::spectrum::OrderPeaks;

const NODES: usize = 80;
const STEP: f64 = 0.02;
const PARTS: usize = 4;
const STIFFNESS: f64 = 12.0;
const DAMPING: f64 = 0.3;
const TORQUE: f64 = 0.7;
const SPEED: f64 = 1.1;
const TWIST: f64 = 0.05;
const RATE: f64 = 0.2;
const FORCE: f64 = 1.4;
/// Coordinates: base x, y, attitude; link and motor of a joint with a spring; a rigid joint.
const MOTION: [[f64; 3]; 6] = [
    [0.1, 0.05, -0.04],
    [-0.2, -0.03, 0.05],
    [0.2, -0.3, 0.2],
    [0.1, 0.4, -0.3],
    [0.16, 0.2, -0.15],
    [-0.2, 0.3, 0.1],
];
const BASE: usize = 0;
const LINK: usize = 3;
const MOTOR: usize = 4;

fn position(c: usize, t: f64) -> f64 {
    let [a, b, d] = MOTION[c];
    a + b * t + d * t * t
}
fn rate(c: usize, t: f64) -> f64 {
    MOTION[c][1] + 2.0 * MOTION[c][2] * t
}
fn twist(t: f64) -> f64 {
    position(MOTOR, t) - position(LINK, t)
}
fn twist_rate(t: f64) -> f64 {
    rate(MOTOR, t) - rate(LINK, t)
}
fn torque(t: f64) -> f64 {
    (7.0 * t).sin()
}
fn moment(k: usize) -> f64 {
    (k / PARTS) as f64 * STEP + STEP * ((k % PARTS) as f64 + 0.5) / PARTS as f64
}

struct Levers;

impl ChainMechanics for Levers {
    fn field(&self, _: usize, axis: usize) -> Option<Vec<Vec<f64>>> {
        Some((0..MOTION.len()).map(|c| vec![(c + 10 * axis) as f64; NODES]).collect())
    }
    fn tip(&self, _: usize, axis: usize) -> Option<Rc<Vec<Vec<f64>>>> {
        Some(Rc::new((0..MOTION.len()).map(|c| vec![(c * (axis + 1)) as f64; NODES]).collect()))
    }
    fn hinge(&self, _: usize, _: usize, _: f64) -> Option<Rc<HingeAlong>> {
        Some(Rc::new(HingeAlong {
            torque: (0..NODES).map(|t| torque(t as f64 * STEP)).collect(),
            mobility: vec![2.0; NODES],
            inertia: (0..MOTION.len()).map(|c| vec![c as f64; NODES]).collect(),
            tip: [0.5, 0.25, 1.0].map(|j| vec![j; NODES]),
        }))
    }
}

fn joint(motor: usize, link: usize) -> JointPlace {
    let spring = if motor == link { [0.0; 2] } else { [STIFFNESS, DAMPING] };
    JointPlace {
        stiffness_name: "jointStiffness",
        link_inertia: 0.0,
        motor,
        link,
        torque: TORQUE,
        gear_error: 1e-3,
        stiffness: spring[0],
        damping: spring[1],
        least_damping: spring[1],
        turns: 1.0,
        rotor_turns: 100.0,
        dry: 0.0,
        viscous: 0.0,
        resolution: 0.0,
        motor_read: true,
        drive: 1.0,
        motor_speed: SPEED,
        link_speed: SPEED,
        twist: TWIST,
        twist_rate: RATE,
        range: 1.0,
        reach: [0.15, 0.4],
    }
}

pub(crate) fn along() -> PlantAlong<'static> {
    let channel = |shows| ChannelPlace { place: "sensor", shows, error: 0.01, turns: 1.0, compared: true };
    let channels =
        vec![channel(ShownBy::Position(LINK)), channel(ShownBy::Position(MOTOR)), channel(ShownBy::Tip(1))];
    let times: Vec<f64> = (0..NODES).map(|t| t as f64 * STEP).collect();
    let series = |f: fn(usize, f64) -> f64| {
        (0..MOTION.len()).map(|c| times.iter().map(|t| f(c, *t)).collect()).collect::<Vec<Vec<f64>>>()
    };
    let means: Vec<f64> = (0..NODES * PARTS).map(|k| torque(moment(k))).collect();
    let drive = || DriveAlong::recorded(1.0, means.clone(), STEP / PARTS as f64, None);
    let constant = |c: usize| [vec![2.0 * MOTION[c][2]; NODES], vec![2.0 * MOTION[c][2]; NODES]];
    let mut run = RunAlong::new(times.clone(), vec![STEP; NODES], PARTS, series(position), series(rate));
    run.accelerations = (0..MOTION.len()).map(constant).collect();
    run.moments = vec![vec![0.003; NODES]; channels.len()];
    run.shown = vec![Vec::new(), Vec::new(), times.iter().map(|t| t.powi(3)).collect()];
    run.drives = vec![drive(), drive()];
    let joints = vec![joint(MOTOR, LINK), joint(5, 5)];
    let mut along = PlantAlong::new(MotionInStep::Curved, joints, channels, vec![run]);
    along.mechanics = Some(&Levers);
    along.base = Some(BasePlace {
        coordinates: [BASE, 1, 2],
        force: [FORCE, FORCE, TORQUE],
        speed: [0.1, 0.2, 0.4],
        middle: [0.1, 0.0, 0.1],
        reach: [0.2, 0.3, 0.5],
        mass: 40.0,
        inertia: 3.0,
    });
    along
}

/// Series of all parts on a coordinate or channel.
fn sum(series: &[trueup_estimation::innovations::column::WeightedSeries], on: usize) -> Vec<f64> {
    let mut sum = vec![0.0; NODES];
    for s in series.iter().filter(|s| s.on == on) {
        sum.iter_mut().zip(s.values.iter()).for_each(|(x, v)| *x += s.weight * v);
    }
    sum
}

fn part(id: &str, shape: &LawShape, amplitude: usize) -> ColumnPart {
    let law = arm_law_of(id, shape.place).unwrap();
    law.terms(&along(), shape).unwrap().applied.columns[amplitude][0].clone()
}

/// All but the last step, which has no end.
fn same(what: &str, own: &[f64], expected: &[f64], tolerance: f64) {
    let size = expected.iter().fold(1e-12, |m: f64, v| m.max(v.abs()));
    for t in 0..NODES - 1 {
        let off = (own[t] - expected[t]).abs();
        assert!(off <= tolerance * size, "{what} at node {t}: {}, expected {}", own[t], expected[t]);
    }
}

/// The force of a law on a coordinate is the mean over each step of `expected` of time.
fn acts(id: &str, shape: &LawShape, amplitude: usize, on: usize, expected: impl Fn(f64) -> f64) {
    let mean =
        |t: usize| (PARTS * t..PARTS * (t + 1)).map(|k| expected(moment(k))).sum::<f64>() / PARTS as f64;
    let expected: Vec<f64> = (0..NODES).map(mean).collect();
    assert!(expected.iter().any(|x| *x != 0.0), "{id}: nothing is expected");
    let own = sum(&part(id, shape, amplitude).forces, on);
    same(&format!("{id} {:?} {amplitude} on {on}", shape.form), &own, &expected, 1e-9);
}

/// In the spring: plus on the link, minus on the motor.
fn in_spring(id: &str, shape: &LawShape, amplitude: usize, expected: impl Fn(f64, f64) -> f64) {
    acts(id, shape, amplitude, LINK, |t| expected(twist(t), twist_rate(t)));
    acts(id, shape, amplitude, MOTOR, |t| -expected(twist(t), twist_rate(t)));
}

/// Dahl's operator along a coordinate by small steps of its equation, at the moments.
fn slipping(x: impl Fn(f64) -> f64, length: f64) -> Vec<f64> {
    const FINE: usize = 2000;
    let mut z: f64 = 0.0;
    let mut all = vec![0.0];
    for k in 1..NODES * PARTS {
        let (a, b) = (moment(k - 1), moment(k));
        // From one moment to the next a law sees no turn within.
        let rise = (x(b) - x(a)) / FINE as f64 / length;
        (0..FINE).for_each(|_| z += rise - rise.abs() * z);
        all.push(z);
    }
    all
}

fn means(values: &[f64]) -> Vec<f64> {
    values.chunks(PARTS).map(|c| c.iter().sum::<f64>() / PARTS as f64).collect()
}

fn shape(place: &'static str, form: &'static str, values: &[(&'static str, f64)]) -> LawShape {
    LawShape::new(place, form, values).at(&[0])
}

#[test]
fn friction_slips_over_its_lengths() {
    let s = shape("motor-friction", "length", &[("x", 0.02)]);
    let z = slipping(|t| position(MOTOR, t), 0.02);
    let level: Vec<f64> = means(&z).iter().map(|z| -0.1 * TORQUE * z).collect();
    same("dry", &sum(&part("motor-friction", &s, 0).forces, MOTOR), &level, 1e-3);
    acts("motor-friction", &s, 1, MOTOR, |t| -0.3 * TORQUE * rate(MOTOR, t) / SPEED);
    let longer: Vec<f64> =
        means(&slipping(|t| position(MOTOR, t), 0.08)).iter().map(|z| -0.1 * TORQUE * z).collect();
    same("longer", &sum(&part("motor-friction", &s, 2).forces, MOTOR), &longer, 1e-3);

    let s = shape("motor-friction", "stribeck", &[("x", 0.02), ("speed", 0.1), ("k", 1.0)]);
    let falls = |(k, z): (usize, &f64)| -0.1 * TORQUE * z * (-rate(MOTOR, moment(k)).abs() / 0.1).exp();
    let falls: Vec<f64> = z.iter().enumerate().map(falls).collect();
    same("Stribeck", &sum(&part("stribeck-friction", &s, 4).forces, MOTOR), &means(&falls), 1e-3);

    let s = shape("load", "length", &[("x", 0.02)]);
    let z = slipping(|t| position(LINK, t), 0.02);
    let level: Vec<f64> = means(&z).iter().map(|z| -0.1 * TORQUE * z).collect();
    same("load", &sum(&part("load-friction", &s, 0).forces, LINK), &level, 1e-3);

    let z = slipping(|t| position(MOTOR, t), 1e-3);
    let by = |f: &dyn Fn(f64, f64) -> f64| {
        means(&z.iter().enumerate().map(|(k, z)| f(*z, moment(k))).collect::<Vec<_>>())
    };
    let s = shape("motor-friction", "", &[("x", 1e-3), ("time", 0.5)]);
    let own = |id| sum(&part(id, &s, 0).forces, MOTOR);
    same("asymmetry", &own("asymmetric-friction"), &by(&|z, _| -0.1 * TORQUE * z.abs()), 1e-3);
    same("by load", &own("load-dependent-friction"), &by(&|z, t| -z * torque(t).abs()), 1e-3);
    same("by time", &own("friction-drift"), &by(&|z, t| -0.1 * TORQUE * z * (-t / 0.5).exp()), 1e-3);
    let s = shape("motor-friction", "power", &[("p", 2.0)]);
    acts("nonlinear-viscous-friction", &s, 0, MOTOR, |t| {
        let v = rate(MOTOR, t);
        -0.3 * TORQUE * v * v.abs() / (SPEED * SPEED)
    });
}

#[test]
fn laws_of_the_spring_are_functions_of_its_twist() {
    let gap = 0.04;
    let s = shape("transmission", "gap", &[("gap", gap)]);
    let beyond = |w: f64| (w.abs() - 0.5 * gap).max(0.0);
    in_spring("backlash", &s, 0, |w, r| {
        let damped = if w.abs() < 0.5 * gap { DAMPING * r } else { 0.0 };
        STIFFNESS * (w.signum() * beyond(w) - w) - damped
    });
    in_spring("backlash", &s, 1, |w, r| {
        if beyond(w) > 0.0 { -DAMPING * r * (-beyond(w) / (0.15 * TWIST)).exp() } else { 0.0 }
    });
    let s = shape("transmission", "power", &[]);
    for (k, p) in [1, 2, 4, 0].into_iter().enumerate() {
        in_spring("nonlinear-stiffness", &s, k, |w, _| STIFFNESS * w * (w / TWIST).abs().powi(p));
    }
    let s = shape("transmission", "knees", &[("b", 0.01), ("b2", 0.002)]);
    in_spring("nonlinear-stiffness", &s, 0, |w, _| STIFFNESS * (w - 0.01).max(0.0));
    in_spring("nonlinear-stiffness", &s, 1, |w, _| STIFFNESS * (w + 0.002).min(0.0));
    let s = shape("transmission", "power", &[("p", 1.5), ("x", 0.03)]);
    let power = |r: f64| DAMPING * RATE * r.signum() * (r.abs() / RATE).powf(1.5);
    in_spring("nonlinear-damping", &s, 0, |_, r| power(r));
    in_spring("nonlinear-damping", &s, 1, |w, r| power(r) * w * w / (w * w + 9e-4));
    let s = shape("transmission", "length", &[("x", 0.01)]);
    let z: Vec<f64> = means(&slipping(twist, 0.01)).iter().map(|z| 0.1 * TORQUE * z).collect();
    same("hysteresis", &sum(&part("transmission-hysteresis", &s, 0).forces, LINK), &z, 1e-3);
    let s = shape("transmission", "order", &[("h", 30.0)]);
    let error = |t: f64| {
        let (sin, cos) = (30.0 * position(MOTOR, t)).sin_cos();
        (1e-3 * (STIFFNESS * sin + DAMPING * 30.0 * rate(MOTOR, t) * cos), 1e-3 * 30.0 * cos)
    };
    acts("kinematic-error", &s, 0, LINK, |t| error(t).0);
    let spring = |t: f64| STIFFNESS * twist(t) + DAMPING * twist_rate(t);
    acts("kinematic-error", &s, 0, MOTOR, |t| -error(t).0 - error(t).1 * spring(t));
}

#[test]
fn drives_and_loads_have_their_columns() {
    let s = shape("actuator", "limit", &[("limit", 0.6)]);
    acts("current-saturation", &s, 0, MOTOR, |t| torque(t).clamp(-0.6, 0.6) - torque(t));
    let s = shape("actuator", "order", &[("h", 12.0)]);
    acts("torque-ripple", &s, 0, MOTOR, |t| 0.3 * TORQUE * (12.0 * position(MOTOR, t)).sin());
    acts("torque-ripple", &s, 3, MOTOR, |t| 0.3 * TORQUE * (24.0 * position(MOTOR, t)).cos());
    // A lag of what is constant over each part: exact at the ends of the parts, its mean by small steps.
    let lag = 0.03;
    let late = shape("actuator", "lag", &[("lag", lag)]);
    const FINE: usize = 4000;
    let part_length = STEP / PARTS as f64;
    let mut x = torque(moment(0));
    let mut lagged = Vec::new();
    for k in 0..NODES * PARTS {
        let mut mean = 0.0;
        for _ in 0..FINE {
            let before = x;
            x += (torque(moment(k)) - x) * part_length / FINE as f64 / lag;
            mean += 0.5 * (before + x) / FINE as f64;
        }
        lagged.push(mean - torque(moment(k)));
    }
    same("lag", &sum(&part("actuator-lag", &late, 0).forces, MOTOR), &means(&lagged), 1e-4);
    let s = shape("load", "powers", &[]);
    for (k, p) in [1, 0, 3, 2].into_iter().enumerate() {
        acts("cable-stiffness", &s, k, LINK, |t| TORQUE * ((position(LINK, t) - 0.15) / 0.4).powi(p));
    }
    let s = LawShape::new("load", "weight", &[]).at(&[1]);
    for on in [LINK, 5] {
        acts("gravity-torque", &s, 0, on, |t| TORQUE * (position(LINK, t) + position(5, t)).sin());
    }
    let mut s = shape("load", "pulses", &[]);
    s.pulses = vec![[0.3, 0.4]];
    let pulse = |t: f64| {
        let inside = t > 0.3 && t < 0.7;
        if inside { 0.5 * (1.0 - (2.0 * PI * (t - 0.3) / 0.4).cos()) } else { 0.0 }
    };
    acts("external-force", &s, 0, LINK, |t| TORQUE * pulse(t));
    s.place = "tip";
    acts("external-force", &s, 1, LINK, |t| 0.5 * FORCE * 2.0 * LINK as f64 * pulse(t));
    s.only = vec![3];
    assert!(part("external-force", &s, 0).forces.is_empty(), "an impulse of another recording");
}

#[test]
fn a_free_base_has_its_columns() {
    let attitude = |t: f64| position(2, t);
    let s = shape("base", "body", &[]);
    acts("base-thrust", &s, 0, BASE, |t| 0.1 * FORCE * attitude(t).cos());
    acts("base-thrust", &s, 1, BASE, |t| -0.1 * FORCE * attitude(t).sin());
    acts("base-thrust", &s, 2, 2, |_| 0.1 * TORQUE);
    let s = shape("base", "viscous", &[("v0", 1e-5), ("p", 2.0)]);
    let speed = |t: f64| (rate(0, t).powi(2) + rate(1, t).powi(2) + 1e-10).sqrt();
    acts("base-drag", &s, 0, 1, |t| -0.3 * FORCE * rate(1, t) / 0.2 * speed(t) / 0.2);
    acts("base-drag", &s, 1, 2, |t| -0.3 * TORQUE * rate(2, t) * rate(2, t).abs() / 0.16);
    let s = shape("base", "dry", &[("v0", 0.01)]);
    acts("base-drag", &s, 1, 2, |t| -0.1 * TORQUE * (rate(2, t) / 0.05).tanh());
    let s = shape("base", "potential", &[("n", 3.0)]);
    let (x, y) = (|t: f64| (position(0, t) - 0.1) / 0.3, |t: f64| position(1, t) / 0.3);
    acts("cable-stiffness", &s, 3, 2, |t| -0.1 * TORQUE * (attitude(t) - 0.1) / 0.5);
    acts("cable-stiffness", &s, 8, 1, |t| -0.1 * FORCE * x(t));
    acts("cable-stiffness", &s, 10, 1, |t| -0.1 * FORCE * x(t) * x(t));
    acts("cable-stiffness", &s, 13, BASE, |t| -0.1 * FORCE * x(t) * (x(t).powi(2) + y(t).powi(2)));
    let s = shape("base", "field", &[]);
    acts("table-tilt", &s, 1, LINK, |_| 1e-3 * (LINK + 10) as f64);

    let s = shape("base", "pole", &[("f", 2.0), ("z", 0.01)]);
    let turns = vec![2.0 * MOTION[2][2]; NODES * PARTS];
    let swing = resonance(&turns, &vec![STEP / PARTS as f64; NODES * PARTS], 4.0 * PI, 0.01).0;
    let expected: Vec<f64> = means(&swing).iter().map(|u| -0.1 * 3.0 * u).collect();
    same("appendage", &sum(&part("appendage-mode", &s, 5).forces, 2), &expected, 1e-9);
}

#[test]
fn a_hinge_swings_and_moves_the_tip() {
    let s = shape("load", "hinge", &[("f", 3.0), ("z", 0.02), ("at", 0.6)]);
    let drive: Vec<f64> = (0..NODES).map(|t| 2.0 * torque(t as f64 * STEP)).collect();
    let (acceleration, deflection) = resonance(&drive, &[STEP; NODES], 6.0 * PI, 0.02);
    let own = part("flexible-link", &s, 0);
    let force: Vec<f64> = acceleration.iter().map(|a| -(LINK as f64) * a).collect();
    same("hinge", &sum(&own.forces, LINK), &force, 1e-12);
    let tip: Vec<f64> = deflection.iter().map(|u| 0.25 * u).collect();
    same("tip", &sum(&own.readings, 2), &tip, 1e-12);
}

#[test]
fn readings_are_late_drift_and_have_orders() {
    let node = |t: usize| t as f64 * STEP + 0.003;
    let reads = |id: &str, s: &LawShape, amplitude: usize, c: usize, expected: &dyn Fn(f64) -> f64| {
        let expected: Vec<f64> = (0..NODES).map(|t| expected(node(t))).collect();
        same(id, &sum(&part(id, s, amplitude).readings, c), &expected, 1e-8);
    };
    let s = LawShape::new("sensor", "delay", &[("d", 0.05)]).of(&[0, 2]);
    reads("sensor-delay", &s, 0, 0, &|t| position(LINK, t - 0.05) - position(LINK, t));
    reads("sensor-delay", &s, 0, 2, &|t| (t - 0.05).powi(3) - t.powi(3));
    let last = (NODES - 1) as f64 * STEP;
    let s = LawShape::new("sensor", "time", &[("time", 0.4)]).of(&[1]);
    reads("sensor-drift", &s, 0, 1, &|t| 0.01 * (1.0 - (-t / 0.4).exp()));
    reads("sensor-drift", &s, 1, 1, &|t| 0.01 * t / last);
    let s = LawShape::new("sensor", "late", &[("k", 0.5)]).of(&[1]);
    reads("sensor-drift", &s, 0, 1, &|t| 0.01 * (t - 0.5 * last).max(0.0) / last);
    let s = LawShape::new("sensor", "order", &[("h", 2.0)]).of(&[1]);
    reads("sensor-eccentricity", &s, 1, 1, &|t| 0.01 * ((2.0 * position(MOTOR, t)).cos() - 1.0));
    reads("sensor-eccentricity", &s, 2, 1, &|t| 0.01 * (4.0 * position(MOTOR, t)).sin());
}

/// Every shape that a screen looks for has finite columns with a prior for each.
#[test]
fn every_shape_has_columns_and_priors() {
    let along = along();
    let orders = vec![OrderPeaks::default(); along.joints.len()];
    let mut seen = 0;
    for law in ARM_LAWS {
        for s in law.shapes(&along, &orders) {
            let terms = law.terms(&along, &s).unwrap().applied;
            let what = format!("{} {s:?}", law.id());
            assert!(!terms.columns.is_empty() && terms.columns.len() == terms.mean.len(), "{what}");
            assert_eq!(terms.mean.len(), terms.deviation.len(), "{what}");
            assert!(terms.deviation.iter().all(|d| *d > 0.0), "{what}");
            for p in terms.columns.iter().flatten() {
                let mut values = p.forces.iter().chain(&p.readings).flat_map(|s| s.values.iter());
                assert!(values.all(|v| v.is_finite()), "{what}");
            }
            seen += 1;
        }
    }
    assert!(seen > 300, "{seen} shapes");
}

#[test]
fn tangents_are_slopes_of_the_law() {
    let along = along();
    let n = MOTION.len();
    let matrix = |id: &str, s: &LawShape, amplitudes: &[f64]| {
        let slopes = arm_law_of(id, s.place).unwrap().slopes(&along, s, amplitudes).unwrap();
        as_matrices(&[slopes], n, &[NODES]).remove(0)
    };
    let s = shape("transmission", "knees", &[("b", 0.01), ("b2", 0.02)]);
    let m = matrix("nonlinear-stiffness", &s, &[0.0, 0.0, -0.5]);
    let at = |m: &[f64], t: usize, on: usize, by: usize| m[2 * n * n * t + 2 * n * on + by];
    assert!((at(&m, 10, LINK, MOTOR) + 0.5 * STIFFNESS).abs() < 1e-9);
    assert!((at(&m, 10, MOTOR, MOTOR) - 0.5 * STIFFNESS).abs() < 1e-9);
    let m = matrix("nonlinear-stiffness", &s, &[0.0, 0.0, -2.0]);
    assert!((at(&m, 10, LINK, MOTOR) + 0.9 * STIFFNESS).abs() < 1e-9, "some of the spring stays");
    let s = shape("motor-friction", "length", &[("x", 0.02)]);
    let m = matrix("motor-friction", &s, &[1.0, 0.5, 0.0, 0.0]);
    let viscous = at(&m, 10, MOTOR, n + MOTOR);
    assert!((viscous + 0.3 * TORQUE * 0.5 / SPEED).abs() < 1e-12);
    let z = slipping(|t| position(MOTOR, t), 0.02);
    let slope = |k: usize| (1.0 - rate(MOTOR, moment(k)).signum() * z[k]).clamp(0.0, 1.0) / 0.02;
    let mean = (40..44).map(slope).sum::<f64>() / 4.0;
    assert!((at(&m, 10, MOTOR, MOTOR) + 0.1 * TORQUE * mean).abs() < 1e-3 * TORQUE);
    let m = matrix("motor-friction", &s, &[-1.0, -0.5, 0.0, 0.0]);
    assert!(m.iter().all(|x| *x == 0.0), "friction never drives");
}
