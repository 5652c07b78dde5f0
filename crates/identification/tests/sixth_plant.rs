//! A plant of no list, whole in this file: a pendulum with a motor on its axle. It is a plant as ours are: simulated along
//! recordings, its derivatives exact, its parameters identified, its forces and tangent requested.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use trueup_identification::lsq::{SolverOptions, solve};
use trueup_identification::model::{NamedVariables, SimulatedPlant};
use trueup_identification::output_error::OutputError;
use trueup_identification::predict::{InputMap, PredictionPlan};
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_identification::unknown::FitUnknown;
use trueup_models::compiled::{Compiled, PlantModel};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};
use trueup_plant::{
    Coordinate, CoordinateKind, PlantError, PlantQuantity, QuantityRole, VariableTable, force_sensitivity,
    tangent,
};

/// J q'' = u - m g l sin q - d q'.
#[derive(Debug)]
struct Pendulum;

const INERTIA: usize = 0;
const WEIGHT: usize = 1;
const DAMPING: usize = 2;

impl Hybrid for Pendulum {
    fn sizes(&self) -> ModelSizes {
        ModelSizes { states: 2, inputs: 1, parameters: 5, outputs: 2, ..ModelSizes::default() }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        x.copy_from_slice(&p[3..5]);
    }
    fn start_modes(&self, _: At<f64>, _: &mut [i32]) {}
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.rates_under(at, &[], dx);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        y.copy_from_slice(at.x);
    }
    fn indicators<T: Scalar>(&self, _: At<T>, _: &mut [T]) {}
    fn update(&self, _: f64, _: &mut [f64], _: &[f64], _: &[f64], _: &mut [i32]) -> EventUpdate {
        EventUpdate::default()
    }
}

impl PlantModel for Pendulum {
    const NAME: &'static str = "Pendulum";
    fn table(&self) -> VariableTable {
        let parameter =
            |name: &str, unit, start| PlantQuantity { start, ..PlantQuantity::new(name, unit).at_least(0.0) };
        let initial =
            |name, unit| PlantQuantity { role: QuantityRole::Initial, ..PlantQuantity::new(name, unit) };
        VariableTable {
            parameters: vec![
                parameter("inertia", "kg.m2", 0.02),
                parameter("weight", "N.m", 0.5),
                parameter("damping", "N.m.s/rad", 0.01),
                initial("initialAngle", "rad"),
                PlantQuantity { rate_of: Some(3), ..initial("initialVelocity", "rad/s") },
            ],
            inputs: vec![PlantQuantity::new("torque", "N.m")],
            outputs: vec![
                PlantQuantity::new("angle", "rad"),
                PlantQuantity { rate_of: Some(0), ..PlantQuantity::new("velocity", "rad/s") },
            ],
            usual: vec![INERTIA, WEIGHT, DAMPING],
            driving: vec![0],
            ..VariableTable::default()
        }
    }
    fn coordinates(&self) -> Vec<Coordinate> {
        vec![Coordinate {
            name: "pendulum".into(),
            kind: CoordinateKind::Motor,
            force_unit: "N.m",
            position: Some(0),
            rate: 1,
            initial_position: 3,
            initial_rate: 4,
            position_output: 0,
            rate_output: 1,
            friction_mode: None,
            dry_friction: None,
            follows: None,
        }]
    }
    fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]) {
        let own = force.first().copied().unwrap_or_else(T::zero);
        let (q, v) = (at.x[0], at.x[1]);
        dx[0] = v;
        dx[1] = (at.u[0] + own - at.p[WEIGHT] * q.sin() - at.p[DAMPING] * v) / at.p[INERTIA];
    }
    fn with(&self, effects: &[&str]) -> Result<Self, PlantError> {
        match effects {
            [] => Ok(Self),
            [id, ..] => {
                Err(PlantError(format!("no effect acts in a pendulum, `{id}` neither; leave it out")))
            }
        }
    }
}

fn plant() -> SimulatedPlant {
    SimulatedPlant::of_plant(Arc::new(Compiled::new(Pendulum)))
}

/// What it shows while a torque swings it from rest at 0.4 rad.
fn recording(model: &SimulatedPlant, p: &[f64]) -> IdentificationRun {
    let t: Vec<f64> = (0..800).map(|k| f64::from(k) * 5e-3).collect();
    let u: Vec<f64> = t.iter().map(|t| 0.3 * (2.1 * t).sin() + 0.1 * (7.7 * t).cos()).collect();
    let mut run = IdentificationRun {
        name: "swinging".into(),
        channels: vec![OutputChannel {
            name: "angle".into(),
            t: t.clone(),
            y: vec![0.0; t.len()],
            sigma: 1e-4,
            ..OutputChannel::default()
        }],
        drives: vec![InputDrive { t, u, between: InputInterpolation::Linear, ..InputDrive::default() }],
        ..IdentificationRun::default()
    };
    let plan = PredictionPlan::new(&run, 1);
    run.channels[0].y = model.predict(&plan, p, &InputMap::default(), false).unwrap().y;
    run
}

#[test]
fn a_plant_of_nobodys_list_is_identified() {
    let model = plant();
    let mut truth = model.defaults();
    truth[3] = 0.4;
    let runs = [recording(&model, &truth)];
    // It does swing, and past where a sine is a straight line.
    assert!(runs[0].channels[0].y.iter().fold(0.0, |m: f64, y| m.max(y.abs())) > 1.0);
    let unknowns: Vec<FitUnknown> = (model.usual().iter().zip([1.3, 0.8, 0.6]))
        .map(|(name, wrong)| {
            let at = model.parameter(name).unwrap();
            FitUnknown::positive(name, at, truth[at] * wrong)
        })
        .collect();
    let problem = OutputError::new(&model, &truth, &runs, unknowns);
    let found = solve(&problem, &problem.start(), SolverOptions::default()).unwrap();
    for (value, truth) in problem.values(&found.x).iter().zip(&truth) {
        assert!((value / truth - 1.0).abs() < 1e-6, "{value} {truth}");
    }
    assert_eq!(NamedVariables::outputs(&model)[1].rate_of, Some(0));
}

#[test]
fn its_forces_and_tangent_are_there() {
    let model = plant();
    let (p, plant) = (model.defaults(), model.plant());
    let at = At { t: 0.0, x: &[0.7, -2.0], u: &[0.1], p: &p, modes: &[] };
    let t = tangent(plant, at, &[], &[]).unwrap();
    assert!((t.by_state[2] + p[WEIGHT] * 0.7f64.cos() / p[INERTIA]).abs() < 1e-12);
    assert_eq!(t.by_force, [0.0, 1.0 / p[INERTIA]]);
    let held = tangent(plant, at, &[], &[true]).unwrap();
    assert!(held.by_state.iter().chain(&held.by_force).all(|v| *v == 0.0));
    // A heavier pendulum is one that its weight pulls.
    let force = force_sensitivity(plant, at, &[], &[WEIGHT]).unwrap();
    assert!((force[0] + p[WEIGHT] * 0.7f64.sin()).abs() < 1e-12);
    assert!(plant.with(&["backlash"]).unwrap_err().0.contains("leave it out"));
}
