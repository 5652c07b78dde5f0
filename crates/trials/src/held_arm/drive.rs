//! An arm drawn around a published one.

use super::chain::{ChainBody, JOINTS, SerialChain};
use super::robots::{PUBLISHED, PublishedArm};
use super::space::{Arrow, LEVEL, about, cross, dot, of_quaternion, seen, times};
use super::values::{HeldArmState, HeldArmValues, RATE};
use crate::draw::SeededDraw;
use crate::joint::short;

/// Standard gravity, m/s2.
pub(super) const GRAVITY: f64 = 9.81;

/// What was drawn.
#[derive(Clone, Debug)]
pub(super) struct DrawnArm {
    pub(super) values: HeldArmValues,
    /// In words.
    pub(super) name: &'static str,
    /// Middle of the angles at which it works.
    pub(super) posture: [f64; JOINTS],
}

fn unit(a: Arrow) -> Arrow {
    times(1.0 / dot(a, a).sqrt(), a)
}

/// Inertia of a cylinder of this mass whose axis is about along `center`, turned a little.
fn inertia(d: &mut SeededDraw, mass: f64, center: Arrow) -> [Arrow; 3] {
    let length = 2.0 * dot(center, center).sqrt().max(0.04) * d.uniform(0.9, 1.15);
    let radius = d.uniform(0.045, 0.065) * (mass / 4.0).cbrt().clamp(0.6, 1.4);
    let along = unit(center);
    // A turn that takes z to the cylinder's axis, then a small one about any axis.
    let side = cross([0.0, 0.0, 1.0], along);
    let sine = dot(side, side).sqrt();
    let upright = if sine > 1e-9 { about(unit(side), sine.atan2(along[2])) } else { LEVEL };
    let any = unit([d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0), 1.0]);
    let askew = about(any, d.uniform(-0.15, 0.15));
    let across = mass * (3.0 * radius * radius + length * length) / 12.0;
    let own = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, 0.5 * mass * radius * radius]];
    let whole = seen(&askew, &seen(&upright, &own));
    // Symmetric to the last digit.
    std::array::from_fn(|i| std::array::from_fn(|k| short(whole[i.min(k)][i.max(k)])))
}

fn quarter_turns(n: i8) -> [f64; 4] {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    match n {
        1 => [half, half, 0.0, 0.0],
        -1 => [half, -half, 0.0, 0.0],
        2 => [0.0, 1.0, 0.0, 0.0],
        _ => [1.0, 0.0, 0.0, 0.0],
    }
}

fn body(d: &mut SeededDraw, arm: &PublishedArm, j: usize, stretch: f64) -> ChainBody {
    let ((position, quarters), (mass, center)) = (arm.joints[j], arm.bodies[j]);
    let mut near = |x: f64, by: f64| if x == 0.0 { 0.0 } else { short(x * (1.0 + d.uniform(-by, by))) };
    let position = position.map(|x| near(stretch * x, 0.05));
    let mass = near(mass, 0.15);
    let center = center.map(|x| near(stretch * x, 0.1));
    let inertia = inertia(d, mass, center);
    let orientation = quarter_turns(quarters);
    let (turned, axis) = (of_quaternion(orientation), [0.0, 0.0, 1.0]);
    ChainBody { mass, center, inertia, position, orientation, turned, axis }
}

