//! Moves of DELIAN between random postures with random payloads, and how much of them vibrates.

use super::loops::{N, settings, with_payload};
use nalgebra::DVector;
use std::error::Error;
use trueup_flexibility::closed_loop::{SampledPlant, linearised, measured};
use trueup_flexibility::droop::droop;
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::controller::adaptation::{KNOTS, parameter as adapt, scheduled, state as adapted};
use trueup_models::controller::{ManipulatorController, Strategy, parameter, state};
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::space::layout::{Parameters, States};
use trueup_numerics::hybrid::{At, Hybrid};

pub(crate) const STEP: f64 = 1e-3;
pub(crate) const TIME: f64 = 6.0;
/// The reference takes this long, s.
pub(crate) const RAMP: f64 = 0.5;
pub(crate) const GAIN: f64 = 2.0;
/// Of the sensors on the joint's side, rad; counts a turn of the motor.
const LOAD_STEP: f64 = 0.001 * std::f64::consts::PI / 180.0;
const COUNTS: f64 = 16.0;
pub(crate) const OMEGAS: [f64; 11] = [5.0, 10.0, 20.0, 40.0, 60.0, 100.0, 150.0, 250.0, 400.0, 600.0, 1000.0];
/// By how much a move may vibrate more than with P/PI, %, for a constant frequency to count.
pub(crate) const WORSE: f64 = 10.0;

/// How moves are run.
#[derive(Clone, Copy)]
pub(crate) struct How {
    /// By quantised encoders.
    pub(crate) sensors: bool,
    /// Without weight.
    pub(crate) orbit: bool,
    /// Vibration counts after the first second.
    pub(crate) late: bool,
    /// By the arm itself, with stick-slip.
    pub(crate) dry: bool,
}

/// What a controller sees of one joint: angles and rates of motor and joint, as encoders have them.
pub(crate) struct Encoders {
    quantised: bool,
    before: [Option<[f64; 2]>; N],
}

impl Encoders {
    pub(crate) fn new(how: How) -> Self {
        Self { quantised: how.sensors, before: [None; N] }
    }
    /// Motor's angle and rate, joint's angle and rate (rad, joint side), `ratio` being the gear's.
    pub(crate) fn read(
        &mut self,
        j: usize,
        [motor, load]: [f64; 2],
        rates: [f64; 2],
        ratio: f64,
    ) -> [f64; 4] {
        if !self.quantised {
            return [motor, rates[0], load, rates[1]];
        }
        let step = std::f64::consts::TAU / COUNTS / ratio;
        let seen = [(motor / step).floor() * step, (load / LOAD_STEP).floor() * LOAD_STEP];
        let before = self.before[j].replace(seen).unwrap_or(seen);
        [seen[0], (seen[0] - before[0]) / STEP, seen[1], (seen[1] - before[1]) / STEP]
    }
}

/// xorshift64*.
struct Random(u64);
impl Random {
    fn between(&mut self, a: f64, b: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        a + (b - a) * bits as f64 / (1u64 << 53) as f64
    }
}

/// A move: the plant about where it ends, and where it starts from.
pub(crate) struct Move {
    pub(crate) p: Vec<f64>,
    plant: SampledPlant,
    /// Deviation of all states at the start.
    start: DVector<f64>,
    /// Torques of the motors at the start and at the end, N.m.
    drive: [Vec<f64>; 2],
    /// Angles of the joints at the end, rad.
    pub(crate) goal: Vec<f64>,
    /// Angles of the motors at the start and at the end, rad.
    pub(crate) poses: [[f64; N]; 2],
    /// First mode at the end, motors held, rad/s.
    pub(crate) first: f64,
    /// omega_n over K_p beyond which `VWBC` runs away there, and what encoders without errors would take for it: from how twists
    /// change with angles on the way.
    pub(crate) bound: f64,
    pub(crate) seen: f64,
    /// Payload, kg.
    pub(crate) payload: f64,
}

/// Of one run.
pub(crate) struct Outcome {
    /// Vibration of the tip, m, and how far from its goal it is in the end.
    pub(crate) vibration: f64,
    pub(crate) error: f64,
    /// Wave frequencies in the end, rad/s.
    pub(crate) used: [f64; N],
}

impl Outcome {
    /// Of an arm that is lost.
    pub(crate) fn lost() -> Self {
        Self { vibration: f64::INFINITY, error: f64::INFINITY, used: [0.0; N] }
    }
}

