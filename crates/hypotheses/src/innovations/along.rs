//! The smoothed trajectory of a joint as laws see it. Nothing here is an acceleration or a latent.

use std::cell::OnceCell;
use std::f64::consts::PI;

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::intake::{IntakeRecording, RecordedInput};
use trueup_estimation::innovations::numeric::{over_steps, quantile, sign};
use trueup_estimation::innovations::two_mass::{coordinate, parameter};

/// Friction is looked at so often within a step.
pub const PARTS: usize = 4;

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
        let samples =
            |r: usize| current(&frame.intake.recordings[r]).map_or_else(Vec::new, |i| i.values.clone());
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

/// Turns of the motor per turn of the load; 1 where the load is not read.
pub fn gear_ratio(frame: &InnovationsFrame) -> f64 {
    frame.plant.readings().iter().find(|r| r.state == 2).map_or(1.0, |r| r.factor)
}

/// Within the steps: [`PARTS`] values a step.
#[derive(Clone, Debug)]
pub struct WithinSteps {
    /// Sign of the nominal plant's friction.
    pub sign: Vec<f64>,
    /// Speed of the motor, 0 at rest.
    pub speed: Vec<f64>,
    /// Angle of the motor.
    pub angle: Vec<f64>,
    /// Twist.
    pub twist: Vec<f64>,
    /// Rate of twist.
    pub twist_rate: Vec<f64>,
    /// Time, s.
    pub time: Vec<f64>,
}

/// Series by node of one recording; angles on the motor's side.
#[derive(Clone, Debug)]
pub struct JointSeries {
    /// Step, s.
    pub dt: f64,
    /// Number of nodes.
    pub nodes: usize,
    /// Angle of the motor, rad.
    pub motor: Vec<f64>,
    /// Its speed, rad/s.
    pub motor_speed: Vec<f64>,
    /// Angle of the load, rad.
    pub load: Vec<f64>,
    /// Its speed, rad/s.
    pub load_speed: Vec<f64>,
    /// Twist, rad.
    pub twist: Vec<f64>,
    /// Its rate, rad/s.
    pub twist_rate: Vec<f64>,
    /// Torque of the spring as the model has it, N.m.
    pub torque: Vec<f64>,
    within: OnceCell<WithinSteps>,
}

impl JointSeries {
    /// Time of a node, s.
    pub fn time(&self, node: usize) -> f64 {
        node as f64 * self.dt
    }
    /// A series by node.
    pub fn by_node(&self, f: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.nodes).map(f).collect()
    }
}

/// A frame's trajectory, with the units that columns are made in.
pub struct JointAlong<'a> {
    /// The frame.
    pub frame: &'a InnovationsFrame,
    /// Usual sizes.
    pub sizes: &'a UsualSizes,
    /// Recordings.
    pub runs: Vec<JointSeries>,
    /// Unit of torque, N.m.
    pub unit: f64,
    /// Unit of angle of reading errors, rad; see [`UsualSizes::angle_unit`].
    pub angle_unit: f64,
    /// Stiffness in hand, N.m/rad; 0: rigid.
    pub stiffness: f64,
    /// Damping in hand, N.m.s/rad.
    pub damping: f64,
    /// Turns of the motor per turn of the load.
    pub gear_ratio: f64,
}

impl<'a> JointAlong<'a> {
    /// Along the present trajectory of a frame.
    pub fn new(frame: &'a InnovationsFrame, sizes: &'a UsualSizes) -> Self {
        let (stiffness, damping) = (frame.theta[parameter::STIFFNESS], frame.theta[parameter::DAMPING]);
        let runs = frame.runs.iter().map(|r| {
            let [motor, motor_speed, load, load_speed] = [0, 1, 2, 3].map(|k| r.state(k));
            let twist: Vec<f64> = motor.iter().zip(&load).map(|(a, b)| a - b).collect();
            let twist_rate: Vec<f64> = motor_speed.iter().zip(&load_speed).map(|(a, b)| a - b).collect();
            let torque = twist.iter().zip(&twist_rate).map(|(t, r)| stiffness * t + damping * r).collect();
            JointSeries {
                dt: r.dt,
                nodes: r.nodes,
                motor,
                motor_speed,
                load,
                load_speed,
                twist,
                twist_rate,
                torque,
                within: OnceCell::new(),
            }
        });
        Self {
            frame,
            sizes,
            runs: runs.collect(),
            unit: frame.plant.usual_force(),
            angle_unit: sizes.angle_unit(frame),
            stiffness,
            damping,
            gear_ratio: gear_ratio(frame),
        }
    }

