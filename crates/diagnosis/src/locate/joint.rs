//! The balances of a two-mass joint, and unknown inputs of it.
//!
//! Positive directions are those of the model: a positive unknown torque drives forward.

use nalgebra::{DMatrix, SMatrix, SVector};
use trueup_models::joint::parameter as j;
use trueup_signals::process::Butterworth;

use super::derivative::{derivatives, gain};
use super::unknown_input::{ChannelReading, InputPlace, UnknownInputEstimate, UnknownInputSystem};
use super::{EquationBalance, Interval, ResidualSeries, intervals};

/// Measured channels of a joint on even steps; a slice that is empty was not measured (inputs: 0).
#[derive(Clone, Copy, Debug, Default)]
pub struct JointColumns<'a> {
    /// Step in s.
    pub step: f64,
    /// `motorCurrent`, A.
    pub current: &'a [f64],
    /// The current keeps each value until the next sample (else it goes on the line between them).
    pub hold: bool,
    /// `externalTorque`, N.m.
    pub external: &'a [f64],
    /// `motorAngle`, rad.
    pub motor: &'a [f64],
    /// `loadAngle`, rad.
    pub load: &'a [f64],
    /// Noise of `current`, standard deviation in A; 0 for a command.
    pub current_floor: f64,
    /// Noise of `motor`, standard deviation in rad.
    pub motor_floor: f64,
    /// Noise of `load`, standard deviation in rad.
    pub load_floor: f64,
}

/// The balances of a joint with both encoders, motor-side torques; all columns through the same zero-phase filter.
///
/// What is missing at one place leaves one of them quiet: at the motor `load`, in the transmission `total`, at the load
/// `motor`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointBalances {
    /// Index of the first sample in the columns: the filter's ends are left out.
    pub first: usize,
    /// Velocity of the motor, rad/s.
    pub velocity: Vec<f64>,
    /// Twist q_m - n q_l, rad.
    pub twist: Vec<f64>,
    /// Its rate, rad/s.
    pub twist_rate: Vec<f64>,
    /// What the transmission carries, by the load's motion: (J_l dd(q_l) - tau_ext) / n, N.m.
    pub transmission_torque: Vec<f64>,
    /// What brakes the motor, by both motions: K_t I - J_m dd(q_m) - (J_l dd(q_l) - tau_ext) / n, N.m.
    pub brake_torque: Vec<f64>,
    /// K_t I - tau_fr - tau_lm - J_m dd(q_m) (TMJ-1).
    pub motor: EquationBalance,
    /// tau_lm + (tau_ext - J_l dd(q_l)) / n (TMJ-3).
    pub load: EquationBalance,
    /// Both together, in which the spring is not.
    pub total: EquationBalance,
    /// The motor moves; where it does not, friction is any torque up to tau_s and `motor` and `total` say nothing.
    pub sliding: Vec<bool>,
}

