//! A capture: chaser, hand of balls, target; and a body that floats.

use crate::planar::planar_scene;
use crate::record::{MissingColumn, MotionRecord};
use crate::scene::{PartLook, Scene, ScenePart, ScenePose, SceneShape};
use trueup_models::arm::PlanarManipulator;
use trueup_models::contact::layout::{
    BodyParameters, ChaserParameters, GripperStructure, Mount, Parameters, PortShape,
};
use trueup_models::contact::{CaptureScene, FreeBody};

/// Half of the side of a square of that mass and inertia, m.
fn half(mass: f64, inertia: f64) -> f64 {
    (1.5 * inertia / mass).sqrt()
}

/// Of `CaptureScene` with a rigid chaser, with these parameters.
///
/// # Errors
/// A position or an attitude is not recorded.
pub fn capture_scene(
    capture: &CaptureScene,
    p: &[f64],
    record: &MotionRecord<'_>,
) -> Result<Scene, MissingColumn> {
    let gripper = Parameters::new(capture.structure());
    let at = ChaserParameters::new(&()).behind(gripper.count);
    let poses = record.planar_poses("chaserPosition", "chaserAttitude")?;
    let hand = [p[at.end_effector], p[at.end_effector + 1], 0.0];
    let hands: Vec<_> = poses.iter().map(|pose| ScenePose { origin: pose.placed(hand), ..*pose }).collect();
    let size = half(p[at.mass], p[at.inertia]).min(0.7 * hand[0].hypot(hand[1]));
    let shapes = vec![
        SceneShape::Rod { from: [0.0; 3], to: hand, radius: 0.04 * size },
        SceneShape::Block { center: [0.0; 3], half: [size; 3] },
    ];
    let mut scene = Scene { planar: true, time: record.times().to_vec(), ..Scene::default() };
    scene.parts.push(ScenePart { name: "chaser".into(), layer: 0, look: PartLook::Base, shapes, poses });
    balls_and_target(&mut scene, capture.structure(), p, &hands, record)?;
    Ok(scene)
}

/// Of `CaptureScene` with the planar manipulator, with these parameters.
///
/// # Errors
/// As [`capture_scene`].
pub fn arm_capture_scene(
    capture: &CaptureScene<PlanarManipulator>,
    p: &[f64],
    record: &MotionRecord<'_>,
) -> Result<Scene, MissingColumn> {
    let begin = Parameters::new(capture.structure()).count;
    let mut scene = planar_scene(capture.chaser(), &p[begin..], record)?;
    let hands = record.planar_poses("tipPosition", "tipAttitude")?;
    balls_and_target(&mut scene, capture.structure(), p, &hands, record)?;
    Ok(scene)
}

/// Way of a carriage, hand's axes, and where it is along it at each time, m.
type CarriageWay = ([f64; 2], Vec<f64>);

/// Of each carriage; none of a hand without.
fn carriages(
    s: &GripperStructure,
    p: &[f64],
    record: &MotionRecord<'_>,
) -> Result<Vec<CarriageWay>, MissingColumn> {
    if s.mount != Mount::Carriages {
        return Ok(Vec::new());
    }
    let at = Parameters::new(s);
    let (x, y) = (p[at.carriage_direction], p[at.carriage_direction + 1]);
    let unit = |side: f64| [x / x.hypot(y), side * y / x.hypot(y)];
    let all = [("carriagePosition[1]", 1.0), ("carriagePosition[2]", -1.0)];
    all.into_iter().map(|(name, side)| Ok((unit(side), record.series(name)?))).collect()
}

