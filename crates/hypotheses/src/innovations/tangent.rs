//! Tangents of laws in force: what their forces change with the states along the trajectory. Only of the law at the trajectory: a
//! tangent that the law does not have is read as a cause.

use super::along::PlantAlong;
use super::law::EffectLaw;
use super::operator::dahl;
use super::shape::LawShape;
use super::slope::{ForceSlope, LawSlopes};

/// Step of the differences of a law in a spring, in usual twists and rates.
const STEP: f64 = 0.02;
/// Least slope of a law in a spring, in its stiffness and damping: it keeps some of both.
const LEAST: f64 = -0.9;

/// A torque between motor and link by their twist (`rate`: its rate) with this slope: minus on the motor, plus on the link.
fn between(along: &PlantAlong<'_>, joint: usize, rate: bool, slope: &[f64]) -> Vec<ForceSlope> {
    let (motor, link) = (along.joints[joint].motor, along.joints[joint].link);
    let signs = [(link, motor, 1.0), (link, link, -1.0), (motor, motor, -1.0), (motor, link, 1.0)];
    let one = |(on, by, sign): (usize, usize, f64)| {
        let values = slope.iter().map(|s| sign * s).collect();
        ForceSlope { on, by, rate, values }
    };
    signs.map(one).to_vec()
}

/// Of a static law in the spring of a joint at these amplitudes, by differences of its columns.
pub fn of_spring(
    law: &dyn EffectLaw,
    along: &PlantAlong<'_>,
    shape: &LawShape,
    amplitudes: &[f64],
) -> Option<LawSlopes> {
    let joint = &along.joints[shape.joint()];
    let mut all: LawSlopes = vec![Vec::new(); along.runs.len()];
    for (rate, usual, own) in [(false, joint.twist, joint.stiffness), (true, joint.twist_rate, joint.damping)]
    {
        let step = STEP * usual;
        let forces = |by: f64| -> Option<Vec<Vec<f64>>> {
            let moved = along.moved(joint.motor, rate, by);
            let columns = law.terms(&moved, shape)?.applied.columns;
            let sum = |k: usize| {
                let mut sum = vec![0.0; along.runs[k].nodes()];
                for (column, a) in columns.iter().zip(amplitudes) {
                    for s in column[k].forces.iter().filter(|s| s.on == joint.link) {
                        sum.iter_mut().zip(s.values.iter()).for_each(|(x, v)| *x += a * s.weight * v);
                    }
                }
                sum
            };
            Some((0..along.runs.len()).map(sum).collect())
        };
        // (COL-26)
        let (above, below) = (forces(step)?, forces(-step)?);
        for ((slopes, a), b) in all.iter_mut().zip(above).zip(below) {
            let slope = |(a, b): (f64, f64)| ((a - b) / (2.0 * step)).max(LEAST * own);
            let slope: Vec<f64> = a.into_iter().zip(b).map(slope).collect();
            slopes.extend(between(along, shape.joint(), rate, &slope));
        }
    }
    Some(all)
}

/// Slope of Dahl's operator of a length along `x`: (1 - sign(x') z) / length.
fn dahl_slope(x: &[f64], rate: &[f64], length: f64) -> Vec<f64> {
    let z = dahl(x, length);
    z.iter().zip(rate).map(|(z, v)| (1.0 - v.signum() * z).clamp(0.0, 1.0) / length).collect()
}

/// A level of dry friction that slips over a length: the level at each moment of a joint's motion.
pub struct SlidingLevel<'a> {
    /// Length, rad.
    pub length: f64,
    /// Level at the rate of the coordinate, N.m.
    pub level: &'a dyn Fn(f64) -> f64,
}

/// Of dry friction on the motor or the link of a joint, with a viscous companion, N.m.s/rad. Friction never drives.
pub fn of_friction(
    along: &PlantAlong<'_>,
    joint: usize,
    on_link: bool,
    levels: &[SlidingLevel<'_>],
    viscous: f64,
) -> LawSlopes {
    let place = &along.joints[joint];
    let on = if on_link { place.link } else { place.motor };
    let of_run = |k: usize| {
        let (r, motion) = (&along.runs[k], along.joint_within(k, joint));
        let (x, v) =
            if on_link { (&motion.link, &motion.link_speed) } else { (&motion.motor, &motion.motor_speed) };
        let mut sum = vec![0.0; x.len()];
        for l in levels {
            let slope = dahl_slope(x, v, l.length);
            sum.iter_mut().zip(slope).zip(v).for_each(|((s, slope), v)| *s += (l.level)(*v) * slope);
        }
        let stiffness: Vec<f64> = sum.iter().map(|s| -s.max(0.0)).collect();
        let slope = |rate: bool, values: Vec<f64>| ForceSlope { on, by: on, rate, values };
        vec![slope(false, r.means(&stiffness)), slope(true, vec![-viscous.max(0.0); r.nodes()])]
    };
    (0..along.runs.len()).map(of_run).collect()
}

/// Of hysteresis in the spring of a joint: levels that slip over lengths of twist, N.m and rad.
pub fn of_hysteresis(along: &PlantAlong<'_>, joint: usize, levels: &[[f64; 2]]) -> LawSlopes {
    let of_run = |k: usize| {
        let motion = along.joint_within(k, joint);
        let mut sum = vec![0.0; motion.twist.len()];
        for [level, length] in levels {
            let slope = dahl_slope(&motion.twist, &motion.twist_rate, *length);
            sum.iter_mut().zip(slope).for_each(|(s, slope)| *s += level * slope);
        }
        between(along, joint, false, &along.runs[k].means(&sum))
    };
    (0..along.runs.len()).map(of_run).collect()
}
