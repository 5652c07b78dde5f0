//! A robot in space, on a free or a fixed base.

use crate::record::{MissingColumn, MotionRecord};
use crate::scene::{PartLook, Scene, ScenePart, ScenePose, SceneShape};
use trueup_models::space::attitude::rotation;
use trueup_models::space::layout::{Parameters, States};
use trueup_models::space::pose::RobotPose;
use trueup_models::space::spatial::SpatialFrame;
use trueup_models::space::tree::JointType;
use trueup_models::space::vector::{Matrix3, Vector3, add, dot, scale, sub, times, transposed_times};
use trueup_models::space::{RobotStructure, SpatialFreeFlyer};

/// Points along what bends.
const STATIONS: usize = 8;

/// Of `SpatialFreeFlyer`, or of the bodies of `FlexibleArm`, with these parameters: a cuboid of the base's mass and inertia, links
/// from joint to joint, appendages and links as they bend.
///
/// # Errors
/// A coordinate is not recorded.
pub fn robot_scene(
    robot: &SpatialFreeFlyer,
    p: &[f64],
    record: &MotionRecord<'_>,
) -> Result<Scene, MissingColumn> {
    let states = recorded_states(robot, record)?;
    let poses: Vec<RobotPose> = states.iter().map(|x| robot.pose(p, x)).collect();
    let (s, at) = (robot.structure(), Parameters::new(robot.structure()));
    let reach = reach(s, &at, p);
    let mut scene = Scene { time: record.times().to_vec(), ..Scene::default() };
    let drawing = RobotDrawing { robot, p, at, poses: &poses, radius: 0.018 * reach };
    scene.parts.push(drawing.base(reach));
    for k in 0..s.appendages.len() {
        scene.parts.push(drawing.panel(k, &states));
    }
    scene.parts.extend(drawing.tables());
    for body in 1..=s.bodies() {
        scene.parts.push(drawing.body(body));
        scene.parts.extend(drawing.tip_of_bent(body));
    }
    Ok(scene)
}

/// The states that places depend on, from the outputs of the same names; all others are 0.
fn recorded_states(
    robot: &SpatialFreeFlyer,
    record: &MotionRecord<'_>,
) -> Result<Vec<Vec<f64>>, MissingColumn> {
    let mut states = vec![vec![0.0; States::new(robot.structure()).count]; record.times().len()];
    let mut row = 0;
    for entry in States::list(robot.structure()) {
        let count = entry.dimensions.iter().product::<usize>();
        if POSITIONS.contains(&entry.name) {
            for i in 0..count {
                let series = record.series(&format!("{}[{}]", entry.name, i + 1))?;
                states.iter_mut().zip(series).for_each(|(x, value)| x[row + i] = value);
            }
        }
        row += count;
    }
    Ok(states)
}

/// States that are outputs of the same name and that places depend on.
const POSITIONS: [&str; 5] =
    ["basePosition", "baseQuaternion", "jointAngle", "modalCoordinate", "linkModalCoordinate"];

fn length(a: Vector3<f64>) -> f64 {
    dot(a, a).sqrt()
}

/// The longest way from the base to a tip or a last body, m; 1 of a robot without lengths.
fn reach(s: &RobotStructure, at: &Parameters, p: &[f64]) -> f64 {
    let ends = (1..=s.bodies()).map(|body| (body, length(three(p, at.body_center + 3 * (body - 1)))));
    let tips = s.tips.iter().enumerate().map(|(a, body)| (*body, length(three(p, at.tip_offset + 3 * a))));
    let way = |(body, last): (usize, f64)| {
        last + s.tree.arm(body).map(|b| length(three(p, at.joint_position + 3 * (b - 1)))).sum::<f64>()
    };
    let longest = ends.chain(tips).map(way).fold(0.0, f64::max);
    if longest > 0.0 { longest } else { 1.0 }
}

struct RobotDrawing<'a> {
    robot: &'a SpatialFreeFlyer,
    p: &'a [f64],
    at: Parameters,
    poses: &'a [RobotPose],
    radius: f64,
}