/// Adds the hand with its balls, and the target.
fn balls_and_target(
    scene: &mut Scene,
    s: &GripperStructure,
    p: &[f64],
    hands: &[ScenePose],
    record: &MotionRecord<'_>,
) -> Result<(), MissingColumn> {
    let at = Parameters::new(s);
    let jaws = record.series("jawPosition")?;
    let (poses, shapes) = (hands.to_vec(), vec![SceneShape::Joint([0.0; 3])]);
    scene.parts.push(ScenePart { name: HAND.into(), layer: 0, look: PartLook::Base, shapes, poses });
    let slid = carriages(s, p, record)?;
    for ball in 0..s.balls {
        let pair = |begin: usize| [p[begin + 2 * ball], p[begin + 2 * ball + 1]];
        let (open, closed) = (pair(at.open), pair(at.closed));
        let carriage = ball.checked_sub(1).and_then(|k| slid.get(k % 2));
        let pose = |(k, (hand, jaw)): (usize, (&ScenePose, &f64))| {
            let shift = carriage.map_or([0.0; 2], |(way, along)| way.map(|w| w * along[k]));
            let [x, y] = std::array::from_fn(|i| open[i] + jaw * (closed[i] - open[i]) + shift[i]);
            ScenePose { origin: hand.placed([x, y, 0.0]), ..*hand }
        };
        scene.parts.push(ScenePart {
            name: format!("ball P{}", ball + 1),
            layer: 0,
            look: PartLook::Motor,
            shapes: vec![SceneShape::Ball { center: [0.0; 3], radius: p[at.ball_radius + ball] }],
            poses: hands.iter().zip(&jaws).enumerate().map(pose).collect(),
        });
    }
    let port = [-p[at.target_center], -p[at.target_center + 1], 0.0];
    let distance = port[0].hypot(port[1]);
    let own = half(p[at.target_mass], p[at.target_inertia]);
    let size = if distance > 0.0 { own.min(0.9 * distance) } else { own };
    let mut shapes = vec![
        SceneShape::Rod { from: [0.0; 3], to: port, radius: 0.012 * size },
        SceneShape::Block { center: [0.0; 3], half: [size; 3] },
    ];
    shapes.push(match s.against {
        PortShape::Ball => SceneShape::Ball { center: port, radius: p[at.port_radius] },
        PortShape::Bar => {
            let end = |along: f64| [port[0], port[1] + along * p[at.bar_half], 0.0];
            SceneShape::Rod { from: end(-1.0), to: end(1.0), radius: p[at.port_radius] }
        }
        PortShape::Plate => {
            let (x, y) = (p[at.port_normal], p[at.port_normal + 1]);
            let along = [-y * 0.5 * size / x.hypot(y), x * 0.5 * size / x.hypot(y)];
            let end = |sign: f64| [port[0] + sign * along[0], port[1] + sign * along[1], 0.0];
            SceneShape::Rod { from: end(-1.0), to: end(1.0), radius: 0.02 * size }
        }
    });
    let poses = record.planar_poses("targetPosition", "targetAttitude")?;
    scene.parts.push(ScenePart { name: "target".into(), layer: 0, look: PartLook::Target, shapes, poses });
    Ok(())
}

/// Name of the part that the balls are fixed to.
pub const HAND: &str = "hand";

/// How far from the hand its balls are at most, jaws open, m: what a close-up shows.
pub fn hand_reach(s: &GripperStructure, p: &[f64]) -> f64 {
    let at = Parameters::new(s);
    let of = |i: usize| p[at.open + 2 * i].hypot(p[at.open + 2 * i + 1]) + p[at.ball_radius + i];
    (0..s.balls).map(of).fold(0.0, f64::max)
}

/// Of `FreeBody` with these parameters.
///
/// # Errors
/// Its position or its attitude is not recorded.
pub fn body_scene(body: &FreeBody, p: &[f64], record: &MotionRecord<'_>) -> Result<Scene, MissingColumn> {
    let at = BodyParameters::new(&body.ports());
    let poses = record.planar_poses("position", "attitude")?;
    let ports = (0..body.ports()).map(|k| [p[at.port + 2 * k], p[at.port + 2 * k + 1], 0.0]);
    let farthest = ports.clone().map(|r| r[0].hypot(r[1])).fold(0.0, f64::max);
    let own = half(p[at.mass], p[at.inertia]);
    let size = if farthest > 0.0 { own.min(0.9 * farthest) } else { own };
    let mut shapes = vec![SceneShape::Block { center: [0.0; 3], half: [size; 3] }];
    for port in ports {
        shapes.push(SceneShape::Rod { from: [0.0; 3], to: port, radius: 0.06 * size });
        shapes.push(SceneShape::Joint(port));
    }
    Ok(Scene {
        planar: true,
        time: record.times().to_vec(),
        parts: vec![ScenePart { name: "body".into(), layer: 0, look: PartLook::Target, shapes, poses }],
        ..Scene::default()
    })
}
