//! The trajectory of a joint's frame as laws see it. Angles are on the motor's side.

use std::f64::consts::PI;

use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::intake::{IntakeRecording, RecordedInput};
use trueup_estimation::innovations::numeric::quantile;
use trueup_estimation::innovations::two_mass::coordinate;

use super::along::PlantAlong;
use super::drive::DriveAlong;
use super::place::{ChannelPlace, JointPlace, MotionInStep, ShownBy};
use super::run_along::RunAlong;

/// Friction is looked at so often within a step.
const PARTS: usize = 4;
/// Least damping that a law of damping takes as usual, over the stiffness, s.
const LEAST_DAMPING: f64 = 2e-4;

/// Usual sizes along the trajectory that a search begins with.
#[derive(Clone, Debug, PartialEq)]
pub struct UsualSizes {
    /// Largest current, A.
    pub current: f64,
    /// Speed of the motor, reached 3 % of the time, rad/s.
    pub motor_speed: f64,
    /// Speed of the load on the motor's side, reached 5 % of the time, rad/s.
    pub load_speed: f64,
    /// Largest angle of the load, rad.
    pub load_angle: f64,
    /// Twist, reached 2 % of the time, rad.
    pub twist: f64,
    /// Rate of twist, reached 10 % of the time, rad/s.
    pub twist_rate: f64,
    /// Range of the motor's angle, rad.
    pub range: f64,
    /// Longest recording, s.
    pub duration: f64,
}

impl UsualSizes {
    /// Of a frame's trajectory.
    pub fn of(frame: &InnovationsFrame) -> Self {
        let series = |f: &dyn Fn(usize) -> Vec<f64>| -> Vec<f64> {
            (0..frame.runs.len()).flat_map(f).map(f64::abs).collect()
        };
        let state = |k: usize| move |r: usize| frame.runs[r].state(k);
        let apart = |a: usize, b: usize| {
            move |r: usize| -> Vec<f64> {
                let (a, b) = (frame.runs[r].state(a), frame.runs[r].state(b));
                a.iter().zip(b).map(|(a, b)| a - b).collect()
            }
        };
        let most = |all: Vec<f64>| all.into_iter().fold(0.0, f64::max);
        let samples = |r: usize| match current(&frame.intake.recordings[r]) {
            _ if frame.has_servo() => drive(frame, r),
            Some(i) => i.values.clone(),
            None => Vec::new(),
        };
        let range = |r: &Vec<f64>| {
            let (low, high) = r.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
            high - low
        };
        Self {
            current: most(series(&samples)),
            motor_speed: quantile(series(&state(1)), 0.97),
            load_speed: quantile(series(&state(3)), 0.95),
            load_angle: most(series(&state(2))) / gear_ratio(frame),
            twist: quantile(series(&apart(0, 2)), 0.98) + 1e-300,
            twist_rate: quantile(series(&apart(1, 3)), 0.90) + 1e-300,
            range: most(frame.runs.iter().map(|r| range(&r.state(0))).collect()),
            duration: most(frame.runs.iter().map(|r| r.time(r.nodes - 1)).collect()),
        }
    }

    /// Width of an order in the spectrum over the motor's angle.
    pub fn order(&self) -> f64 {
        2.0 * PI / self.range
    }
    /// Unit of angle of reading errors along a frame, rad at the motor: of nominal values, so that amplitudes keep their meaning.
    pub fn angle_unit(&self, frame: &InnovationsFrame) -> f64 {
        let usual = frame.plant.usual_deflection();
        if usual > 0.0 { usual } else { 0.1 * self.motor_speed * 0.05 }
    }
}

fn current(r: &IntakeRecording) -> Option<&RecordedInput> {
    r.inputs.first().and_then(Option::as_ref)
}

/// What drives over the steps of a recording, as a current, A.
fn drive(frame: &InnovationsFrame, recording: usize) -> Vec<f64> {
    if !frame.has_servo() {
        return frame.input_means(recording, 0);
    }
    let mut torque = frame.drive_torque(recording);
    let constant = frame.plant.figures(&frame.theta).torque_constant;
    torque.iter_mut().for_each(|t| *t /= constant);
    torque
}

