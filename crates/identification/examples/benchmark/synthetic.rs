//! The recordings of the benchmark: current steps with coasting, read by coarse encoders.

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use trueup_identification::model::SimulatedPlant;
use trueup_identification::predict::{InputMap, PredictionPlan};
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_models::joint::{output, parameter as p};
use trueup_models::plants::PlantStructure;
use trueup_models::presets::delian;

/// Step of the angle sensor on the load, rad.
pub(crate) const AMR: f64 = 0.001 * std::f64::consts::PI / 180.0;
const CURRENT_NOISE: f64 = 0.5e-3;
/// Of the steps, A.
const LEVELS: [f64; 4] = [0.016, 0.018, 0.020, 0.023];
/// Speeds between which the motor is driven and coasts, rad/s.
const FASTEST: f64 = 1150.0;
const SLOWEST: f64 = 300.0;
const REST: f64 = 0.1;

/// Conditions of one cell of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    /// A: positive steps; B: both signs; C: both signs, three load torques.
    pub case: char,
    pub joint: usize,
    /// Samples per second.
    pub rate: f64,
    /// Counts per turn of the motor.
    pub counts: f64,
}

/// The recordings of one seed.
pub(crate) struct Data {
    pub truth: [f64; p::COUNT],
    /// With the commanded current.
    pub commanded: Vec<IdentificationRun>,
    /// With the measured current.
    pub measured: Vec<IdentificationRun>,
    /// Offset of the load sensor, rad, and of the motor encoder in each run.
    pub load_offset: f64,
    pub motor_offsets: Vec<f64>,
}

impl Cell {
    /// Sign of the current, load torque in N.m and first of the levels of each run.
    fn tests(&self) -> Vec<(f64, f64, usize)> {
        match self.case {
            'A' => (0..4).map(|k| (1.0, 0.0, k)).collect(),
            'B' => (0..4).map(|k| (if k % 2 == 0 { 1.0 } else { -1.0 }, 0.0, k)).collect(),
            _ => (0..6)
                .map(|k| (if k % 2 == 0 { 1.0 } else { -1.0 }, (k / 2) as f64 * 15.0 - 15.0, k % 4))
                .collect(),
        }
    }

    pub(crate) fn data(&self, seed: u64) -> Data {
        let key = (self.case as u64) << 40
            | (self.joint as u64) << 32
            | (self.rate as u64) << 16
            | self.counts as u64;
        let mut rng = StdRng::seed_from_u64(key ^ seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let model = joint();
        let truth = delian(self.joint).expect("joints 1 to 3");
        let load_offset = rng.random_range(-3.0 * AMR..3.0 * AMR);
        let count = 2.0 * std::f64::consts::PI / self.counts;
        let mut data = Data {
            truth,
            commanded: Vec::new(),
            measured: Vec::new(),
            load_offset,
            motor_offsets: Vec::new(),
        };
        for (i, (sign, load, first)) in self.tests().into_iter().enumerate() {
            let mut run = self.run(&model, &truth, i, sign, load, first);
            let shift = rng.random_range(-0.5..0.5) * count;
            data.motor_offsets.push(shift);
            let quantise = |y: &mut f64, offset: f64, step: f64| *y = ((*y + offset) / step).round() * step;
            run.channels[0].y.iter_mut().for_each(|y| quantise(y, shift, count));
            run.channels[1].y.iter_mut().for_each(|y| quantise(y, load_offset, AMR));
            run.channels.iter_mut().for_each(OutputChannel::weigh_rests);
            let mut measured = run.clone();
            let noise = Normal::new(0.0, CURRENT_NOISE).expect("positive");
            measured.drives[0].u.iter_mut().for_each(|u| *u += noise.sample(&mut rng));
            data.commanded.push(run);
            data.measured.push(measured);
        }
        data
    }

    /// Without noise: four current steps, each until the motor is fast, with coasting in between.
    fn run(
        &self,
        model: &SimulatedPlant,
        q: &[f64; p::COUNT],
        i: usize,
        sign: f64,
        load: f64,
        first: usize,
    ) -> IdentificationRun {
        let inertia = q[p::MOTOR_INERTIA] + q[p::LOAD_INERTIA] / q[p::GEAR_RATIO].powi(2);
        let (d, c) = (q[p::VISCOUS_FRICTION], q[p::COULOMB_FRICTION]);
        // From one speed to another under a constant torque.
        let lasts = |torque: f64, from: f64, to: f64| {
            inertia / d * ((torque - c - d * from) / (torque - c - d * to)).ln()
        };
        let (mut switches, mut end, mut speed) = (Vec::new(), REST, 0.0);
        for k in 0..4 {
            let level = LEVELS[(first + k) % 4];
            let on = lasts(q[p::TORQUE_CONSTANT] * level, speed, FASTEST);
            speed = if k == 3 { 0.0 } else { SLOWEST };
            let off = lasts(0.0, FASTEST, speed);
            switches.push((end, end + on, sign * level));
            end += on + off;
        }
        let samples = ((end + REST) * self.rate) as usize;
        let t: Vec<f64> = (0..samples).map(|k| k as f64 / self.rate).collect();
        let hold = -load / (q[p::GEAR_RATIO] * q[p::TORQUE_CONSTANT]);
        let current = |t: &f64| {
            hold + switches.iter().find(|(a, b, _)| a <= t && t < b).map_or(0.0, |(_, _, level)| *level)
        };
        let channel = |name: &str, output, step: f64| OutputChannel {
            name: name.into(),
            output,
            t: t.clone(),
            y: vec![0.0; samples],
            sigma: step / 12f64.sqrt(),
            resolution: step,
            ..OutputChannel::default()
        };
        let mut run = IdentificationRun {
            name: format!("{i}"),
            drives: vec![
                InputDrive {
                    input: 0,
                    t: t.clone(),
                    u: t.iter().map(current).collect(),
                    between: InputInterpolation::Hold,
                    ..InputDrive::default()
                },
                InputDrive {
                    input: 1,
                    t: vec![0.0],
                    u: vec![load],
                    between: InputInterpolation::Hold,
                    ..InputDrive::default()
                },
            ],
            channels: vec![
                channel("motorAngle", output::MOTOR_ANGLE, 2.0 * std::f64::consts::PI / self.counts),
                channel("loadAngle", output::LOAD_ANGLE, AMR),
            ],
            start: 0.0,
            at_rest: true,
            ..IdentificationRun::default()
        };
        simulate(model, &mut run, q);
        run
    }
}

/// A flexible joint without effects.
pub(crate) fn joint() -> SimulatedPlant {
    let structure =
        PlantStructure { model: "TwoMassJoint".into(), flexible: vec![true], ..PlantStructure::default() };
    SimulatedPlant::new(structure).expect("no effects")
}

/// Fills the readings of a run with what a model with these parameters shows.
pub(crate) fn simulate(model: &SimulatedPlant, run: &mut IdentificationRun, q: &[f64]) -> bool {
    let plan = PredictionPlan::new(run, model.sizes().inputs);
    let Ok(found) = model.predict(&plan, q, &InputMap::default(), run.at_rest) else {
        return false;
    };
    for (c, channel) in run.channels.iter_mut().enumerate() {
        channel.y.copy_from_slice(&found.y[plan.channels()[c]..plan.channels()[c + 1]]);
    }
    true
}
