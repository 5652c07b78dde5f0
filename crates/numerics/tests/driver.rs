//! Simulation of hybrid models against closed forms.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common::{Ball, Block, Circle, Falls, GRAVITY, Graze};
use trueup_numerics::Driver;
use trueup_numerics::driver::*;
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::Hybrid;

fn options(solver: Solver, tolerance: f64) -> DriverOptions {
    DriverOptions { solver, tolerance, ..DriverOptions::default() }
}

/// Holder of a state, as an FMU instance is.
#[derive(Clone)]
struct Owner {
    t: f64,
    x: Vec<f64>,
    u: Vec<f64>,
    p: Vec<f64>,
    modes: Vec<i32>,
    memory: DriverMemory,
}

impl Owner {
    fn new<M: Hybrid>(model: &M, p: &[f64]) -> Self {
        let n = model.sizes();
        let (x, u) = (vec![0.0; n.states], vec![0.0; n.inputs]);
        Self { t: 0.0, x, u, p: p.to_vec(), modes: vec![0; n.modes], memory: DriverMemory::default() }
    }
    fn lend(&mut self) -> DriverState<'_> {
        DriverState {
            t: &mut self.t,
            x: &mut self.x,
            u: &mut self.u,
            p: &self.p,
            modes: &mut self.modes,
            memory: &mut self.memory,
        }
    }
    fn bits(&self) -> Vec<u64> {
        [self.t].iter().chain(&self.x).chain(&self.memory.to_array()).map(|v| v.to_bits()).collect()
    }
}

fn go_on(_: DriverView) -> Flow {
    Flow::Continue
}

#[test]
fn ball_bounces_when_the_closed_form_says() {
    let restitution: f64 = 0.8;
    for direction in [Direction::Both, Direction::Down] {
        for (solver, limit) in [(Solver::Explicit, 1e-13), (Solver::Stiff, 1e-11)] {
            let run = simulate(
                &Ball(direction),
                &[restitution],
                &[],
                options(solver, 1e-10),
                &|_, _| {},
                &[0.0, 3.0],
            )
            .unwrap();
            let fall = (2.0 / GRAVITY).sqrt();
            let mut exact = fall;
            let mut bounces = 0;
            for (t, _) in &run.events {
                if (t - exact).abs() < 1e-6 && t >= &(exact - limit) {
                    assert!((t - exact).abs() < limit, "{solver:?} bounce {bounces}: {t} instead of {exact}");
                    bounces += 1;
                    exact += 2.0 * fall * restitution.powi(bounces);
                }
            }
            assert!(exact > 3.0, "{bounces} bounces only, events {:?}", run.events);
        }
    }
}

#[test]
fn ball_at_rest_is_an_error_not_an_endless_loop() {
    let model = Ball(Direction::Both);
    let sum = (2.0 / GRAVITY).sqrt() * (1.0 + 2.0 * 0.5 / (1.0 - 0.5));
    let error =
        simulate(&model, &[0.5], &[], options(Solver::Explicit, 1e-8), &|_, _| {}, &[0.0, 3.0]).unwrap_err();
    let DriveError::Chattering { t, cause } = error else { panic!("{error}") };
    assert!(
        (t - sum).abs() < 1e-6 && cause == EventCause::Indicator(0),
        "{error}, should come to rest at {sum}"
    );
}

#[test]
fn events_at_one_time_are_one_for_whoever_handles_them() {
    let model = Ball(Direction::Both);
    let o = DriverOptions { stop_at_event: true, ..options(Solver::Explicit, 1e-8) };
    let mut driver = Driver::new(model.sizes(), &[], o);
    let mut ball = Owner::new(&model, &[0.5]);
    driver.initialise(&model, &mut ball.lend()).unwrap();
    let mut told = vec![0.0];
    let error = loop {
        match driver.advance_to(&model, &mut ball.lend(), 3.0, StepInputs::Hold, &mut go_on) {
            Ok(reached) => {
                assert_eq!(reached.pending, Some(EventCause::Indicator(0)), "{reached:?}");
                told.push(reached.t);
                driver.handle_event(&model, &mut ball.lend()).unwrap();
            }
            Err(error) => break error,
        }
    };
    assert!(matches!(error, DriveError::Chattering { .. }), "{error}");
    let shortest = told.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    assert!(told.len() > 20 && shortest > 1e-9 && shortest < 1e-8, "{shortest:e} s between {told:?}");
}

#[test]
fn stick_slip_has_the_period_of_the_closed_form() {
    let (stick, slip, onset) = Block::exact(&Block::P);
    for (solver, tolerance, limit) in [(Solver::Explicit, 1e-12, 1e-10), (Solver::Stiff, 1e-10, 1e-7)] {
        let run = simulate(&Block, &Block::P, &[], options(solver, tolerance), &|_, _| {}, &[0.0, 2.0, 20.0])
            .unwrap();
        let mut exact = onset / Block::P[0];
        let mut worst: f64 = 0.0;
        for (t, modes) in &run.events {
            worst = worst.max((t - exact).abs());
            assert!(worst < limit, "{solver:?}: mode {modes:?} at {t} instead of {exact}");
            exact += if modes[0] == 1 { slip } else { stick };
        }
        assert_eq!(run.events.len(), 1 + (2.0 * (20.0 - onset / Block::P[0]) / (stick + slip)) as usize);
        println!("{solver:?}: {} events, worst {worst:e} s", run.events.len());
    }
}