/// Turns of the motor per turn of the load; 1 where the load is not read.
pub fn gear_ratio(frame: &InnovationsFrame) -> f64 {
    frame.plant.readings().iter().find(|r| r.state == 2).map_or(1.0, |r| r.factor)
}

/// Along the present trajectory of a frame.
pub fn along_joint<'a>(frame: &InnovationsFrame, sizes: &UsualSizes) -> PlantAlong<'a> {
    let ratio = gear_ratio(frame);
    let gear_error = sizes.angle_unit(frame);
    let own = frame.plant.figures(&frame.theta);
    let (stiffness, damping) = (own.stiffness, own.damping);
    let nominal: Vec<f64> = frame.plant.parameters().iter().map(|p| p.value).collect();
    let nominal_damping = frame.plant.figures(&nominal).damping;
    let encoder = frame.intake.channels.first().filter(|c| c.angle);
    let joint = JointPlace {
        motor: coordinate::MOTOR,
        link: coordinate::LOAD,
        torque: frame.plant.usual_force(),
        gear_error,
        stiffness,
        stiffness_name: "stiffness",
        damping,
        link_inertia: own.load_inertia,
        least_damping: nominal_damping.max(LEAST_DAMPING * stiffness),
        turns: ratio,
        rotor_turns: 1.0,
        dry: frame.dry_level(),
        viscous: own.viscous,
        resolution: encoder.map_or(0.0, |c| c.resolution),
        motor_read: encoder.is_some_and(|c| c.state == Some(0)),
        drive: sizes.current,
        motor_speed: sizes.motor_speed,
        link_speed: sizes.load_speed,
        twist: sizes.twist,
        twist_rate: sizes.twist_rate,
        range: sizes.range,
        reach: [0.0, ratio * sizes.load_angle],
    };
    let channels = frame.intake.channels.iter().map(|c| ChannelPlace {
        place: match c.name.as_str() {
            "motorAngle" => "sensor:motorAngle",
            "loadAngle" => "sensor:loadAngle",
            _ => "sensor",
        },
        shows: match c.state {
            Some(k) if c.angle => ShownBy::Position(k / 2),
            Some(k) => ShownBy::Rate(k / 2),
            None => ShownBy::Output,
        },
        error: gear_error,
        turns: if c.state == Some(0) { 1.0 } else { ratio },
        // What is wrong with a reading shows against the other.
        compared: c.angle && frame.two_angles(),
    });
    let runs = (0..frame.runs.len()).map(|k| {
        let (r, recording) = (&frame.runs[k], &frame.intake.recordings[k]);
        let times = (0..r.nodes).map(|t| r.time(t)).collect();
        let states = |first: usize| [first, first + 2].map(|s| r.state(s)).to_vec();
        let channels = frame.channels();
        let moments = |c: usize| (0..r.nodes).map(|t| r.moments[channels * t + c][0]).collect();
        let of_rig = frame.intake.rig.of_input(frame.rig_numbers(), 0, k);
        let means = drive(frame, k);
        let input = if frame.has_servo() {
            Some(RecordedInput::of_steps(means.clone(), r.dt))
        } else {
            current(recording).map(|i| i.corrected(of_rig))
        };
        let gain = own.torque_constant;
        RunAlong {
            signs: r.signs.sign.clone(),
            moments: (0..channels).map(moments).collect(),
            drives: vec![DriveAlong::recorded(gain, means, r.dt, input)],
            own_forces: r.own.forces.clone(),
            own_readings: r.own.readings.clone(),
            ..RunAlong::new(times, vec![r.dt; r.nodes], PARTS, states(0), states(1))
        }
    });
    let mut along = PlantAlong::new(MotionInStep::Straight, vec![joint], channels.collect(), runs.collect());
    // A delay that is estimated takes the place of the effect.
    along.late_together.retain(|group| !group.iter().any(|c| frame.intake.rig.is_late(*c)));
    along
}