/// Balances by a low-pass of fourth order, forwards and backwards, at `cutoff` in Hz. `p` are the parameters of
/// [`trueup_models::joint`]. `None` without both angles, for unequal lengths, or fewer than nine periods of the
/// cutoff.
pub fn joint_balances(p: &[f64], columns: &JointColumns<'_>, cutoff: f64) -> Option<JointBalances> {
    let (h, n) = (columns.step, columns.motor.len());
    let filter = Butterworth::low_pass(4, cutoff, 1.0 / h)?;
    // The filter reaches about a period; at its ends, where it mirrors a bend, further.
    let reach = ((1.0 / (cutoff * h)).ceil() as usize).max(4);
    let margin = 3 * reach;
    if columns.load.len() != n || columns.current.len() != n || n < 3 * margin {
        return None;
    }
    let gear = p[j::GEAR_RATIO];
    let smooth = |x: &[f64]| filter.filtfilt(x);
    let zero = vec![0.0; n];
    let external = if columns.external.len() == n { columns.external } else { &zero };
    let [q, w, a] = derivatives(&smooth(columns.motor)?, h);
    let [ql, wl, al] = derivatives(&smooth(columns.load)?, h);
    // What is held is on the mean that of the middle of its step: half a sample later than its time.
    let current: Vec<f64> = if columns.hold {
        (0..n).map(|i| 0.5 * (columns.current[i.saturating_sub(1)] + columns.current[i])).collect()
    } else {
        columns.current.to_vec()
    };
    let current = smooth(&current)?;
    let external = smooth(external)?;
    // Still: less than what the sensor's noise looks like, or a hundredth of the fastest.
    let noise = |d: usize| columns.motor_floor * gain(&filter, |x| derivatives(x, h)[d].clone());
    let fastest = w.iter().fold(0.0, |m: f64, w| m.max(w.abs()));
    let still = (4.0 * noise(1)).max(0.01 * fastest);
    let sign: Vec<f64> = w.iter().map(|w| if w.abs() < still { 0.0 } else { w.signum() }).collect();
    let sign = smooth(&sign)?;
    let mut out = JointBalances { first: margin, ..JointBalances::default() };
    for i in margin..n - margin {
        let (twist, rate) = (q[i] - gear * ql[i], w[i] - gear * wl[i]);
        let spring = p[j::STIFFNESS] * twist + p[j::DAMPING] * rate;
        let friction = p[j::COULOMB_FRICTION] * sign[i] + p[j::VISCOUS_FRICTION] * w[i];
        let drive = p[j::TORQUE_CONSTANT] * current[i] - p[j::MOTOR_INERTIA] * a[i];
        let carried = (p[j::LOAD_INERTIA] * al[i] - external[i]) / gear;
        out.velocity.push(w[i]);
        out.twist.push(twist);
        out.twist_rate.push(rate);
        out.transmission_torque.push(carried);
        out.brake_torque.push(drive - carried);
        out.motor.value.push(drive - friction - spring);
        out.load.value.push(spring - carried);
        out.total.value.push(drive - friction - carried);
        // Within the filter's reach of a standstill the sign is not known either.
        let near = &w[i.saturating_sub(reach)..(i + reach + 1).min(n)];
        out.sliding.push(near.iter().all(|v| v.abs() >= still && v.signum() == w[i].signum()));
    }
    let (k, d) = (p[j::STIFFNESS], p[j::DAMPING]);
    let floor = |inertia: f64, k: f64, d: f64| {
        gain(&filter, |x| {
            let [q, w, a] = derivatives(x, h);
            (0..q.len()).map(|i| inertia * a[i] + d * w[i] + k * q[i]).collect()
        })
    };
    let (motor, load) = (columns.motor_floor, gear * columns.load_floor);
    let reflected = p[j::LOAD_INERTIA] / (gear * gear);
    let viscous = p[j::VISCOUS_FRICTION];
    let drive = p[j::TORQUE_CONSTANT] * columns.current_floor * gain(&filter, <[f64]>::to_vec);
    out.motor.floor =
        (motor * floor(p[j::MOTOR_INERTIA], k, d + viscous)).hypot(load * floor(0.0, k, d)).hypot(drive);
    out.load.floor = (motor * floor(0.0, k, d)).hypot(load * floor(reflected, k, d));
    out.total.floor = (motor * floor(p[j::MOTOR_INERTIA], 0.0, viscous))
        .hypot(load * floor(reflected, 0.0, 0.0))
        .hypot(drive);
    Some(out)
}

/// The unknown input at every place of a joint, most likely first: `motor` (actuator or motor friction: no sensor of a
/// joint distinguishes them), `transmission`, `load`, and `sensor:<channel>`. Torques on the motor side in N.m, readings in
/// the channel's unit. `flexible` false: one rigid mass, without `transmission`.
///
/// Friction acts by the measured direction; where the motor is about still it is unknown within its levels.
pub fn joint_unknown_inputs(
    p: &[f64],
    flexible: bool,
    columns: &JointColumns<'_>,
) -> Vec<UnknownInputEstimate> {
    if flexible { estimates(system::<5>(p, columns), p) } else { estimates(system::<3>(p, columns), p) }
}

/// Edges of the unknown input at a place of a joint, in samples, sharpened by the readings ([`UnknownInputSystem::sharpen`]).
pub fn joint_edges(
    p: &[f64],
    flexible: bool,
    columns: &JointColumns<'_>,
    place: &str,
    edges: &[usize],
    reach: usize,
) -> Vec<usize> {
    let sharp = if flexible {
        system::<5>(p, columns).map(|s| s.sharpen(place, edges, reach))
    } else {
        system::<3>(p, columns).map(|s| s.sharpen(place, edges, reach))
    };
    sharp.unwrap_or_else(|| edges.to_vec())
}

