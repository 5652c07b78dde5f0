//! Runs of the test-bed (S0, section 3) made with known parameters.
#![allow(clippy::unwrap_used, dead_code)]

pub(crate) mod bristles;

use trueup_identification::flexible_joint::{FlexibleJoint, MotorDrive, TestBedRun, sight};
use trueup_models::arm::{PlanarManipulator, Replay, input, output, parameter};
use trueup_models::presets;
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_numerics::hybrid::Hybrid;
use trueup_signals::spline::Spline;

/// 20 Hz for 10 s, as the test-bed.
fn times() -> Vec<f64> {
    (0..=200).map(|i| 0.05 * f64::from(i)).collect()
}
/// The trajectory of S0, section 3.2 with the accelerations of the golden facts, in rad.
fn reference(joint: usize, t: f64) -> f64 {
    let (start, a) = ([7.5f64, -15.0, -22.5][joint], [0.9, -0.6, -0.75][joint]);
    (start + 0.5 * a * t * t).to_radians()
}
pub(crate) struct Noise(pub(crate) u64);
impl Noise {
    /// Normal with standard deviation 1, by twelve uniform ones.
    pub(crate) fn next(&mut self) -> f64 {
        (0..12).fold(-6.0, |sum, _| {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            sum + (self.0 >> 11) as f64 / (1u64 << 53) as f64
        })
    }
}
/// Torque of joint 1 that the rigid arm needs on this trajectory, roughly; the same in data and model. The motor's inertia is not in it, so that
/// the joint turns less than 45 deg.
fn torque(t: f64) -> f64 {
    0.0088 + 0.000_652 * t
}

/// A run with the true parameters: vision noise of 1 mm and 0.1 deg; encoders exact.
pub(crate) fn run(truth: [f64; 4], by_torque: bool, noise: f64, seed: u64) -> FlexibleJoint {
    let (n, arm) = (3, PlanarManipulator::new(&[true, false, false], &[] as &[&str]).unwrap());
    let mut p = presets::cbk_pan(&[true, false, false]);
    p[parameter::motor_inertia(n)] = truth[0];
    p[parameter::joint_stiffness(n)] = truth[1];
    p[parameter::joint_damping(n)] = truth[2];
    for j in 0..n {
        p[parameter::initial_joint_angle(n) + j] = reference(j, 0.0);
    }
    p[parameter::initial_motor_angle(n)] = reference(0, 0.0);
    p[parameter::initial_joint_angle(n)] += truth[3];
    let replay = Replay::new(arm.clone(), if by_torque { &[1, 2] } else { &[1, 2, 0] }).unwrap();
    let inputs = |t: f64, u: &mut [f64]| {
        u.fill(0.0);
        if by_torque {
            u[input::joint_torque(n)] = torque(t);
        } else {
            u[replay.acceleration(2)] = 0.9f64.to_radians();
        }
        u[replay.acceleration(0)] = -0.6f64.to_radians();
        u[replay.acceleration(1)] = -0.75f64.to_radians();
    };
    let options = DriverOptions { tolerance: 1e-10, ..DriverOptions::default() };
    let sim = simulate(&replay, &p, &vec![0.01; replay.sizes().states], options, &inputs, &times()).unwrap();
    let mut random = Noise(seed);
    let (mm, deg) = (1e-3 * noise, 0.1f64.to_radians() * noise);
    let mut base = Vec::new();
    let mut tip = Vec::new();
    let mut joints = vec![Vec::new(); n];
    for y in &sim.y {
        let [x0, y0] = [0, 1].map(|i| y[output::base_position(n) + i]);
        base.push([
            x0 + mm * random.next(),
            y0 + mm * random.next(),
            y[output::base_attitude(n)] + deg * random.next(),
        ]);
        tip.push([0, 1].map(|i| y[output::tip_position(n) + i] + mm * random.next()));
        (0..n).for_each(|j| joints[j].push(y[output::joint_angle(n) + j]));
    }
    let seen = sight(&p, 0, &base, &joints, &tip);
    let encoder = |j: usize| {
        let angles: Vec<f64> = sim.y.iter().map(|y| y[output::motor_angle(n) + j]).collect();
        Spline::new(&times(), &angles, 0.0).unwrap()
    };
    let motor = if by_torque {
        MotorDrive::Torque(times().into_iter().map(torque).collect())
    } else {
        MotorDrive::Motion(encoder(0))
    };
    let run = TestBedRun { time: times(), angle: seen.angle, motor, others: vec![encoder(1), encoder(2)] };
    FlexibleJoint::new(&arm, &p, 0, reference(0, 0.0), run).unwrap()
}
