//! What DELIAN costs: `flexible_arm_speed [ROUNDS [MOVES [SOLVER]]]`, SOLVER a part of its name as the table has it.
//!
//! Rates: one evaluation with links of each number of shapes, ns, and what that is of rigid ones. Short batches of all kinds
//! take turns, so a machine that is busy for a while is so for all of them; ratios are those of a round.
//!
//! Move: 2 s of all six joints with friction and a controller at 1 kHz, as Co-Simulation runs them, outputs of each sample
//! included: how many times faster than the clock, what it took, and how far the tip is off the way of an explicit run at 1e-9.
#![allow(clippy::print_stdout)]

use std::cell::Cell;
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use trueup_models::controller::{ManipulatorController, input, parameter};
use trueup_models::flexible_arm::presets::{RAISED, delian, parameters, structure};
use trueup_models::flexible_arm::{FlexibleArm, FlexibleArmStructure};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::{Outputs, States};
use trueup_numerics::Scalar;
use trueup_numerics::driver::{Driver, DriverMemory, DriverOptions, DriverState, Flow, Solver, StepInputs};
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes, StiffPart};

const JOINTS: usize = 6;

/// An arm with its values and its name.
struct Kind {
    name: &'static str,
    arm: FlexibleArm,
    p: Vec<f64>,
}

fn kind(name: &'static str, design: &RobotDesign) -> Result<Kind, String> {
    let arm = FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), ..structure(false) })?;
    let p = parameters(&arm, design);
    Ok(Kind { name, arm, p })
}

fn kinds() -> Result<Vec<Kind>, String> {
    let with = |x: usize, y: usize, torsion: usize| {
        let mut d = delian();
        d.flexures.iter_mut().for_each(|f| f.shapes = Shapes { x, y, torsion });
        d
    };
    Ok(vec![
        kind("rigid links", &delian().stiffened())?,
        kind("links with two modes", &with(2, 0, 0))?,
        kind("links of 2, 2, 1 shapes (the preset)", &delian())?,
        kind(
            "the preset without axial stiffening",
            &RobotDesign { axial_stiffening: Some(false), ..delian() },
        )?,
        kind("links of 5, 5, 1 shapes", &with(5, 5, 1))?,
    ])
}

/// Seconds of one evaluation of the rates, everything in motion, all motors sliding.
fn rates(kind: &Kind, count: u32) -> f64 {
    let sizes = kind.arm.sizes();
    let mut x: Vec<f64> = (0..sizes.states).map(|k| 0.3 * (k as f64).sin()).collect();
    let links = States::new(&kind.arm.structure().robot);
    x[links.link_coordinate..links.joint_velocity].iter_mut().for_each(|e| *e *= 0.01);
    let mut u = vec![0.0; sizes.inputs];
    u[..JOINTS].iter_mut().enumerate().for_each(|(k, u)| *u = (k as f64).cos());
    let mut dx = vec![0.0; sizes.states];
    let begin = Instant::now();
    for _ in 0..count {
        x[links.joint_angle] += 1e-9;
        kind.arm.rates(At { t: 0.0, x: black_box(&x), u: &u, p: &kind.p, modes: &[1; JOINTS] }, &mut dx);
        black_box(&dx);
    }
    begin.elapsed().as_secs_f64() / f64::from(count)
}

/// How far each joint goes, rad.
const WAY: [f64; JOINTS] = [0.5, -0.3, 0.4, 0.6, -0.5, 0.8];
/// Of the move and of its part in motion, s.
const END: f64 = 2.0;
const MOVING: f64 = 1.6;
const PERIOD: f64 = 1e-3;

/// Share of the way and its rate (1/s): without a jump of the acceleration.
fn smooth(t: f64) -> (f64, f64) {
    let s = (t / MOVING).min(1.0);
    (s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * s * s * (1.0 - s) * (1.0 - s) / MOVING)
}

/// What a move took.
#[derive(Default)]
struct Cost {
    seconds: f64,
    accepted: usize,
    rejected: usize,
    events: usize,
    /// Of the joints from their goals in the end, rad.
    off: f64,
    calls: [usize; 3],
    /// Of the tip at the samples, m.
    way: Vec<[f64; 3]>,
}

/// A model that counts its calls.
struct Counted<'a> {
    arm: &'a FlexibleArm,
    calls: [Cell<usize>; 3],
}

/// What is counted: rates, rates over duals, indicators.
const RATES: usize = 0;
const DUALS: usize = 1;
const INDICATORS: usize = 2;

impl Counted<'_> {
    fn count(&self, what: usize) {
        self.calls[what].set(self.calls[what].get() + 1);
    }
}