pub(crate) fn draw(arm: &FlexibleArm, count: usize, orbit: bool) -> Result<Vec<Move>, Box<dyn Error>> {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let at = Parameters::new(&arm.structure().robot);
    let of = States::new(&arm.structure().robot);
    let (joint, motor) = (of.joint_angle, of.motor_angle);
    let mut all = Vec::new();
    while all.len() < count {
        let payload = random.between(0.0, 10.0);
        let mut from = [0.0; N];
        from[1] = random.between(0.0, 1.8);
        from[2] = random.between(-2.4, 0.0);
        let mut to = from;
        to[1] += random.between(-0.2, 0.2);
        to[2] += random.between(-0.3, 0.3);
        // What the motors can hold on the ground with something to spare.
        let heavy = with_payload(arm, payload, false);
        let fits = [&from, &to].iter().all(|pose| {
            equilibrium(arm, &heavy, *pose, [0.0; 3]).is_ok_and(|rest| {
                (0..N).all(|j| {
                    let torque = heavy[at.joint_stiffness + j] * (rest.state[joint + j] - pose[j]);
                    torque.abs() < 0.3 * 0.02 * heavy[at.gear_ratio + j]
                })
            })
        });
        if !fits {
            continue;
        }
        let p = with_payload(arm, payload, orbit);
        let end = linearised(arm, &p, &to)?;
        let (start, more) = end.rest(&core::array::from_fn::<f64, N, _>(|j| from[j] - to[j]))?;
        let goal = end.state[joint..][..N].to_vec();
        let drive = [(0..N).map(|j| end.drive[j] + more[j]).collect(), end.drive.clone()];
        let rest = equilibrium(arm, &p, &to, [0.0; 3])?;
        let (first, bound) = (rest.frequencies()?[0], 1.0 / droop(&rest)?);
        let seen =
            seen(&p[at.joint_stiffness..][..N], &start.as_slice()[joint..], &start.as_slice()[motor..]);
        all.push(Move {
            p,
            plant: end.sampled(STEP)?,
            start,
            drive,
            goal,
            poses: [from, to],
            first,
            bound,
            seen,
            payload,
        });
    }
    Ok(all)
}

/// omega_n over K_p at which `VWBC` would run away along the way gone: angles over twists, squares weighed with the springs.
fn seen(springs: &[f64], joints: &[f64], motors: &[f64]) -> f64 {
    let of = |f: fn(f64, f64) -> f64| (0..N).map(|j| springs[j] * f(joints[j], motors[j])).sum::<f64>();
    let falls = of(|joint, motor| (joint - motor) * joint) / of(|joint, _| joint * joint);
    if falls > 0.0 { 1.0 / falls } else { f64::INFINITY }
}

impl Move {
    pub(crate) fn run(
        &self,
        arm: &FlexibleArm,
        control: &[f64],
        how: How,
    ) -> Result<Outcome, Box<dyn Error>> {
        if how.dry { self.run_dry(arm, control, how) } else { self.run_linear(arm, control, how) }
    }

    fn run_linear(&self, arm: &FlexibleArm, control: &[f64], how: How) -> Result<Outcome, Box<dyn Error>> {
        let controller = ManipulatorController { joints: N };
        controller.check(control).map_err(|e| e.1)?;
        let own = controller.sizes();
        let (mut cx, mut modes) = (vec![0.0; own.states], vec![0; own.modes]);
        let mut x = self.start.clone();
        let mut y = &self.plant.c * &x;
        let from: Vec<f64> = (0..N).map(|j| y[measured::JOINT_ANGLE * N + j]).collect();
        let ratio = Parameters::new(&arm.structure().robot).gear_ratio;
        let (mut next, mut drive) = (x.clone(), DVector::zeros(N));
        let mut sensed = vec![0.0; own.inputs];
        let mut encoders = Encoders::new(how);
        let mut way = Vec::new();
        for k in 0..(TIME / STEP) as usize {
            let now = k as f64 * STEP;
            y.gemv(1.0, &self.plant.c, &x, 0.0);
            way.push([0, 1, 2].map(|i| y[measured::COUNT * N + i]));
            for j in 0..N {
                let left = 1.0 - (now / RAMP).min(1.0);
                sensed[j] = self.goal[j] + from[j] * left;
                // Motors count from where their joints are at the start.
                let motor = self.goal[j] + y[measured::MOTOR_ANGLE * N + j] + from[j]
                    - self.start[States::new(&arm.structure().robot).motor_angle + j];
                let load = self.goal[j] + y[measured::JOINT_ANGLE * N + j];
                let rates = [y[measured::MOTOR_VELOCITY * N + j], y[measured::JOINT_VELOCITY * N + j]];
                let seen = encoders.read(j, [motor, load], rates, self.p[ratio + j]);
                seen.into_iter().enumerate().for_each(|(i, value)| sensed[(2 + i) * N + j] = value);
            }
            if k == 0 {
                // States from the inputs, the first sample later; the integral holds the weight already.
                let at = At { t: STEP, x: &cx, u: &[], p: control, modes: &[] };
                controller.start_modes(at, &mut modes);
                controller.update(now, &mut cx, &sensed, control, &mut modes);
                cx[state::INTEGRAL_TORQUE * N..][..N].copy_from_slice(&self.drive[0]);
            }
            controller.update(now + STEP, &mut cx, &sensed, control, &mut modes);
            (0..N).for_each(|j| drive[j] = cx[state::HELD_OUTPUT * N + j] - self.drive[1][j]);
            next.gemv(1.0, &self.plant.a, &x, 0.0);
            next.gemv(1.0, &self.plant.b, &drive, 1.0);
            std::mem::swap(&mut x, &mut next);
        }
        Ok(self.outcome(&way, &cx, control, how))
    }

