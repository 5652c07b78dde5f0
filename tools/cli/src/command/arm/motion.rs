//! The arm of a map, drawn over the angles of the map.

use trueup_scene::{MotionRecord, Scene, robot_scene};

use super::asked::ArmRequest;
use super::found::ArmMapResult;

/// Of the picture, s per pose.
const PACE: f64 = 0.15;

/// The first joint of the map over its angles, then the second one, unbent; `None` of an arm that has no picture.
pub(super) fn scene(asked: &ArmRequest<'_>, found: &ArmMapResult) -> Option<Scene> {
    let ([a, b], [along_a, along_b]) = (found.grid.joints, &found.grid.at);
    let (first_b, last_a) = (*along_b.first()?, *along_a.last()?);
    let over_a = along_a.iter().map(|q| [*q, first_b]);
    let pairs: Vec<[f64; 2]> = over_a.chain(along_b.iter().map(|q| [last_a, *q])).collect();
    let time: Vec<f64> = (0..pairs.len()).map(|k| PACE * k as f64).collect();
    let angle = |joint: usize, pair: &[f64; 2]| match joint {
        j if j == a => pair[0],
        j if j == b => pair[1],
        j => asked.motors[j],
    };
    let joints = (0..asked.motors.len())
        .map(|j| (format!("jointAngle[{}]", j + 1), pairs.iter().map(|pair| angle(j, pair)).collect()));
    let robot = asked.on.arm.bodies();
    let straight = (0..robot.structure().linked())
        .map(|k| (format!("linkModalCoordinate[{}]", k + 1), vec![0.0; pairs.len()]));
    let columns: Vec<(String, Vec<f64>)> = joints.chain(straight).collect();
    let find = |name: &str| columns.iter().find(|c| c.0 == name).map(|c| c.1.as_slice());
    robot_scene(robot, &asked.on.parameters, &MotionRecord::new(&time, &find)).ok()
}
