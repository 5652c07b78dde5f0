//! Joints whose recordings the adaptive driver makes, as they are and as they are assumed to be.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use trueup_models::joint::{TwoMassJoint, input, output, parameter as q};
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_numerics::hybrid::Hybrid;
use trueup_signals::{Case, Channel, Interpolation, Loaded, ParameterValue, Recording};

/// Standard deviations of the noise of motor and load angle, rad.
const NOISE: [f64; 2] = [1e-3, 1e-5];
/// The same of their rates, rad/s.
const RATE_NOISE: [f64; 2] = [0.02, 2e-4];
/// The same of the torque in the transmission, N.m.
const TORQUE_NOISE: f64 = 5e-5;
/// Every channel of a joint that nothing but its motor drives.
pub(crate) const ALL: &[&str] = &["motorCurrent", "motorAngle", "loadAngle"];

/// A small geared drive with this viscous friction, N.m.s/rad.
fn drive(viscous: f64) -> Vec<f64> {
    let mut p = vec![0.0; q::COUNT];
    for (i, v) in [
        (q::MOTOR_INERTIA, 1.7e-5),
        (q::LOAD_INERTIA, 0.8),
        (q::STIFFNESS, 0.084),
        (q::DAMPING, 7.7e-5),
        (q::COULOMB_FRICTION, 5.2e-3),
        (q::VISCOUS_FRICTION, viscous),
        (q::STATIC_FRICTION, 5.2e-3),
        (q::GEAR_RATIO, 160.0),
        (q::TORQUE_CONSTANT, 0.04),
    ] {
        p[i] = v;
    }
    p
}

/// When the sensors are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Sampling {
    /// With the drive.
    Even,
    /// The same, one of five readings lost, each sensor its own.
    Missing,
    /// Up to three tenths of a step early or late, as the time stamps say.
    Jitter,
    /// The same with time stamps in full milliseconds.
    Coarse,
}

/// A joint as it is, and the assumed values that differ.
pub(crate) struct MadeJoint<'a> {
    /// Of the drive and of the noise.
    pub(crate) seed: u64,
    /// Recordings, and samples of each.
    pub(crate) recordings: (usize, usize),
    /// Samples a second.
    pub(crate) rate: f64,
    /// When the sensors are read.
    pub(crate) sampling: Sampling,
    /// With a spring.
    pub(crate) flexible: bool,
    /// Viscous friction of its motor, N.m.s/rad.
    pub(crate) viscous: f64,
    /// Effects with their parameters; the nominal model has none of them.
    pub(crate) effects: &'a [(&'a str, &'a [f64])],
    /// Standard deviations of the noise of motor and load angle, rad.
    pub(crate) noise: [f64; 2],
    /// Begin and end of a time without current, s.
    pub(crate) rests: [f64; 2],
    /// Size of a torque on the load that is recorded, N.m.
    pub(crate) external: f64,
    /// Size of the reference of a servo, rad.
    pub(crate) reference: f64,
    /// Channels that are recorded.
    pub(crate) channels: &'a [&'a str],
    /// True values of parameters, where they are not those of the drive.
    pub(crate) values: &'a [(usize, f64)],
    /// Assumed values of parameters, where they differ from the true ones.
    pub(crate) believed: &'a [(&'a str, ParameterValue)],
}

impl Default for MadeJoint<'_> {
    fn default() -> Self {
        Self {
            seed: 0,
            recordings: (2, 1000),
            rate: 250.0,
            sampling: Sampling::Even,
            flexible: true,
            viscous: 5.6e-5,
            effects: &[],
            noise: NOISE,
            rests: [0.0; 2],
            external: 0.0,
            reference: 0.0,
            channels: ALL,
            values: &[],
            believed: &[],
        }
    }
}