#[test]
fn stopping_at_events_gives_the_same_and_restoring_continues_bit_equal() {
    for solver in [Solver::Explicit, Solver::Stiff, Solver::FixedExplicit, Solver::FixedStiff] {
        let o = DriverOptions { max_step: 0.01, ..options(solver, 1e-8) };
        let mut owner = Owner::new(&Block, &Block::P);
        let mut driver = Driver::new(Block.sizes(), &[], o);
        driver.initialise(&Block, &mut owner.lend()).unwrap();
        driver.advance_to(&Block, &mut owner.lend(), 1.3, StepInputs::Hold, &mut go_on).unwrap();

        // Restored elsewhere.
        let mut twin = owner.clone();
        twin.memory = DriverMemory::from_array(owner.memory.to_array());
        let mut other = Driver::new(Block.sizes(), &[], o);
        let a = driver.advance_to(&Block, &mut owner.lend(), 4.0, StepInputs::Hold, &mut go_on).unwrap();
        let b = other.advance_to(&Block, &mut twin.lend(), 4.0, StepInputs::Hold, &mut go_on).unwrap();
        assert_eq!((owner.bits(), a), (twin.bits(), b));
        assert_eq!(owner.t, 4.0);

        // Event by event.
        let mut halting = Driver::new(Block.sizes(), &[], DriverOptions { stop_at_event: true, ..o });
        let mut halted = Owner::new(&Block, &Block::P);
        halting.initialise(&Block, &mut halted.lend()).unwrap();
        let mut events = 0;
        while halted.t < 4.0 {
            let reached =
                halting.advance_to(&Block, &mut halted.lend(), 4.0, StepInputs::Hold, &mut go_on).unwrap();
            if reached.pending.is_some() {
                let before = halted.modes[0];
                assert!(halting.handle_event(&Block, &mut halted.lend()).unwrap());
                assert_ne!(before, halted.modes[0]);
                events += 1;
            }
        }
        assert!(events > 4);
        assert!((halted.x[0] - owner.x[0]).abs() < 1e-6, "{solver:?}");
    }
}

#[test]
fn a_state_that_leaves_the_domain_of_the_rates_is_named() {
    let error = simulate(&Falls, &[], &[], DriverOptions::default(), &|_, _| {}, &[0.0, 2.0]).unwrap_err();
    let DriveError::NotFinite { t, what: DriverQuantity::Rate(0) } = error else { panic!("{error}") };
    assert!((t - 1.0).abs() < 1e-9);
}

#[test]
fn ends_exactly_and_never_beyond_with_ragged_calls() {
    let mut owner = Owner::new(&Circle, &[]);
    let mut driver = Driver::new(Circle.sizes(), &[], options(Solver::Explicit, 1e-10));
    driver.initialise(&Circle, &mut owner.lend()).unwrap();
    let mut t = 0.0;
    for k in 0..2000 {
        t += [1e-3, 1e-15, 0.017, 1e-17, 0.4][k % 5];
        let mut last = owner.t;
        driver
            .advance_to(&Circle, &mut owner.lend(), t, StepInputs::Hold, &mut |view| {
                assert!(view.t <= t && view.t >= last);
                last = view.t;
                Flow::Continue
            })
            .unwrap();
        assert_eq!(owner.t, t);
    }
    assert!(
        (owner.x[0] - t.cos()).abs() < 1e-7 && (owner.x[1] + t.sin()).abs() < 1e-7,
        "{}",
        owner.x[0] - t.cos()
    );
}

#[test]
fn an_indicator_that_comes_back_within_one_step_is_found() {
    // Above 1 - 1e-5 for 9e-3 s in every period of 6.28 s, with steps of up to a second.
    let level = 1.0 - 1e-5;
    let (half, period) = (f64::acos(level), 2.0 * std::f64::consts::PI);
    for (solver, tolerance) in [(Solver::Explicit, 1e-8), (Solver::Stiff, 1e-8)] {
        let run =
            simulate(&Graze, &[level], &[], options(solver, tolerance), &|_, _| {}, &[0.0, 31.0]).unwrap();
        let exact: Vec<f64> =
            (0..5).map(|k| (f64::from(k) + 0.5) * period).flat_map(|top| [top - half, top + half]).collect();
        assert_eq!(run.events.len(), exact.len(), "{solver:?}: {:?}", run.events);
        for ((t, _), exact) in run.events.iter().zip(exact) {
            assert!((t - exact).abs() < 1e-3, "{t} instead of {exact}");
        }
    }
}