impl Hybrid for Counted<'_> {
    fn sizes(&self) -> ModelSizes {
        self.arm.sizes()
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        self.arm.start(p, x);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        self.arm.start_modes(at, modes);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.count(if size_of::<T>() == size_of::<f64>() { RATES } else { DUALS });
        self.arm.rates(at, dx);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        self.arm.outputs(at, y);
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        self.count(INDICATORS);
        self.arm.indicators(at, z);
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        self.arm.update(t, x, u, p, modes)
    }
    fn stiff_part(&self) -> Option<&dyn StiffPart> {
        self.arm.stiff_part()
    }
}

/// A simulation of one model, with its memory.
struct Side<'a, M: Hybrid> {
    model: &'a M,
    driver: Driver,
    t: f64,
    x: Vec<f64>,
    u: Vec<f64>,
    p: &'a [f64],
    modes: Vec<i32>,
    memory: DriverMemory,
    y: Vec<f64>,
}

impl<'a, M: Hybrid> Side<'a, M> {
    fn new(
        model: &'a M,
        p: &'a [f64],
        u: Vec<f64>,
        nominal: &[f64],
        options: DriverOptions,
    ) -> Result<Self, Box<dyn Error>> {
        let n = model.sizes();
        let driver = Driver::new(n, nominal, options);
        let (x, y, modes) = (vec![0.0; n.states], vec![0.0; n.outputs], vec![0; n.modes]);
        let mut side = Self { model, driver, t: 0.0, x, u, p, modes, memory: DriverMemory::default(), y };
        let Self { driver, t, x, u, modes, memory, .. } = &mut side;
        driver.initialise(model, &mut DriverState { t, x, u, p, modes, memory })?;
        side.outputs();
        Ok(side)
    }
    fn outputs(&mut self) {
        let at = At { t: self.t, x: &self.x, u: &self.u, p: self.p, modes: &self.modes };
        self.model.outputs(at, &mut self.y);
    }
    fn step(&mut self, end: f64, cost: &mut Cost) -> Result<(), Box<dyn Error>> {
        let Self { model, driver, t, x, u, p, modes, memory, .. } = self;
        let mut s = DriverState { t, x, u, p, modes, memory };
        let done = driver.advance_to(*model, &mut s, end, StepInputs::Hold, &mut |_| Flow::Continue)?;
        cost.accepted += done.accepted;
        cost.rejected += done.rejected;
        cost.events += done.events;
        self.outputs();
        Ok(())
    }
}

/// P on the angle, PI on the rate of the motor: as fast as the joint and the links leave it.
fn gains(arm: &FlexibleArm, p: &[f64]) -> Vec<f64> {
    let inertia = trueup_models::space::layout::Parameters::new(&arm.structure().robot).motor_inertia;
    // Nothing adapts: rates of adaptation are 0.
    let mut q = vec![0.0; ManipulatorController { joints: JOINTS }.sizes().parameters];
    for j in 0..JOINTS {
        for (which, value) in [
            (parameter::POSITION_GAIN, 4.0),
            (parameter::VELOCITY_GAIN, 20.0 * p[inertia + j]),
            (parameter::VELOCITY_INTEGRAL_TIME, 0.2),
            (parameter::GEAR_RATIO, 1.0),
            (parameter::TORQUE_CONSTANT, 1.0),
            (parameter::LIMIT, 1000.0),
            (parameter::WAVE_FREQUENCY, 10.0),
            (parameter::WASHOUT_FREQUENCY, 1.0),
        ] {
            q[which * JOINTS + j] = value;
        }
    }
    q[parameter::COUNT * JOINTS..][..2].copy_from_slice(&[PERIOD, 1.0]);
    q
}