    /// Of the tip's way from its goal, and the controllers' states in the end.
    pub(crate) fn outcome(&self, way: &[[f64; 3]], cx: &[f64], control: &[f64], how: How) -> Outcome {
        let window = (std::f64::consts::TAU / self.first / STEP) as usize | 1;
        let error = way.last().map_or(0.0, |tip| tip.iter().map(|v| v * v).sum::<f64>().sqrt());
        let offset = adapted::first(N) + adapted::OFFSET * N;
        let used = core::array::from_fn(|j| cx[offset + j] + control[parameter::WAVE_FREQUENCY * N + j]);
        let from = if how.late { (1.0 / STEP) as usize } else { 0 };
        Outcome { vibration: vibration(way, window, from), error, used }
    }
}

/// Root mean square of a way less its centred mean over a window, from this sample on.
fn vibration(way: &[[f64; 3]], window: usize, from: usize) -> f64 {
    let half = window / 2;
    let at = |i: isize| way[i.clamp(0, way.len() as isize - 1) as usize];
    let mut square = 0.0;
    for c in 0..3 {
        let mut sum: f64 = (-(half as isize)..=half as isize).map(|i| at(i)[c]).sum();
        for i in 0..way.len() as isize {
            if i >= from as isize {
                square += (at(i)[c] - sum / window as f64).powi(2);
            }
            sum += at(i + half as isize + 1)[c] - at(i - half as isize)[c];
        }
    }
    (square / (way.len() - from) as f64).sqrt()
}

/// Controllers of all joints: omega_n of each at the start, and over the estimated mode where it adapts.
pub(crate) fn control(
    arm: &FlexibleArm,
    p: &[f64],
    strategy: Strategy,
    omega: [f64; N],
    ratio: Option<f64>,
) -> Vec<f64> {
    let mut c = vec![0.0; ManipulatorController { joints: N }.sizes().parameters];
    let first = adapt::first(N);
    let (rate, ratio) = ratio.map_or((0.0, 1.0), |ratio| (2.0, ratio));
    c[parameter::COUNT * N] = STEP;
    c[parameter::COUNT * N + 1] = f64::from(strategy as u8);
    for j in 0..N {
        let own = settings(arm, p, j, GAIN, omega[j]);
        own.iter().enumerate().for_each(|(i, v)| c[i * N + j] = *v);
        let estimate = [2.0, rate, 2.0 * ratio, 100.0 * ratio, ratio, 2.0 * LOAD_STEP];
        estimate.iter().enumerate().for_each(|(i, v)| c[first + i * N + j] = *v);
        for k in 0..KNOTS {
            c[adapt::schedule_angle(N) + j * KNOTS + k] = k as f64;
            c[adapt::schedule_frequency(N) + j * KNOTS + k] = omega[j];
        }
        c[adapt::schedule_joint(N) + j] = (j + 1) as f64;
    }
    c
}

/// Lets omega_n of all joints follow a table over the angle of joint `over` (from 1) with the rate 2/s, from what it has at `start`, rad.
pub(crate) fn schedule(c: &mut [f64], over: usize, table: &[[f64; KNOTS]; 2], bounds: [f64; 2], start: f64) {
    let first = adapt::first(N);
    for j in 0..N {
        c[first + adapt::ADAPTATION * N + j] = 1.0;
        c[first + adapt::RATE * N + j] = 2.0;
        c[first + adapt::MIN * N + j] = bounds[0];
        c[first + adapt::MAX * N + j] = bounds[1];
        c[adapt::schedule_angle(N) + j * KNOTS..][..KNOTS].copy_from_slice(&table[0]);
        c[adapt::schedule_frequency(N) + j * KNOTS..][..KNOTS].copy_from_slice(&table[1]);
        c[adapt::schedule_joint(N) + j] = over as f64;
        c[parameter::WAVE_FREQUENCY * N + j] = scheduled(&table[0], &table[1], start);
    }
}

/// Least, median, most.
pub(crate) fn spread(values: &[f64]) -> [f64; 3] {
    let mut v = values.to_vec();
    v.sort_by(f64::total_cmp);
    [v[0], v[v.len() / 2], v[v.len() - 1]]
}
