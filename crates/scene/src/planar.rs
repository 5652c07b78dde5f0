//! The planar manipulator.

use crate::record::{MissingColumn, MotionRecord};
use crate::scene::{PartLook, Scene, ScenePart, ScenePose, SceneShape};
use trueup_models::arm::chain::Chain;
use trueup_models::arm::{PlanarManipulator, parameter};

/// Of `PlanarManipulator` with these parameters: a square of the satellite's mass and inertia, links from joint to joint, and of
/// each joint with a spring its motor.
///
/// # Errors
/// A coordinate is not recorded.
pub fn planar_scene(
    arm: &PlanarManipulator,
    p: &[f64],
    record: &MotionRecord<'_>,
) -> Result<Scene, MissingColumn> {
    let n = arm.links();
    // A base that is fixed need not be recorded.
    let (places, turn) = (parameter::initial_base_position(n), parameter::initial_base_attitude(n));
    let rows = record.times().len();
    let base = match record.vector::<2>("basePosition") {
        Err(_) if arm.has_fixed_base() => vec![[p[places], p[places + 1]]; rows],
        found => found?,
    };
    let attitude = match record.series("baseAttitude") {
        Err(_) if arm.has_fixed_base() => vec![p[turn]; rows],
        found => found?,
    };
    let named = |name: &str| (1..=n).map(|i| format!("{name}[{i}]")).collect::<Vec<_>>();
    let angles = record.elements(&named("jointAngle"))?;
    // A motor that is not recorded is drawn where its joint is, which a note reports of one behind a spring.
    let motors: Vec<_> = named("motorAngle").iter().map(|name| record.series(name).ok()).collect();
    let chain = Chain::new(n, p);
    // Poses of all bodies: the satellite's in its centre of mass, a link's in its joint.
    let mut poses: Vec<Vec<ScenePose>> = vec![Vec::new(); n + 1];
    let mut rotors: Vec<Vec<ScenePose>> = vec![Vec::new(); n + 1];
    for (k, angles) in angles.iter().enumerate() {
        let q: Vec<f64> = base[k].iter().chain([&attitude[k]]).chain(angles).copied().collect();
        let now = chain.turned(&q, &vec![0.0; q.len()]);
        let mut place = base[k];
        for body in 0..=n {
            poses[body].push(ScenePose::planar(place, now.angle[body]));
            if body > 0 {
                let motor = motors[body - 1].as_ref().map_or(angles[body - 1], |angle| angle[k]);
                rotors[body].push(ScenePose::planar(place, now.angle[body - 1] + motor));
            }
            place = [place[0] + now.arm[body][0], place[1] + now.arm[body][1]];
        }
    }
    let length = |body: usize| chain.arm[body][0].hypot(chain.arm[body][1]);
    let reach: f64 = (0..=n).map(length).sum();
    let radius = 0.018 * reach;
    let mut scene = Scene { planar: true, time: record.times().to_vec(), ..Scene::default() };
    for (k, _) in
        motors.iter().zip(arm.flexible()).enumerate().filter(|(_, (m, spring))| m.is_none() && **spring)
    {
        let number = k + 1;
        let note = format!(
            "Motor {number} is drawn without the twist of its joint: `motorAngle[{number}]` is not recorded."
        );
        scene.notes.push(note);
    }
    let mut add = |name: String, look, shapes, poses| {
        scene.parts.push(ScenePart { name, layer: 0, look, shapes, poses });
    };
    let half = (1.5 * p[parameter::base_inertia(n)] / p[parameter::base_mass(n)]).sqrt().min(reach);
    let mount = [chain.arm[0][0], chain.arm[0][1], 0.0];
    let square = SceneShape::Block { center: [0.0; 3], half: [half, half, half] };
    let bracket = SceneShape::Rod { from: [0.0; 3], to: mount, radius: 1.4 * radius };
    let satellite = if arm.has_fixed_base() { PartLook::Ground } else { PartLook::Base };
    add("satellite".into(), satellite, vec![bracket, square], poses.remove(0));
    for (k, poses) in poses.into_iter().enumerate() {
        let body = k + 1;
        let end = [chain.arm[body][0], chain.arm[body][1], 0.0];
        let mut shapes =
            vec![SceneShape::Rod { from: [0.0; 3], to: end, radius }, SceneShape::Joint([0.0; 3])];
        if body == n {
            shapes.push(SceneShape::Tip(end));
        }
        if arm.flexible()[k] {
            let to = [0.4 * end[0], 0.4 * end[1], 0.0];
            let rod = SceneShape::Rod { from: [0.0; 3], to, radius: 1.6 * radius };
            add(format!("motor {body}"), PartLook::Motor, vec![rod], std::mem::take(&mut rotors[body]));
        }
        add(format!("link {body}"), PartLook::Link, shapes, poses);
    }
    Ok(scene)
}
