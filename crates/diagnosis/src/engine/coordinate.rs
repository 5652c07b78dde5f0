//! The coordinates of a plant: which states they are, which outputs show them.

use std::iter;

use trueup_models::effect::{EffectSet, PlantKind};
use trueup_models::{arm, joint};

use super::subject::{DiagnosisSubject, EngineModel};

/// A coordinate of the plant.
#[derive(Clone, Debug, Default)]
pub struct CoordinateReadings {
    /// States that move with a change of its position, with their factors.
    pub position: Vec<(usize, f64)>,
    /// Those that move with a change of its velocity.
    pub velocity: Vec<(usize, f64)>,
    /// Mode that holds it still while it is 0 (dry friction).
    pub held: Option<usize>,
    /// Outputs that show its position, as factor times it.
    pub positions: Vec<(usize, f64)>,
    /// Outputs that show its velocity.
    pub velocities: Vec<(usize, f64)>,
    /// Parameters that set its first position and velocity.
    pub start: Option<[usize; 2]>,
    /// Inputs that drive it: acceleration per unit.
    pub driven: Vec<(usize, f64)>,
    /// Joint whose spring holds it, and how far it moves for a deflection of 1.
    pub spring: Option<(usize, f64)>,
    /// What moves with it without a spring.
    pub other_end: Option<OtherEnd>,
}

/// Load or motor of a rigid joint, the one that is no coordinate: it begins where it is seen, or where the coordinate is.
#[derive(Clone, Debug)]
pub struct OtherEnd {
    /// Parameters that set its first angle and velocity.
    pub start: [usize; 2],
    /// How much further the coordinate turns.
    pub gear: f64,
    /// Output that it is seen in.
    pub shown: Option<usize>,
}

impl DiagnosisSubject {
    /// The coordinates of a model of this plant with these parameters.
    pub fn coordinates(&self, model: &EngineModel, p: &[f64]) -> Vec<CoordinateReadings> {
        match (self.plant, model) {
            (PlantKind::Joint, EngineModel::Joint(m)) => joint_coordinates(m, p),
            (PlantKind::Arm, EngineModel::Arm(m)) => arm_coordinates(m, p),
            _ => Vec::new(),
        }
    }
}

/// The effect of a servo's reference relative to the torque of a motor of that inertia.
fn by_servo(effects: &EffectSet, values: &[f64], site: usize, per_torque: f64) -> Option<(usize, f64)> {
    let servo = effects.servo()?;
    Some((servo.begin.inputs + site, values[servo.begin.parameters + site] * per_torque))
}

fn joint_coordinates(m: &joint::TwoMassJoint, values: &[f64]) -> Vec<CoordinateReadings> {
    use joint::{input as i, output as o, parameter as p};
    let (n, j_m, j_l) = (values[p::GEAR_RATIO], values[p::MOTOR_INERTIA], values[p::LOAD_INERTIA]);
    let flexible = m.flexible();
    let inertia = if flexible { j_m } else { j_m + j_l / (n * n) };
    let driven = (i::MOTOR_CURRENT, values[p::TORQUE_CONSTANT] / inertia);
    let motor = CoordinateReadings {
        position: if flexible { vec![(0, 1.0), (2, 1.0)] } else { vec![(0, 1.0)] },
        velocity: vec![(1, 1.0)],
        held: Some(0),
        positions: vec![(o::MOTOR_ANGLE, 1.0)],
        velocities: vec![(o::MOTOR_VELOCITY, 1.0)],
        start: Some([p::INITIAL_MOTOR_ANGLE, p::INITIAL_MOTOR_VELOCITY]),
        driven: iter::once(driven).chain(by_servo(m.effects(), values, 0, n / inertia)).collect(),
        spring: flexible.then_some((0, 1.0)),
        other_end: None,
    };
    let load_start = [p::INITIAL_LOAD_ANGLE, p::INITIAL_LOAD_VELOCITY];
    if !flexible {
        let positions = vec![(o::MOTOR_ANGLE, 1.0), (o::LOAD_ANGLE, 1.0 / n)];
        let velocities = vec![(o::MOTOR_VELOCITY, 1.0), (o::LOAD_VELOCITY, 1.0 / n)];
        let other_end = Some(OtherEnd { start: load_start, gear: n, shown: Some(o::LOAD_ANGLE) });
        return vec![CoordinateReadings { positions, velocities, other_end, ..motor }];
    }
    let load = CoordinateReadings {
        position: vec![(2, -n)],
        velocity: vec![(3, 1.0)],
        held: None,
        positions: vec![(o::LOAD_ANGLE, 1.0)],
        velocities: vec![(o::LOAD_VELOCITY, 1.0)],
        start: Some(load_start),
        driven: vec![(i::EXTERNAL_TORQUE, 1.0 / j_l)],
        spring: Some((0, 1.0 / n)),
        other_end: None,
    };
    vec![motor, load]
}

fn arm_coordinates(m: &arm::PlanarManipulator, values: &[f64]) -> Vec<CoordinateReadings> {
    use arm::{input as i, output as o, parameter as p};
    let (n, dofs) = (m.links(), m.dofs());
    let of = |row: usize, position: usize, velocity: usize, start: [usize; 2]| CoordinateReadings {
        position: vec![(row, 1.0)],
        velocity: vec![(dofs + row, 1.0)],
        held: None,
        positions: vec![(position, 1.0)],
        velocities: vec![(velocity, 1.0)],
        start: Some(start),
        ..CoordinateReadings::default()
    };
    let mut all: Vec<CoordinateReadings> = (0..2)
        .map(|i| {
            let start = [p::initial_base_position(n) + i, p::initial_base_velocity(n) + i];
            of(i, o::base_position(n) + i, o::base_velocity(n) + i, start)
        })
        .collect();
    let start = [p::initial_base_attitude(n), p::initial_base_rate(n)];
    all.push(of(2, o::base_attitude(n), o::base_rate(n), start));
    if m.has_fixed_base() {
        // It stays where its parameters say, whatever a sensor shows.
        all.iter_mut().for_each(|c| {
            *c = CoordinateReadings {
                position: c.position.clone(),
                velocity: c.velocity.clone(),
                ..CoordinateReadings::default()
            };
        });
    }
    for j in 0..n {
        let start = [p::initial_joint_angle(n) + j, p::initial_joint_velocity(n) + j];
        let mut c = of(3 + j, o::joint_angle(n) + j, o::joint_velocity(n) + j, start);
        let motor = (o::motor_angle(n) + j, o::motor_velocity(n) + j);
        let motor_start = [p::initial_motor_angle(n) + j, p::initial_motor_velocity(n) + j];
        if m.flexible()[j] {
            c.spring = Some((j, 1.0));
            all.push(c);
            c = of(m.motor(j), motor.0, motor.1, motor_start);
            c.spring = Some((j, 1.0));
        } else {
            c.positions.push((motor.0, 1.0));
            c.velocities.push((motor.1, 1.0));
            c.other_end = Some(OtherEnd { start: motor_start, gear: 1.0, shown: Some(motor.0) });
        }
        let inertia = if m.flexible()[j] { p::motor_inertia(n) } else { p::link_inertia(n) } + j;
        let per_torque = 1.0 / values[inertia].max(1e-9);
        c.driven = vec![(i::joint_torque(n) + j, per_torque)];
        c.driven.extend(by_servo(m.effects(), values, j, per_torque));
        c.held = m.has_friction().then_some(j);
        all.push(c);
    }
    all
}

pub(crate) fn median_step(t: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}