/// All joints go their way and hold there.
fn travel(kind: &Kind, options: DriverOptions) -> Result<Cost, Box<dyn Error>> {
    let (arm, s) = (&kind.arm, &kind.arm.structure().robot);
    let start = [0.0, RAISED, -RAISED, 0.0, 0.0, 0.0];
    let from = Outputs::new(s);
    let nominal: Vec<f64> = States::list(s).iter().flat_map(|e| vec![e.kind.nominal; e.len()]).collect();
    let q = gains(arm, &kind.p);
    let law = ManipulatorController { joints: JOINTS };
    let mut cost = Cost::default();
    let counted = Counted { arm, calls: Default::default() };
    let mut plant = Side::new(&counted, &kind.p, vec![0.0; arm.sizes().inputs], &nominal, options)?;
    let signals = |t: f64, y: &[f64], u: &mut [f64]| {
        let (share, rate) = smooth(t);
        for j in 0..JOINTS {
            for (which, value) in [
                (input::POSITION_REFERENCE, start[j] + share * WAY[j]),
                (input::VELOCITY_FEEDFORWARD, rate * WAY[j]),
                (input::MOTOR_ANGLE, y[from.motor_angle + j]),
                (input::MOTOR_VELOCITY, y[from.motor_velocity + j]),
                (input::LOAD_ANGLE, y[from.joint_angle + j]),
                (input::LOAD_VELOCITY, y[from.joint_velocity + j]),
            ] {
                u[which * JOINTS + j] = value;
            }
        }
    };
    let mut u = vec![0.0; law.sizes().inputs];
    signals(0.0, &plant.y, &mut u);
    // Sampled: nothing moves between its samples.
    let sampled = DriverOptions { solver: Solver::FixedEuler, max_step: PERIOD, ..DriverOptions::default() };
    let mut control = Side::new(&law, &q, u, &[], sampled)?;
    let (steps, begin) = ((END / PERIOD).round() as usize, Instant::now());
    for k in 1..=steps {
        plant.u[..JOINTS].copy_from_slice(&control.y[..JOINTS]);
        let end = k as f64 * PERIOD;
        plant.step(end, &mut cost)?;
        cost.way.push(core::array::from_fn(|i| plant.y[from.tip_position + i]));
        signals(end, &plant.y, &mut control.u);
        // The sample at the end sees what the arm does there.
        control.step(end, &mut Cost::default())?;
    }
    cost.seconds = begin.elapsed().as_secs_f64();
    cost.calls = counted.calls.each_ref().map(Cell::get);
    cost.off = (0..JOINTS)
        .fold(0.0, |most: f64, j| most.max((plant.y[from.joint_angle + j] - start[j] - WAY[j]).abs()));
    Ok(cost)
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Result<(), Box<dyn Error>> {
    let argument =
        |k: usize, without: usize| std::env::args().nth(k).map_or(Ok(without), |r| r.parse::<usize>());
    let (rounds, moves) = (argument(1, 400)?.max(1), argument(2, 3)?);
    let wanted = std::env::args().nth(3).unwrap_or_default();
    let kinds = kinds()?;
    let mut times = vec![Vec::new(); kinds.len()];
    for _ in 0..rounds {
        times.iter_mut().zip(&kinds).for_each(|(times, kind)| times.push(rates(kind, 500)));
    }
    println!(
        "| rates | modes | ns, fastest | ns, median of {rounds} | times rigid links, median | by the fastest |"
    );
    println!("|---|---|---|---|---|---|");
    let fastest = |times: &[f64]| 1e9 * times.iter().copied().fold(f64::INFINITY, f64::min);
    for (own, kind) in times.iter().zip(&kinds) {
        let mut ratios: Vec<f64> = own.iter().zip(&times[0]).map(|(a, b)| a / b).collect();
        println!(
            "| {} | {} | {:.0} | {:.0} | {:.2} | {:.2} |",
            kind.name,
            kind.arm.structure().robot.modes(),
            fastest(own),
            1e9 * median(&mut own.clone()),
            median(&mut ratios),
            fastest(own) / fastest(&times[0]),
        );
    }
    if moves == 0 {
        return Ok(());
    }
    println!(
        "\n| move of {END} s, 1 kHz | solver | times the clock | steps | rejected | rates | over duals | indicators | events | off goal, mrad | tip off, um, median, most |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let adaptive = |solver, tolerance| DriverOptions { solver, tolerance, ..DriverOptions::default() };
    let fixed = |max_step| DriverOptions { solver: Solver::FixedStiff, max_step, ..DriverOptions::default() };
    let solvers = [
        ("explicit, 1e-6", adaptive(Solver::Explicit, 1e-6)),
        ("stiff, 1e-6", adaptive(Solver::Stiff, 1e-6)),
        ("stiff, 1e-4", adaptive(Solver::Stiff, 1e-4)),
        ("fixed stiff, 0.25 ms", fixed(0.25e-3)),
        ("fixed stiff, 0.5 ms", fixed(0.5e-3)),
        ("fixed stiff, 1 ms", fixed(1e-3)),
    ];
    for kind in &kinds[..4] {
        let exact = travel(kind, adaptive(Solver::Explicit, 1e-9))?.way;
        for (name, options) in solvers.iter().filter(|(name, _)| name.contains(&wanted)) {
            let done: Vec<Cost> = (0..moves).map(|_| travel(kind, *options)).collect::<Result<_, _>>()?;
            let seconds = median(&mut done.iter().map(|c| c.seconds).collect::<Vec<_>>());
            let Cost { accepted, rejected, events, off, calls, way, .. } = &done[0];
            let mut apart: Vec<f64> = way.iter().zip(&exact).map(|(a, b)| distance(a, b)).collect();
            let [rates, duals, indicators] = calls;
            println!(
                "| {} | {name} | {:.1} | {accepted} | {rejected} | {rates} | {duals} | {indicators} | {events} | {:.2} | {:.3}, {:.3} |",
                kind.name,
                END / seconds,
                1e3 * off,
                1e6 * median(&mut apart),
                1e6 * apart[apart.len() - 1],
            );
        }
    }
    Ok(())
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