impl RobotDrawing<'_> {
    fn of_bodies(&self, body: usize) -> Vec<ScenePose> {
        self.poses.iter().map(|pose| ScenePose::of(&pose.bodies[body])).collect()
    }

    /// Where what hangs on a body is fixed to it, at angles 0, own axes: joints and tips.
    fn carried(&self, body: usize) -> Vec<Vector3<f64>> {
        let s = self.robot.structure();
        let joints = s.tree.parent.iter().enumerate().filter(|(_, parent)| **parent == body);
        let joints = joints.map(|(j, _)| three(self.p, self.at.joint_position + 3 * j));
        joints.chain(self.tips(body)).collect()
    }

    fn tips(&self, body: usize) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let tips = self.robot.structure().tips.iter().enumerate().filter(move |(_, on)| **on == body);
        tips.map(|(a, _)| three(self.p, self.at.tip_offset + 3 * a))
    }

    /// Whether the link of a body bends.
    fn bends(&self, body: usize) -> bool {
        self.robot.structure().bending().any(|(on, _)| on == body)
    }

    /// Axes of appendage `k` (beams, then tables) to those of the base.
    fn appendage_axes(&self, k: usize) -> Matrix3<f64> {
        rotation(std::array::from_fn(|i| self.p[self.at.appendage_orientation + 4 * k + i]))
    }

    /// A cuboid of the base's mass and inertia, with brackets to what it carries; a small one where it is held.
    fn base(&self, reach: f64) -> ScenePart {
        let (s, p, at) = (self.robot.structure(), self.p, &self.at);
        let mut half = [0.05 * reach; 3];
        if !s.held {
            let i = |k: usize| p[at.base_inertia + 4 * k];
            for (k, half) in half.iter_mut().enumerate() {
                let square = 1.5 * (i((k + 1) % 3) + i((k + 2) % 3) - i(k)) / p[at.base_mass];
                *half = square.max(0.0).sqrt().clamp(0.03 * reach, reach);
            }
        }
        let rods = self.carried(0).into_iter();
        let rod = |to| SceneShape::Rod { from: [0.0; 3], to, radius: 1.4 * self.radius };
        let mut shapes: Vec<SceneShape> = rods.map(rod).collect();
        shapes.push(SceneShape::Block { center: [0.0; 3], half });
        let look = if s.held { PartLook::Ground } else { PartLook::Base };
        ScenePart { name: "base".into(), layer: 0, look, shapes, poses: self.of_bodies(0) }
    }

    fn body(&self, body: usize) -> ScenePart {
        let (s, bends) = (self.robot.structure(), self.bends(body));
        let mut shapes = Vec::new();
        let carried = self.carried(body);
        for place in carried.iter().filter(|r| length(**r) > 0.0) {
            shapes.push(if bends {
                self.bent(body, *place)
            } else {
                SceneShape::Rod { from: [0.0; 3], to: *place, radius: self.radius }
            });
        }
        if carried.is_empty() {
            // What ends without a tip reaches as far beyond its centre of mass as before it.
            let to = scale(2.0, three(self.p, self.at.body_center + 3 * (body - 1)));
            shapes.push(SceneShape::Rod { from: [0.0; 3], to, radius: self.radius });
        }
        if s.tree.joint[body - 1] == JointType::Prismatic {
            shapes.push(self.slide(body));
        }
        shapes.push(SceneShape::Joint([0.0; 3]));
        if !bends {
            shapes.extend(self.tips(body).map(SceneShape::Tip));
        }
        ScenePart {
            name: format!("link {body}"),
            layer: 0,
            look: PartLook::Link,
            shapes,
            poses: self.of_bodies(body),
        }
    }

    /// Tips of a body whose link bends: they move with the link's end.
    fn tip_of_bent(&self, body: usize) -> Option<ScenePart> {
        let shapes: Vec<_> = self.tips(body).map(SceneShape::Tip).collect();
        let poses = self.poses.iter().map(|pose| ScenePose::of(&pose.ends[body])).collect();
        (self.bends(body) && !shapes.is_empty()).then(|| ScenePart {
            name: format!("end of link {body}"),
            layer: 0,
            look: PartLook::Link,
            shapes,
            poses,
        })
    }

    /// From where a prismatic joint is mounted to where its body is, the body's axes.
    fn slide(&self, body: usize) -> SceneShape {
        let parent = self.robot.structure().tree.parent[body - 1];
        let mount = three(self.p, self.at.joint_position + 3 * (body - 1));
        let points = self.poses.iter().map(|pose| {
            let (own, carrier) = (&pose.bodies[body], &pose.ends[parent]);
            let place = add(carrier.origin, times(&carrier.rotation, mount));
            vec![inward(own, place), [0.0; 3]]
        });
        SceneShape::Curve { points: points.collect(), radius: 0.6 * self.radius }
    }

    /// A link that bends, from its joint to what is fixed to its end at `place` (unbent): the cubic with its ends' directions.
    fn bent(&self, body: usize, place: Vector3<f64>) -> SceneShape {
        let points = self.poses.iter().map(|pose| {
            let (own, end) = (&pose.bodies[body], &pose.ends[body]);
            let last = inward(own, add(end.origin, times(&end.rotation, place)));
            let along = inward(own, add(own.origin, times(&end.rotation, place)));
            let point = |i: usize| {
                let z = i as f64 / STATIONS as f64;
                let (a, b) = (z * (1.0 - z) * (1.0 - z), z * z * (z - 1.0));
                let c = z * z * (3.0 - 2.0 * z);
                add(scale(a, place), add(scale(b, along), scale(c, last)))
            };
            (0..=STATIONS).map(point).collect()
        });
        SceneShape::Curve { points: points.collect(), radius: self.radius }
    }

    /// An appendage that is a beam: a strip across the direction in which it bends more easily.
    fn panel(&self, k: usize, states: &[Vec<f64>]) -> ScenePart {
        let (p, at) = (self.p, &self.at);
        let side = if p[at.bending_x + k] > p[at.bending_y + k] { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let turn = self.appendage_axes(k);
        let half = 0.12 * p[at.appendage_length + k];
        let points = self.poses.iter().zip(states).map(|(pose, x)| {
            let across = scale(half, times(&pose.bodies[0].rotation, times(&turn, side)));
            let at = |i: usize| self.robot.beam_point(p, x, pose, k, i as f64 / STATIONS as f64);
            (0..=STATIONS).flat_map(|i| [add(at(i), across), sub(at(i), across)]).collect()
        });
        ScenePart {
            name: format!("appendage {}", k + 1),
            layer: 0,
            look: PartLook::Panel,
            shapes: vec![SceneShape::Strip(points.collect())],
            poses: vec![ScenePose::NEUTRAL],
        }
    }

    /// Appendages that are tables of modes, which have no shapes: a rod through the centre of mass.
    fn tables(&self) -> Option<ScenePart> {
        let (s, p, at) = (self.robot.structure(), self.p, &self.at);
        let rod = |k: usize| {
            let place = s.appendages.len() + k;
            let from = three(p, at.appendage_position + 3 * place);
            let to =
                add(from, times(&self.appendage_axes(place), scale(2.0, three(p, at.table_center + 3 * k))));
            SceneShape::Rod { from, to, radius: self.radius }
        };
        let shapes: Vec<_> = (0..s.tables.len()).map(rod).collect();
        (!shapes.is_empty()).then(|| ScenePart {
            name: "appendages by tables".into(),
            layer: 0,
            look: PartLook::Panel,
            shapes,
            poses: self.of_bodies(0),
        })
    }
}

/// A point of the inertial frame in these axes.
fn inward(frame: &SpatialFrame<f64>, point: Vector3<f64>) -> Vector3<f64> {
    transposed_times(&frame.rotation, sub(point, frame.origin))
}

fn three(values: &[f64], begin: usize) -> Vector3<f64> {
    [values[begin], values[begin + 1], values[begin + 2]]
}