    /// Parameter in hand.
    pub fn parameter(&self, k: usize) -> f64 {
        self.frame.theta[k]
    }
    /// The nominal value of a parameter.
    pub fn nominal(&self, k: usize) -> f64 {
        self.frame.plant.parameters()[k].value
    }
    /// Speed linear, angle cubic, the sign of friction as the nominal plant has it, within the steps of a recording.
    pub fn within(&self, recording: usize) -> &WithinSteps {
        let r = &self.runs[recording];
        let signs = &self.frame.runs[recording].signs.sign;
        r.within.get_or_init(|| within_steps(r, signs))
    }
    /// A force on the motor from values within the steps.
    pub fn on_motor(&self, f: impl Fn(&WithinSteps, usize) -> f64) -> FilterColumn {
        let one = |k: usize| {
            let w = self.within(k);
            let mean = |t: usize| (PARTS * t..PARTS * (t + 1)).map(|i| f(w, i)).sum::<f64>() / PARTS as f64;
            ColumnPart::force(coordinate::MOTOR, (0..self.runs[k].nodes).map(mean).collect())
        };
        (0..self.runs.len()).map(one).collect()
    }
    /// What the torque of another input has more than that of the recorded one.
    pub fn of_current(&self, means: impl Fn(&RecordedInput) -> Vec<f64>) -> FilterColumn {
        let gain = self.parameter(parameter::TORQUE_CONSTANT);
        let one = |r: &IntakeRecording| {
            let other = current(r).map_or_else(Vec::new, &means);
            let more = r.means[0].iter().zip(other).map(|(u, o)| -gain * (u - o)).collect();
            ColumnPart::force(coordinate::MOTOR, more)
        };
        self.frame.intake.recordings.iter().map(one).collect()
    }
    /// A torque between motor and load, by node: minus on the motor, plus on the load.
    pub fn in_spring(&self, f: impl Fn(&JointSeries) -> Vec<f64>) -> FilterColumn {
        self.runs.iter().map(|r| ColumnPart::forces(&[-1.0, 1.0], over_steps(&f(r)))).collect()
    }
    /// A torque on the load, by node.
    pub fn on_load(&self, f: impl Fn(&JointSeries) -> Vec<f64>) -> FilterColumn {
        self.runs.iter().map(|r| ColumnPart::force(coordinate::LOAD, over_steps(&f(r)))).collect()
    }
    /// A reading error of a channel, by recording, node and time of the reading; `None`: the channel was not recorded.
    pub fn of_reading(&self, channel: usize, f: impl Fn(usize, usize, f64) -> f64) -> FilterColumn {
        let channels = self.frame.channels();
        let one = |k: usize| {
            let (r, run) = (&self.runs[k], &self.frame.runs[k]);
            let value = |t: usize| f(k, t, r.time(t) + run.moments[channels * t + channel][0]);
            ColumnPart::reading(channel, r.by_node(value))
        };
        (0..self.runs.len()).map(one).collect()
    }
    /// Smoothed angle that a channel shows, at any time of a recording: cubic between nodes.
    pub fn angle_at(&self, recording: usize, state: usize, time: f64) -> f64 {
        let r = &self.runs[recording];
        let (q, v) = if state == 0 { (&r.motor, &r.motor_speed) } else { (&r.load, &r.load_speed) };
        let k = ((time / r.dt) as usize).min(r.nodes - 2);
        let x = (time / r.dt - k as f64).clamp(0.0, 1.0);
        let h = hermite(x);
        q[k] * h[0] + r.dt * v[k] * h[1] + q[k + 1] * h[2] + r.dt * v[k + 1] * h[3]
    }
    /// Means over the steps of sin and of cos of `order` times the motor's angle, exact along a straight piece.
    pub fn order_means(&self, recording: usize, order: f64) -> [Vec<f64>; 2] {
        let r = &self.runs[recording];
        let mut means = [Vec::with_capacity(r.nodes), Vec::with_capacity(r.nodes)];
        for t in 0..r.nodes {
            let d = r.motor[(t + 1).min(r.nodes - 1)] - r.motor[t];
            let (sin, cos) = (order * (r.motor[t] + 0.5 * d)).sin_cos();
            let within = sinc(0.5 * order * d);
            means[0].push(sin * within);
            means[1].push(cos * within);
        }
        means
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}

fn hermite(x: f64) -> [f64; 4] {
    let y = 1.0 - x;
    [(1.0 + 2.0 * x) * y * y, x * y * y, x * x * (3.0 - 2.0 * x), x * x * (x - 1.0)]
}

fn within_steps(r: &JointSeries, signs: &[f64]) -> WithinSteps {
    let all = PARTS * r.nodes;
    let empty = || Vec::with_capacity(all);
    let mut w = WithinSteps {
        sign: empty(),
        speed: empty(),
        angle: empty(),
        twist: empty(),
        twist_rate: empty(),
        time: empty(),
    };
    for t in 0..r.nodes {
        let next = (t + 1).min(r.nodes - 1);
        let (a, b) = (signs[t], signs[next]);
        for part in 0..PARTS {
            let x = (part as f64 + 0.5) / PARTS as f64;
            let line = |s: &[f64]| s[t] + (s[next] - s[t]) * x;
            let speed = line(&r.motor_speed);
            w.sign.push(if a * b < 0.0 { sign(speed) } else { 0.5 * (a + b) });
            w.speed.push(if a == 0.0 && b == 0.0 { 0.0 } else { speed });
            let h = hermite(x);
            let rates = r.dt * (r.motor_speed[t] * h[1] + r.motor_speed[next] * h[3]);
            let angle = r.motor[t] * h[0] + r.motor[next] * h[2] + rates;
            w.angle.push(if next == t { r.motor[t] } else { angle });
            w.twist.push(line(&r.twist));
            w.twist_rate.push(line(&r.twist_rate));
            w.time.push(r.time(t) + r.dt * x);
        }
    }
    w
}
