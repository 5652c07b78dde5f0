//! Poses of scenes against the models' own outputs, along drawn motions.

use trueup_models::arm::PlanarManipulator;
use trueup_models::contact::{CaptureScene, RigidChaser};
use trueup_models::layout::LayoutEntry;
use trueup_models::space::{SpatialFreeFlyer, presets};
use trueup_numerics::hybrid::{At, Hybrid};
use trueup_scene::{MotionRecord, Scene, SceneShape, capture_scene, planar_scene, robot_scene};

const SEED: u64 = 0x5eed_0067;

/// SplitMix64, -1 .. 1.
fn draw(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn names<K>(entries: &[LayoutEntry<K>]) -> Vec<String> {
    entries.iter().flat_map(|e| trueup_plant::elements(e.name, &e.dimensions)).collect()
}

/// Outputs of a model at drawn states: one row of names and one of values per state.
fn outputs(model: &impl Hybrid, p: &[f64], scale: f64, rows: usize) -> Vec<Vec<f64>> {
    println!("seed {SEED:#x}");
    let (sizes, mut state) = (model.sizes(), SEED);
    let mut columns = vec![Vec::new(); sizes.outputs];
    let mut x = vec![0.0; sizes.states];
    for _ in 0..rows {
        model.start(p, &mut x);
        x.iter_mut().for_each(|v| *v += scale * draw(&mut state));
        let (u, mut modes, mut y) = (vec![0.0; sizes.inputs], vec![0; sizes.modes], vec![0.0; sizes.outputs]);
        model.start_modes(At { t: 0.0, x: &x, u: &u, p, modes: &modes.clone() }, &mut modes);
        model.outputs(At { t: 0.0, x: &x, u: &u, p, modes: &modes }, &mut y);
        columns.iter_mut().zip(y).for_each(|(column, value)| column.push(value));
    }
    columns
}

/// Each tip's way in the scene.
fn tips(scene: &Scene) -> Vec<Vec<[f64; 3]>> {
    let of_part = |part: &trueup_scene::ScenePart| {
        let own =
            part.shapes.iter().filter_map(|s| if let SceneShape::Tip(at) = s { Some(*at) } else { None });
        own.map(|at| part.poses.iter().map(|pose| pose.placed(at)).collect()).collect::<Vec<_>>()
    };
    scene.parts.iter().flat_map(of_part).collect()
}

fn compare(ways: &[Vec<[f64; 3]>], name: &str, column: impl Fn(&str) -> Option<Vec<f64>>, planar: bool) {
    assert!(!ways.is_empty());
    for (a, way) in ways.iter().enumerate() {
        for i in 0..if planar { 2 } else { 3 } {
            let element =
                if planar { format!("{name}[{}]", i + 1) } else { format!("{name}[{},{}]", a + 1, i + 1) };
            let wanted = column(&element).unwrap();
            for (point, wanted) in way.iter().zip(&wanted) {
                assert!((point[i] - wanted).abs() < 1e-12, "{element}: {} for {wanted}", point[i]);
            }
        }
    }
}

#[test]
fn tips_are_where_the_models_outputs_have_them() {
    let rows = 25;
    let time: Vec<f64> = (0..rows).map(f64::from).collect();
    for preset in presets::PRESETS {
        let design = (preset.design)();
        let robot = SpatialFreeFlyer::new(design.structure()).unwrap();
        let p = design.parameters();
        let columns = outputs(&robot, &p, 0.2, rows as usize);
        let names = names(&trueup_models::space::layout::Outputs::list(robot.structure()));
        let find = |name: &str| names.iter().position(|n| n == name).map(|k| &columns[k][..]);
        let scene = robot_scene(&robot, &p, &MotionRecord::new(&time, &find)).unwrap();
        assert!(
            !scene.planar
                && scene.parts.iter().all(|part| part.poses.iter().all(|p| p.origin[0].is_finite()))
        );
        compare(&tips(&scene), "tipPosition", |name| find(name).map(<[f64]>::to_vec), false);
        let strips = scene.parts.iter().filter(|part| part.name.starts_with("appendage "));
        for (k, part) in strips.enumerate() {
            let SceneShape::Strip(points) = &part.shapes[0] else { panic!("{:?}", part.shapes) };
            for (row, edges) in points.iter().enumerate() {
                let [.., left, right] = &edges[..] else { panic!("no end") };
                for i in 0..3 {
                    let wanted = find(&format!("appendageTipPosition[{},{}]", k + 1, i + 1)).unwrap()[row];
                    assert!((0.5 * (left[i] + right[i]) - wanted).abs() < 1e-12);
                }
            }
        }
    }
}

#[test]
fn a_planar_arm_ends_where_its_tip_is() {
    let arm = PlanarManipulator::new::<&str>(&[true, false, true], &[]).unwrap();
    let (p, rows) = (arm.defaults(), 25);
    let time: Vec<f64> = (0..rows).map(f64::from).collect();
    let columns = outputs(&arm, &p, 1.0, rows as usize);
    let layout = trueup_models::arm::ArmLayout { links: 3, motors: 2, friction: false };
    let names = names(&trueup_models::arm::output::list(&layout));
    let find = |name: &str| names.iter().position(|n| n == name).map(|k| &columns[k][..]);
    let scene = planar_scene(&arm, &p, &MotionRecord::new(&time, &find)).unwrap();
    compare(&tips(&scene), "tipPosition", |name| find(name).map(<[f64]>::to_vec), true);
    let motors = scene.parts.iter().filter(|part| part.name.starts_with("motor")).count();
    assert_eq!(motors, 2);
    // Only what is missing is drawn without its twist, and a note names it; a rigid joint has no motor of its own.
    for (missing, noted) in [("motorAngle[1]", true), ("motorAngle[2]", false)] {
        let all_but = |name: &str| if name == missing { None } else { find(name) };
        let other = planar_scene(&arm, &p, &MotionRecord::new(&time, &all_but)).unwrap();
        assert_eq!(
            other.notes.iter().any(|note| note.contains(missing)),
            noted,
            "{missing}: {:?}",
            other.notes
        );
        for (part, whole) in other.parts.iter().zip(&scene.parts) {
            let same = part.poses == whole.poses;
            assert_eq!(same, !(noted && part.name == "motor 1"), "{missing}: {}", part.name);
        }
    }
    let e = planar_scene(
        &arm,
        &p,
        &MotionRecord::new(&time, &|name| (name != "jointAngle[2]").then(|| find(name))?),
    );
    assert_eq!(e.unwrap_err().to_string(), "the motion is not drawn: `jointAngle[2]` is not recorded");
}

/// What touches in the model touches in the picture: the distances of balls are penetration and gap.
#[test]
fn balls_are_as_far_apart_as_their_gaps() {
    let capture =
        CaptureScene::new(RigidChaser::default(), trueup_models::contact::GripperStructure::default())
            .unwrap();
    let (p, rows) = (capture.defaults(), 20);
    let time: Vec<f64> = (0..rows).map(f64::from).collect();
    let columns = outputs(&capture, &p, 0.02, rows as usize);
    let names = [
        names(&trueup_models::contact::layout::Outputs::list(capture.structure())),
        names(&trueup_models::contact::layout::ChaserOutputs::list(&())),
        names(&trueup_models::contact::layout::SceneOutputs::list(&())),
    ]
    .concat();
    let find = |name: &str| names.iter().position(|n| n == name).map(|k| &columns[k][..]);
    let scene = capture_scene(&capture, &p, &MotionRecord::new(&time, &find)).unwrap();
    let target = scene.parts.iter().find(|part| part.name == "target").unwrap();
    let ball = |part: &trueup_scene::ScenePart| {
        part.shapes.iter().find_map(|s| match s {
            SceneShape::Ball { center, radius } => Some((*center, *radius)),
            _ => None,
        })
    };
    let (port, outer) = ball(target).unwrap();
    for i in 1..=3 {
        let part = scene.parts.iter().find(|part| part.name == format!("ball P{i}")).unwrap();
        let (center, radius) = ball(part).unwrap();
        let depth = find(&format!("penetration[{i}]")).unwrap();
        for (k, depth) in depth.iter().enumerate() {
            let (a, b) = (part.poses[k].placed(center), target.poses[k].placed(port));
            let gap = (a[0] - b[0]).hypot(a[1] - b[1]) - radius - outer;
            assert!((gap + depth).abs() < 1e-12, "P{i}: {gap} for {}", -depth);
        }
    }
}
