//! A joint: the motor's side and the load on one axis.

use crate::record::{MissingColumn, MotionRecord};
use crate::scene::{PartLook, Scene, ScenePart, ScenePose, SceneShape};

/// Largest angle between motor and load as drawn, rad: visible, and less than a motion of its own.
const SHOWN_TWIST: f64 = 0.3;
/// A twist that is seen without exaggeration, rad.
const VISIBLE_TWIST: f64 = 0.1;

/// Of `TwoMassJoint` with that gear ratio: the load as an arm of 1 m, the motor as a shorter one behind its gear. A twist that
/// could not be seen is exaggerated, and a note gives by how much.
///
/// # Errors
/// An angle is not recorded.
pub fn joint_scene(gear_ratio: f64, record: &MotionRecord<'_>) -> Result<Scene, MissingColumn> {
    let [motor, load, tip] = angles(gear_ratio, record)?;
    let twist = |outer: &[f64], inner: &[f64]| {
        outer.iter().zip(inner).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let largest = twist(&load, &motor).max(twist(&tip, &load));
    let factor = exaggeration(largest);
    let mut scene = joint_as_is(gear_ratio, record, factor)?;
    if factor > 1.0 {
        scene.notes.push(format!("The twist between motor and load is drawn {factor} times as large."));
    }
    Ok(scene)
}

/// Of the motor behind its gear, of the load, of the link's tip (of a rigid link: the load's), rad.
fn angles(gear_ratio: f64, record: &MotionRecord<'_>) -> Result<[Vec<f64>; 3], MissingColumn> {
    let motor: Vec<f64> = record.series("motorAngle")?.iter().map(|q| q / gear_ratio).collect();
    let load = record.series("loadAngle")?;
    let tip = if record.has("tipAngle") { record.series("tipAngle")? } else { load.clone() };
    Ok([motor, load, tip])
}

/// The same with the twist times a factor, which no note gives: of one of several motions.
///
/// # Errors
/// An angle is not recorded.
pub fn joint_as_is(gear_ratio: f64, record: &MotionRecord<'_>, factor: f64) -> Result<Scene, MissingColumn> {
    let [motor, load, tip] = angles(gear_ratio, record)?;
    let mut scene = Scene { planar: true, symbolic: true, time: record.times().to_vec(), ..Scene::default() };
    let drawn = |k: usize, angle: f64| motor[k] + factor * (angle - motor[k]);
    let turned = |angle: &dyn Fn(usize) -> f64| {
        (0..motor.len()).map(|k| ScenePose::planar([0.0; 2], angle(k))).collect()
    };
    let part =
        |name: &str, look, shapes, poses| ScenePart { name: name.into(), layer: 0, look, shapes, poses };
    let rod = |length: f64, radius: f64| SceneShape::Rod { from: [0.0; 3], to: [length, 0.0, 0.0], radius };
    let (center, middle) = ([0.0; 3], [1.0, 0.0, 0.0]);
    scene.parts.push(part(
        "housing",
        PartLook::Ground,
        vec![SceneShape::Ball { center, radius: 0.2 }],
        vec![ScenePose::NEUTRAL],
    ));
    let hub = if record.has("tipAngle") { 0.4 } else { 1.0 };
    let end = if hub < 1.0 { vec![] } else { vec![SceneShape::Tip(middle)] };
    let load_shapes = [vec![rod(hub, 0.03)], end].concat();
    scene.parts.push(part("load", PartLook::Link, load_shapes, turned(&|k| drawn(k, load[k]))));
    if hub < 1.0 {
        scene.parts.push(part(
            "link",
            PartLook::Link,
            vec![bent(hub, &load, &tip, &drawn)],
            vec![ScenePose::NEUTRAL],
        ));
    }
    scene.parts.push(part("motor", PartLook::Motor, vec![rod(0.4, 0.05)], turned(&|k| motor[k])));
    let axis = vec![SceneShape::Joint(center)];
    scene.parts.push(part("joint", PartLook::Ground, axis, vec![ScenePose::NEUTRAL]));
    Ok(scene)
}

/// 1, or a round number that makes the largest angle between two motions visible, rad.
pub fn exaggeration(largest: f64) -> f64 {
    if !(largest > 1e-9 && largest < VISIBLE_TWIST) {
        return 1.0;
    }
    let wanted = SHOWN_TWIST / largest;
    let decade = 10f64.powf(wanted.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * decade).find(|f| *f <= wanted).unwrap_or(1.0)
}

/// A link that bends from the hub on, a parabola: its end is where the tip's angle has it.
fn bent(hub: f64, load: &[f64], tip: &[f64], drawn: &dyn Fn(usize, f64) -> f64) -> SceneShape {
    let points = (0..load.len())
        .map(|k| {
            let (inner, outer) = (drawn(k, load[k]), drawn(k, tip[k]));
            let point = |i: usize| {
                let share = i as f64 / 8.0;
                let (sin, cos) = (inner + (outer - inner) * share * share).sin_cos();
                let radius = hub + (1.0 - hub) * share;
                [radius * cos, radius * sin, 0.0]
            };
            (0..=8).map(point).collect()
        })
        .collect();
    SceneShape::Curve { points, radius: 0.025 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exaggerations_are_round_and_stay_below_what_is_shown() {
        for (largest, wanted) in [(0.2, 1.0), (0.0, 1.0), (0.01, 20.0), (3e-3, 100.0), (2.9e-4, 1000.0)] {
            assert_eq!(exaggeration(largest), wanted, "{largest}");
        }
    }
}