impl MadeJoint<'_> {
    fn current(&self, k: usize, recording: u64) -> f64 {
        let t = k as f64 / self.rate;
        if (self.rests[0]..self.rests[1]).contains(&t) {
            return 0.0;
        }
        0.35 * (2.3 * t + 2.0 * (self.seed + recording) as f64).sin() + 0.2 * (9.3 * t).sin()
    }
    fn reference(&self, k: usize, recording: u64) -> f64 {
        let (t, phase) = (k as f64 / self.rate, 2.0 * (self.seed + recording) as f64);
        let step = if (t + phase).rem_euclid(1.4) < 0.7 { 0.4 } else { -0.4 };
        self.reference * ((2.3 * t + phase).sin() + 0.4 * (7.1 * t).sin() + step)
    }
    fn torque(&self, k: usize, recording: u64) -> f64 {
        self.external * (4.1 * k as f64 / self.rate + 0.7 * (self.seed + recording) as f64).sin()
    }

    /// A run of the true joint as its sensors read it; inputs are held between their samples.
    fn record(&self, joint: &TwoMassJoint, p: &[f64], name: &str, recording: u64) -> Recording {
        let time: Vec<f64> = (0..self.recordings.1).map(|k| k as f64 / self.rate).collect();
        let rng = &mut StdRng::seed_from_u64(self.seed + recording);
        let mut moved = |t: &f64| {
            let uneven = matches!(self.sampling, Sampling::Jitter | Sampling::Coarse);
            let by = if uneven { rng.random_range(-0.3..0.3) } else { 0.0 };
            (t + by / self.rate).max(0.0)
        };
        let read_at: Vec<f64> = time.iter().map(&mut moved).collect();
        let mut all: Vec<f64> = time.iter().chain(&read_at).copied().collect();
        all.sort_unstable_by(f64::total_cmp);
        all.dedup();
        let drive = |t: f64, u: &mut [f64]| {
            let k = (t * self.rate + 1e-6) as usize;
            u[input::MOTOR_CURRENT] = if self.reference == 0.0 { self.current(k, recording) } else { 0.0 };
            u[input::EXTERNAL_TORQUE] = self.torque(k, recording);
            if let Some(reference) = u.get_mut(input::COUNT) {
                *reference = self.reference(k, recording);
            }
        };
        let nominal = vec![1.0; joint.sizes().states];
        let options = DriverOptions { tolerance: 1e-9, ..DriverOptions::default() };
        let truth = simulate(joint, p, &nominal, options, &drive, &all).unwrap();
        let mut read = |name: &str, at: usize, noise: f64| {
            let normal = Normal::new(0.0, noise).unwrap();
            let (mut times, mut values) = (Vec::new(), Vec::new());
            for t in &read_at {
                let y = truth.y[all.partition_point(|x| x < t)][at] + normal.sample(rng);
                if self.sampling == Sampling::Missing && rng.random_bool(0.2) {
                    continue;
                }
                times.push(if self.sampling == Sampling::Coarse { (1e3 * t).round() / 1e3 } else { *t });
                values.push(y);
            }
            let mut channel = Channel::new(name, "rad", times, values);
            channel.sensor.noise = Some(noise);
            channel
        };
        let motor = read("motorAngle", output::MOTOR_ANGLE, self.noise[0]);
        let load = read("loadAngle", output::LOAD_ANGLE, self.noise[1]);
        let rates = [
            ("motorVelocity", output::MOTOR_VELOCITY, RATE_NOISE[0]),
            ("loadVelocity", output::LOAD_VELOCITY, RATE_NOISE[1]),
        ];
        let rates: Vec<Channel> = rates.map(|(name, at, noise)| read(name, at, noise)).to_vec();
        let torque_sensor = read("transmissionTorque", output::TRANSMISSION_TORQUE, TORQUE_NOISE);
        let held = |name: &str, unit: &str, f: &dyn Fn(usize) -> f64| {
            let mut input = Channel::new(name, unit, time.clone(), (0..time.len()).map(f).collect());
            input.interpolation = Interpolation::Hold;
            input
        };
        let current = held("motorCurrent", "A", &|k| self.current(k, recording));
        let torque = held("externalTorque", "N.m", &|k| self.torque(k, recording));
        let reference = held("positionReference", "rad", &|k| self.reference(k, recording));
        let mut channels = vec![current, torque, reference, motor, load];
        channels.extend(rates);
        channels.push(torque_sensor);
        channels.retain(|c| self.channels.contains(&c.name.as_str()));
        Recording {
            name: name.into(),
            file: PathBuf::new(),
            channels,
            start: time[0],
            end: time[time.len() - 1],
            parameters: BTreeMap::new(),
        }
    }

    /// The case with the assumed values.
    pub(crate) fn case(&self) -> Loaded {
        let ids: Vec<&str> = self.effects.iter().map(|e| e.0).collect();
        let joint = TwoMassJoint::new(self.flexible, &ids).unwrap();
        let mut p = drive(self.viscous);
        self.values.iter().for_each(|(k, value)| p[*k] = *value);
        self.effects.iter().for_each(|e| p.extend(e.1));
        assert_eq!(p.len(), joint.sizes().parameters);
        let names: Vec<String> = ["a", "b", "c"][..self.recordings.0].iter().map(|n| (*n).into()).collect();
        let record = |(k, name): (usize, &String)| (name.clone(), self.record(&joint, &p, name, k as u64));
        let recordings = names.iter().enumerate().map(record).collect();
        let own = q::NAMES.iter().zip(p.clone()).filter(|(n, _)| !n.0.starts_with("initial"));
        let own = own.map(|(n, v)| (n.0.to_owned(), ParameterValue::Number(v)));
        let structure =
            (!self.flexible).then(|| ("jointFlexible".to_owned(), ParameterValue::Boolean(false)));
        let believed = self.believed.iter().map(|(n, v)| ((*n).to_owned(), v.clone()));
        let case = Case {
            model: "TwoMassJoint".into(),
            train: names,
            parameters: own.chain(structure).chain(believed).collect(),
            uncertain: ["stiffness", "viscousFriction"].map(|n| (n.to_owned(), 0.05)).into(),
            ..Case::default()
        };
        Loaded { case, recordings }
    }
}