/// When an unknown input acts: the stretches in which its estimate is significant, their edges sharpened by the readings.
/// `start` is the time of the first sample in s; `shortest` as for [`intervals`].
pub fn joint_intervals(
    p: &[f64],
    flexible: bool,
    columns: &JointColumns<'_>,
    estimate: &UnknownInputEstimate,
    recording: &str,
    start: f64,
    shortest: f64,
) -> Vec<Interval> {
    let mut sorted = estimate.deviation.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(floor) = sorted.get(sorted.len() / 2).copied().filter(|f| *f > 0.0) else { return Vec::new() };
    let time: Vec<f64> = (0..estimate.value.len()).map(|k| start + k as f64 * columns.step).collect();
    let mut found =
        intervals(&[ResidualSeries { recording, time: &time, value: &estimate.value, floor }], shortest);
    let index = |t: f64| ((t - start) / columns.step).round() as usize;
    let edges: Vec<usize> = found.iter().flat_map(|i| [index(i.start), index(i.end)]).collect();
    // The smoother's ramps are as long as it needs to see a jump; some tenths of a second at most.
    let reach = ((0.2 / columns.step).ceil() as usize).clamp(20, 100);
    let sharp = joint_edges(p, flexible, columns, &estimate.place, &edges, reach);
    for (i, edge) in found.iter_mut().zip(sharp.chunks(2)) {
        // The ends of the recording are no edges.
        if let [from, to] = edge {
            i.start = if index(i.start) == 0 { i.start } else { start + *from as f64 * columns.step };
            i.end = if index(i.end) + 1 >= time.len() { i.end } else { start + *to as f64 * columns.step };
        }
    }
    found
}

fn estimates<const N: usize>(
    system: Option<UnknownInputSystem<'_, N>>,
    p: &[f64],
) -> Vec<UnknownInputEstimate> {
    let mut all = system.map_or_else(Vec::new, |s| s.estimate());
    for e in all.iter_mut().filter(|e| e.place == "sensor:loadAngle") {
        e.value.iter_mut().chain(&mut e.deviation).for_each(|x| *x /= p[j::GEAR_RATIO]);
    }
    all
}

