//! Recordings of joints that are made here: a solver of the tests' own, explicit midpoint steps, white noise.

use std::fmt::Write as _;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueup_diagnosis::diagnose::{DiagnoseOptions, diagnose};
use trueup_diagnosis::outcome::Diagnosis;
use trueup_signals::{Case, Loaded};

/// Time between two readings, s.
const STEP: f64 = 0.002;
/// Readings of a recording.
const READINGS: usize = 2500;

/// A joint with its sensors, as the user describes it, and how it is driven.
pub(crate) struct Joint {
    /// Without it neither `stiffness` nor `damping` is declared.
    pub flexible: bool,
    pub gear: f64,
    pub motor_inertia: f64,
    pub load_inertia: f64,
    pub torque_constant: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub coulomb: f64,
    pub viscous: f64,
    /// Amplitude, A, and angular frequency, rad/s, of a sine and of a cosine.
    pub current: [[f64; 2]; 2],
    /// Ratio of the recorded current to the true one.
    pub current_gain: f64,
    /// Deviations of the noise.
    pub current_noise: f64,
    pub motor_noise: f64,
    pub load_noise: f64,
    /// Whether the load's angle is measured.
    pub load_seen: bool,
    /// Relative standard deviation of every parameter but the gear ratio.
    pub doubt: f64,
    /// Steps of the solver from reading to reading.
    pub substeps: u32,
}

impl Default for Joint {
    fn default() -> Self {
        Self {
            flexible: true,
            gear: 100.0,
            motor_inertia: 3e-5,
            load_inertia: 0.6,
            torque_constant: 0.06,
            stiffness: 0.1,
            damping: 4e-5,
            coulomb: 0.008,
            viscous: 4e-5,
            current: [[0.5, 4.3], [0.3, 11.9]],
            current_gain: 1.0,
            current_noise: 2e-4,
            motor_noise: 2e-4,
            load_noise: 3e-6,
            load_seen: true,
            doubt: 0.01,
            substeps: 100,
        }
    }
}

impl Joint {
    /// Inertia of the load on the motor's side.
    pub(crate) fn reflected(&self) -> f64 {
        self.load_inertia / self.gear.powi(2)
    }

    /// Four recordings, the last held out, each with a phase of its own. The truth: `rates(current, state)`; the state begins
    /// with angle and velocity of the motor, then of the load times the gear ratio.
    pub(crate) fn recorded<const N: usize>(&self, rates: impl Fn(f64, &[f64; N]) -> [f64; N]) -> Loaded {
        let folder = tempfile::tempdir().unwrap();
        for seed in 1..=4 {
            let csv = self.record(seed, &rates);
            std::fs::write(folder.path().join(format!("{seed}.csv")), csv).unwrap();
        }
        std::fs::write(folder.path().join("case.toml"), self.case()).unwrap();
        Case::load(folder.path(), |_| Ok(Vec::new())).unwrap().0
    }

    /// Their diagnosis.
    pub(crate) fn diagnosed<const N: usize>(&self, rates: impl Fn(f64, &[f64; N]) -> [f64; N]) -> Diagnosis {
        diagnose(&self.recorded(rates), &DiagnoseOptions::default(), &mut |_, _| ()).unwrap().diagnosis
    }

    /// A recording as CSV.
    fn record<const N: usize>(&self, seed: u64, rates: impl Fn(f64, &[f64; N]) -> [f64; N]) -> String {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut noise = |deviation: f64| deviation * rng.sample::<f64, _>(StandardNormal);
        let ([[a, v], [b, w]], phase) = (self.current, seed as f64);
        let current = |t: f64| a * (v * t + phase).sin() + b * (w * t + 2.0 * phase).cos();
        let mut x = [0.0; N];
        let mut csv = "time,motorCurrent,motorAngle".to_owned();
        csv += if self.load_seen { ",loadAngle\n" } else { "\n" };
        for k in 0..READINGS {
            let t = k as f64 * STEP;
            let u = self.current_gain * (current(t) + noise(self.current_noise));
            let motor = x[0] + noise(self.motor_noise);
            let load = x[2] / self.gear + noise(self.load_noise);
            write!(csv, "{t:?},{u:?},{motor:?}").unwrap();
            if self.load_seen {
                write!(csv, ",{load:?}").unwrap();
            }
            csv.push('\n');
            let h = STEP / f64::from(self.substeps);
            for i in 0..self.substeps {
                let t = t + f64::from(i) * h;
                let a = rates(current(t), &x);
                let half = std::array::from_fn(|i| x[i] + 0.5 * h * a[i]);
                let b = rates(current(t + 0.5 * h), &half);
                x = std::array::from_fn(|i| x[i] + h * b[i]);
            }
        }
        csv
    }

    fn case(&self) -> String {
        let Self { flexible, gear, motor_noise, load_noise, doubt, .. } = self;
        let current_noise = (self.current_gain * self.current_noise).abs();
        let mut own = vec![
            ("motorInertia", self.motor_inertia),
            ("loadInertia", self.load_inertia),
            ("torqueConstant", self.torque_constant),
            ("coulombFriction", self.coulomb),
            ("viscousFriction", self.viscous),
        ];
        if self.flexible {
            own.extend([("stiffness", self.stiffness), ("damping", self.damping)]);
        }
        let deviations: String = own.iter().map(|(name, _)| format!("{name} = {doubt:?}\n")).collect();
        let own: String = own.iter().map(|(name, value)| format!("{name} = {value:?}\n")).collect();
        let load = if self.load_seen {
            format!("[channels.loadAngle]\nnoise = {load_noise:?}\n")
        } else {
            String::new()
        };
        format!(
            "model = \"TwoMassJoint\"\ntrain = [\"1.csv\", \"2.csv\", \"3.csv\"]\nholdout = [\"4.csv\"]\n\
             [parameters]\njointFlexible = {flexible}\ngearRatio = {gear:?}\n{own}[uncertain]\n{deviations}\
             [channels.motorAngle]\nnoise = {motor_noise:?}\n{load}\
             [channels.motorCurrent]\nnoise = {current_noise:?}\n"
        )
    }
}