/// `springs`: at least one joint has one, none has, or as drawn.
pub(super) fn draw(d: &mut SeededDraw, springs: Option<bool>) -> DrawnArm {
    let arm = &PUBLISHED[d.below(PUBLISHED.len())];
    let stretch = d.uniform(0.9, 1.12);
    let mut bodies: Vec<ChainBody> = (0..JOINTS).map(|j| body(d, arm, j, stretch)).collect();
    // A tool on the flange, as a point.
    let tip = arm.flange.map(|x| short(x * stretch));
    let tool =
        [short(d.uniform(-0.03, 0.03)), short(d.uniform(-0.03, 0.03)), short(tip[2] + d.uniform(0.04, 0.12))];
    let carried = short(d.log(0.2, 2.0));
    load(&mut bodies[JOINTS - 1], carried, tool);
    let of = |j: usize, pair: [f64; 2]| pair[usize::from(j >= 3)];
    let mut spread = |x: f64, by: f64| short(x * d.log(1.0 / by, by));
    let rotor = std::array::from_fn(|j| spread(of(j, arm.rotor), 1.3));
    let coulomb = std::array::from_fn(|j| spread(of(j, arm.friction.map(|f| f.0)), 1.5));
    let viscous = std::array::from_fn(|j| spread(of(j, arm.friction.map(|f| f.1)), 1.5));
    // In most arms friction breaks away where it slides.
    let higher = if d.chance(0.6) { 1.0 } else { d.uniform(1.05, 1.25) };
    let gear_ratio = [d.pick(&[100.0, 101.0, 121.0, 160.0]); JOINTS];
    let Ok(bodies) = <[ChainBody; JOINTS]>::try_from(bodies) else { unreachable!("one per joint") };
    let posture = std::array::from_fn(|j| d.uniform(arm.posture[j].0, arm.posture[j].1));
    let chain = SerialChain { bodies, gravity: [0.0, 0.0, -GRAVITY], rotor, gear_ratio };
    let mut values = HeldArmValues {
        chain,
        tip,
        flexible: [false; JOINTS],
        stiffness: [0.0; JOINTS],
        damping: [0.0; JOINTS],
        coulomb,
        breakaway: coulomb.map(|c| short(c * higher)),
        viscous,
    };
    if springs.unwrap_or_else(|| d.chance(0.3)) {
        set_springs(d, &mut values, &posture);
    }
    DrawnArm { values, name: arm.name, posture }
}

/// Springs in one to three joints of the shoulder and the elbow.
fn set_springs(d: &mut SeededDraw, v: &mut HeldArmValues, posture: &[f64; JOINTS]) {
    let sure = d.below(3);
    let m = v.chain.mass_matrix(&v.chain.motion(posture, &[0.0; JOINTS]));
    for j in 0..3 {
        if j != sure && !d.chance(0.5) {
            continue;
        }
        // With the motor held and all else locked.
        let w = std::f64::consts::TAU * d.uniform(5.0, 11.0);
        v.flexible[j] = true;
        v.stiffness[j] = short(w * w * m[j][j]);
        v.damping[j] = short(2.0 * d.uniform(0.01, 0.04) * w * m[j][j]);
    }
}

/// Adds a point of `mass` kg at `at` (own axes, m) to a body.
pub(super) fn load(b: &mut ChainBody, mass: f64, at: Arrow) {
    let all = b.mass + mass;
    let apart: Arrow = std::array::from_fn(|k| at[k] - b.center[k]);
    let reduced = b.mass * mass / all;
    let square = dot(apart, apart);
    for i in 0..3 {
        for k in 0..3 {
            let own = if i == k { square } else { 0.0 } - apart[i] * apart[k];
            b.inertia[i][k] = short(b.inertia[i][k] + reduced * own);
        }
    }
    b.center = std::array::from_fn(|k| short((b.mass * b.center[k] + mass * at[k]) / all));
    b.mass = short(all);
}

impl HeldArmValues {
    /// At rest at these joint angles, springs under the weight that they carry.
    pub(super) fn at_rest(&self, q: &[f64; JOINTS]) -> HeldArmState {
        let mut x = [0.0; 2 * RATE + 4];
        x[..JOINTS].copy_from_slice(q);
        let weight = self.chain.weight(q);
        for j in (0..JOINTS).filter(|j| self.flexible[*j]) {
            x[JOINTS + j] = q[j] + weight[j] / self.stiffness[j];
        }
        x
    }
}