/// States: q_m, d(q_m), the twist and its rate (N = 5), the unknown input last.
fn system<'a, const N: usize>(p: &[f64], c: &JointColumns<'a>) -> Option<UnknownInputSystem<'a, N>> {
    let n = c.motor.len().max(c.load.len());
    let shown = |x: &[f64]| x.len() == n;
    let (h, gear, flexible) = (c.step, p[j::GEAR_RATIO], N == 5);
    if n < 50 || c.current.len() != n || h.is_nan() || h <= 0.0 {
        return None;
    }
    let (inertia, reflected) = (p[j::MOTOR_INERTIA], p[j::LOAD_INERTIA] / (gear * gear));
    let viscous = p[j::VISCOUS_FRICTION];
    let mut a = DMatrix::<f64>::zeros(N, N);
    a[(0, 1)] = 1.0;
    if flexible {
        let (k, d) = (p[j::STIFFNESS], p[j::DAMPING]);
        (a[(1, 1)], a[(1, 2)], a[(1, 3)]) = (-viscous / inertia, -k / inertia, -d / inertia);
        a[(2, 3)] = 1.0;
        // The twist's acceleration: the motor's less the load's.
        (a[(3, 1)], a[(3, 2)], a[(3, 3)]) =
            (a[(1, 1)], -k / inertia - k / reflected, -d / inertia - d / reflected);
    } else {
        a[(1, 1)] = -viscous / (inertia + reflected);
    }
    let at_motor = |torque: f64| {
        let mut g = SVector::<f64, N>::zeros();
        g[1] = torque / if flexible { inertia } else { inertia + reflected };
        if flexible {
            g[3] = g[1];
        }
        g
    };
    let at_load = |torque: f64| {
        let mut g = SVector::<f64, N>::zeros();
        if flexible {
            g[3] = -torque / reflected;
        } else {
            g = at_motor(torque);
        }
        g
    };
    let discrete = |g: SVector<f64, N>| {
        let mut a = a.clone();
        (0..N).for_each(|i| a[(i, N - 1)] = g[i]);
        let e = (a * h).exp();
        SMatrix::<f64, N, N>::from_fn(|i, k| e[(i, k)])
    };
    // Known torques as one input at the motor and one at the load, each by the mean of two samples.
    let (unit_motor, unit_load) = (discrete(at_motor(1.0)), discrete(at_load(1.0)));
    let velocity = smooth_velocity(c, gear);
    let fastest = velocity.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let still = |v: f64| v.abs() < 0.02 * fastest;
    let dry = |v: f64| if still(v) { 0.0 } else { p[j::COULOMB_FRICTION] * v.signum() };
    let load = |k: usize| c.external.get(k).copied().unwrap_or(0.0) / gear;
    let mean = |f: &dyn Fn(usize) -> f64, k: usize| 0.5 * (f(k) + f(k + 1));
    let drive = |k: usize| {
        let dry = 0.5 * (dry(velocity[k]) + dry(velocity[k + 1]));
        let torque = |k: usize| p[j::TORQUE_CONSTANT] * c.current[k];
        (if c.hold { torque(k) } else { 0.5 * (torque(k) + torque(k + 1)) }) - dry
    };
    let column = |m: &SMatrix<f64, N, N>| {
        let mut g = m.column(N - 1).into_owned();
        g[N - 1] = 0.0;
        g
    };
    let (g_m, g_l) = (column(&unit_motor), column(&unit_load));
    let push = (0..n - 1).map(|k| g_m * drive(k) + g_l * mean(&load, k)).collect();
    let level = p[j::STATIC_FRICTION].max(p[j::COULOMB_FRICTION]);
    // A torque within the levels that stays for some hundredths of a second.
    let unsure = g_m * g_m.transpose() * (level * level * (0.02 / h).max(1.0));
    let noise = g_m * g_m.transpose() * (p[j::TORQUE_CONSTANT] * c.current_floor).powi(2);
    let sticks = |k: usize| still(velocity[k]) || still(velocity[k + 1]);
    let process_noise = (0..n - 1).map(|k| if sticks(k) { unsure + noise } else { noise }).collect();

    let mut readings = Vec::new();
    let mut names = Vec::new();
    let mut row = SVector::<f64, N>::zeros();
    row[0] = 1.0;
    if shown(c.motor) {
        readings.push(ChannelReading { row, value: c.motor, factor: 1.0, deviation: c.motor_floor });
        names.push("motorAngle");
    }
    if shown(c.load) {
        if flexible {
            row[2] = -1.0;
        }
        readings.push(ChannelReading { row, value: c.load, factor: gear, deviation: gear * c.load_floor });
        names.push("loadAngle");
    }
    let torque =
        (0..n).map(|k| (p[j::TORQUE_CONSTANT] * c.current[k]).abs()).fold(level, f64::max).max(1e-12);
    let mut places = vec![
        InputPlace { name: "motor".into(), transition: unit_motor, reading: None, scale: torque },
        InputPlace { name: "load".into(), transition: unit_load, reading: None, scale: torque },
    ];
    if flexible {
        let between = discrete(at_load(1.0) - at_motor(1.0));
        places.push(InputPlace {
            name: "transmission".into(),
            transition: between,
            reading: None,
            scale: torque,
        });
    }
    for (k, name) in names.iter().enumerate() {
        let scale = 1e3 * readings[k].deviation;
        let transition = discrete(SVector::zeros());
        places.push(InputPlace { name: format!("sensor:{name}"), transition, reading: Some(k), scale });
    }
    let mut start = SVector::<f64, N>::zeros();
    let mut start_deviation = SVector::<f64, N>::zeros();
    start[0] = readings.first().map_or(0.0, |r| r.value[0] * r.factor);
    start[1] = velocity[0];
    start_deviation[0] = 10.0 * readings.first().map_or(1.0, |r| r.deviation);
    start_deviation[1] = (0.1 * fastest).max(10.0 * start_deviation[0]);
    if flexible {
        let wide = readings.iter().map(|r| r.deviation).fold(0.0, f64::max);
        start_deviation[2] = 10.0 * wide + torque / p[j::STIFFNESS];
        start_deviation[3] = start_deviation[1];
    }
    Some(UnknownInputSystem { places, push, process_noise, readings, start, start_deviation, step: h })
}

/// Speed of the motor by whatever encoder there is.
fn smooth_velocity(c: &JointColumns<'_>, gear: f64) -> Vec<f64> {
    let (x, factor) = if c.motor.is_empty() { (c.load, gear) } else { (c.motor, 1.0) };
    let rate = 1.0 / c.step;
    let smooth = Butterworth::low_pass(4, 0.05 * rate, rate).and_then(|f| f.filtfilt(x));
    let [_, v, _] = derivatives(&smooth.unwrap_or_else(|| x.to_vec()), c.step);
    v.iter().map(|v| v * factor).collect()
}
