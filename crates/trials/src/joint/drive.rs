//! Drives to draw from: a harmonic drive with fine encoders, and DELIAN's joints behind 44340:1 with coarse ones.

use std::f64::consts::TAU;

use super::values::JointValues;
use crate::draw::SeededDraw;
use crate::sense::Meter;

/// A drive, its sensors and its command.
#[derive(Clone, Debug)]
pub(crate) struct TrialDrive {
    pub(crate) values: JointValues,
    /// Motor turns so slowly that what repeats with its angle can be seen.
    pub(crate) small: bool,
    /// Motor speed to go to, rad/s.
    pub(crate) speed: f64,
    /// motorAngle, loadAngle, motorVelocity, transmissionTorque.
    pub(crate) meters: [Meter; 4],
    /// Which of them there are.
    pub(crate) channels: Vec<usize>,
    pub(crate) rate: f64,
    pub(crate) samples: usize,
    pub(crate) jitter: f64,
    pub(crate) drop: f64,
}

/// Eight digits: the values in a case are those simulated.
pub(crate) fn short(x: f64) -> f64 {
    format!("{x:.7e}").parse().unwrap_or(x)
}

pub(crate) fn draw(d: &mut SeededDraw, color: f64) -> TrialDrive {
    let small = d.chance(0.7);
    let (values, speed) = if small { harmonic(d) } else { delian(d) };
    let n = values.gear_ratio;
    let bits =
        |d: &mut SeededDraw, from: usize, to: usize| TAU / f64::from(1u32 << (from + d.below(to - from + 1)));
    let (motor, load) =
        if small { (bits(d, 12, 17), bits(d, 17, 20)) } else { (bits(d, 5, 10), bits(d, 15, 19)) };
    let mut meter = |step: f64| Meter { noise: step * d.uniform(0.25, 0.9), step, color };
    let peak = values.stiffness * speed * 5.0 * values.load_inertia / (n * n) / values.stiffness;
    let meters = [
        meter(motor),
        meter(load),
        Meter { step: 0.0, ..meter(0.004 * speed) },
        Meter { step: 0.0, ..meter(0.006 * peak) },
    ];
    let mut channels = vec![0, 1];
    if d.chance(0.15) {
        channels.push(2);
    }
    if d.chance(0.15) {
        channels.push(3);
    }
    let rate = d.pick(&[100.0, 200.0, 250.0, 500.0, 500.0, 500.0, 1000.0]);
    let length = if rate > 600.0 { d.uniform(5.0, 8.0) } else { d.uniform(8.0, 12.0) };
    TrialDrive {
        values,
        small,
        speed,
        meters,
        channels,
        rate,
        samples: (length * rate) as usize + 1,
        jitter: if d.chance(0.3) { d.uniform(0.01, 0.05) } else { 0.0 },
        drop: if d.chance(0.3) { d.uniform(0.002, 0.015) } else { 0.0 },
    }
}

fn harmonic(d: &mut SeededDraw) -> (JointValues, f64) {
    let n = d.pick(&[80.0, 100.0, 120.0, 160.0]);
    let motor_inertia = short(d.log(0.8e-5, 4e-5));
    let load_inertia = short(n * n * motor_inertia * d.uniform(0.6, 2.5));
    let w = TAU * d.uniform(4.0, 11.0);
    let stiffness = short(w * w * load_inertia / (n * n));
    let damping = short(2.0 * d.uniform(0.006, 0.03) * stiffness / w);
    let speed = d.uniform(80.0, 220.0);
    let total = motor_inertia + load_inertia / (n * n);
    let coulomb = short(total * speed * d.uniform(0.6, 2.5));
    let viscous = short(coulomb / speed * d.uniform(0.3, 1.6));
    let torque_constant = short(d.uniform(0.03, 0.08));
    let v = JointValues {
        motor_inertia,
        load_inertia,
        gear_ratio: n,
        torque_constant,
        stiffness,
        damping,
        coulomb,
        viscous,
    };
    (v, speed)
}

/// Comi et al., tables 1 and 2, each value within 20 %.
fn delian(d: &mut SeededDraw) -> (JointValues, f64) {
    let joints = [
        (44340.0, 8.0, 3.07e-5, 8.07e-8, 7.37e-5, 7.2e-8),
        (21750.0, 6.0, 2.2e-5, 3.18e-8, 1.2e-4, 2.5e-8),
        (25000.0, 2.0, 2.96e-5, 8.35e-8, 7.73e-5, 6.93e-8),
    ];
    let (gear_ratio, load, k, b, c, dm) = if d.chance(0.6) { joints[0] } else { d.pick(&joints) };
    let mut about = |x: f64| short(x * d.uniform(0.8, 1.2));
    let v = JointValues {
        motor_inertia: about(1.2e-7),
        load_inertia: about(load),
        gear_ratio,
        torque_constant: 0.02,
        stiffness: about(k),
        damping: about(b),
        coulomb: about(c),
        viscous: about(dm),
    };
    (v, d.uniform(400.0, 1500.0))
}
