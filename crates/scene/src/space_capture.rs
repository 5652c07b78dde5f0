//! A capture in space: the robot, the balls of its hand, the target with what is about its port.

use crate::capture::HAND;
use crate::record::{MissingColumn, MotionRecord};
use crate::scene::{PartLook, Scene, ScenePart, ScenePose, SceneShape};
use crate::spatial::robot_scene;
use trueup_models::contact::spatial::layout::HandParameters;
use trueup_models::contact::spatial::{SolidShape, SpatialCaptureScene};
use trueup_models::space::attitude::unit;
use trueup_models::space::layout::Parameters;
use trueup_models::space::vector::{Vector3, add, cross, scale, sub};

/// Rods around a circle.
const SIDES: usize = 24;

fn three(p: &[f64], at: usize) -> Vector3<f64> {
    [p[at], p[at + 1], p[at + 2]]
}

/// Of `CaptureScene` with a robot in space, with these parameters.
///
/// # Errors
/// A position or an attitude is not recorded.
pub fn space_capture_scene(
    capture: &SpatialCaptureScene,
    p: &[f64],
    record: &MotionRecord<'_>,
) -> Result<Scene, MissingColumn> {
    let (s, at) = (capture.structure(), HandParameters::new(capture.structure()));
    let robot = &p[at.count..][..Parameters::new(capture.robot().structure()).count];
    let mut scene = robot_scene(capture.robot(), robot, record)?;
    let names = |name: &str, n: usize| (1..=n).map(|i| format!("{name}[1,{i}]")).collect::<Vec<_>>();
    let places = record.elements(&names("tipPosition", 3))?;
    let turns = record.elements(&names("tipQuaternion", 4))?;
    let hands: Vec<ScenePose> = places
        .iter()
        .zip(&turns)
        .map(|(r, q)| ScenePose { origin: [r[0], r[1], r[2]], turn: [q[0], q[1], q[2], q[3]] })
        .collect();
    let part =
        |name: &str, look, shapes, poses| ScenePart { name: name.into(), layer: 0, look, shapes, poses };
    scene.parts.push(part(HAND, PartLook::Base, vec![SceneShape::Joint([0.0; 3])], hands.clone()));
    let jaws = record.series("jawPosition")?;
    for ball in 0..s.balls {
        let (open, closed) = (three(p, at.open + 3 * ball), three(p, at.closed + 3 * ball));
        let pose = |(hand, jaw): (&ScenePose, &f64)| ScenePose {
            origin: hand.placed(add(open, scale(*jaw, sub(closed, open)))),
            ..*hand
        };
        let shapes = vec![SceneShape::Ball { center: [0.0; 3], radius: p[at.ball_radius + ball] }];
        let poses = hands.iter().zip(&jaws).map(pose).collect();
        scene.parts.push(part(&format!("ball P{}", ball + 1), PartLook::Motor, shapes, poses));
    }
    let places = record.vector::<3>("targetPosition")?;
    let turns = record.vector::<4>("targetQuaternion")?;
    let poses = places.into_iter().zip(turns).map(|(origin, turn)| ScenePose { origin, turn }).collect();
    scene.parts.push(part("target", PartLook::Target, target(capture, &at, p), poses));
    Ok(scene)
}

/// A cuboid of the target's mass and inertia, smaller than the way to its port, and what is about that.
fn target(capture: &SpatialCaptureScene, at: &HandParameters, p: &[f64]) -> Vec<SceneShape> {
    let port = three(p, at.target_center).map(|c| -c);
    let away = port.iter().map(|c| c * c).sum::<f64>().sqrt();
    let own = (1.5 * p[at.target_inertia] / p[at.target_mass]).sqrt();
    let size = if away > 0.0 { own.min(0.5 * away) } else { own };
    let mut shapes = vec![
        SceneShape::Rod { from: [0.0; 3], to: port, radius: 0.02 * size },
        SceneShape::Block { center: [0.0; 3], half: [size; 3] },
    ];
    let axis = || unit(three(p, at.port_axis));
    match capture.structure().against {
        SolidShape::Ball => shapes.push(SceneShape::Ball { center: port, radius: p[at.port_radius] }),
        SolidShape::Bar | SolidShape::Cylinder => {
            let end = |side: f64| add(port, scale(side * p[at.port_half], axis()));
            shapes.push(SceneShape::Rod { from: end(-1.0), to: end(1.0), radius: p[at.port_radius] });
        }
        SolidShape::Ring => shapes.extend(circle(port, axis(), p[at.ring_radius], p[at.port_radius])),
        SolidShape::Plate => shapes.extend(circle(port, axis(), size, 0.02 * size)),
    }
    shapes
}

/// A circle about an axis of length 1, of rods.
fn circle(center: Vector3<f64>, axis: Vector3<f64>, radius: f64, section: f64) -> Vec<SceneShape> {
    let flat = if axis[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let across = unit(cross(axis, flat));
    let other = cross(axis, across);
    let point = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / SIDES as f64;
        add(center, scale(radius, add(scale(angle.cos(), across), scale(angle.sin(), other))))
    };
    (0..SIDES).map(|k| SceneShape::Rod { from: point(k), to: point(k + 1), radius: section }).collect()
}
