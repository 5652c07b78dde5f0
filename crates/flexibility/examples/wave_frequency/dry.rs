//! Some of the moves by the arm itself: not linear, stick-slip in its motors, sensors ideal.

use super::Asked;
use super::loops::N;
use super::moves::{GAIN, Move, RAMP, STEP, TIME, control, draw, schedule, spread, vibration};
use super::schedule::{table, within};
use std::error::Error;
use trueup_flexibility::closed_loop::linearised;
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::controller::{ManipulatorController, Strategy, input, state};
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::flexible_arm::presets::structure;
use trueup_models::space::layout::{Outputs, States};
use trueup_numerics::driver::{Driver, Flow, Inputs, Memory, Options, Solver, State};
use trueup_numerics::hybrid::{At, Hybrid};

const TOLERANCE: f64 = 1e-6;

/// Vibration in mm over the whole move and after the first second, and how far from the goal it ends, mm.
fn run(arm: &FlexibleArm, m: &Move, law: &[f64]) -> Result<[f64; 3], Box<dyn Error>> {
    let s = &arm.structure().robot;
    let (sizes, of, to) = (arm.sizes(), States::new(s), Outputs::new(s));
    let controller = ManipulatorController { joints: N };
    controller.check(law).map_err(|e| e.1)?;
    let own = controller.sizes();
    let (mut cx, mut sampled) = (vec![0.0; own.states], vec![0; own.modes]);
    let begin = linearised(arm, &m.p, &m.poses[0])?;
    let from = begin.state[of.joint_angle..][..N].to_vec();
    let nominal: Vec<f64> = States::list(s).iter().flat_map(|e| vec![e.kind.nominal; e.len()]).collect();
    let options = Options { solver: Solver::Stiff, tolerance: TOLERANCE, ..Options::default() };
    let mut driver = Driver::new(sizes, &nominal, options);
    let (mut t, mut x, mut u) = (0.0, begin.state.clone(), vec![0.0; sizes.inputs]);
    u[..N].copy_from_slice(&begin.drive);
    let (mut modes, mut memory) = (vec![0; sizes.modes], Memory::default());
    let mut now = State { t: &mut t, x: &mut x, u: &mut u, p: &m.p, modes: &mut modes, memory: &mut memory };
    driver.initialise_from(arm, &mut now)?;
    let (mut y, mut sensed, mut way) = (vec![0.0; sizes.outputs], vec![0.0; own.inputs], Vec::new());
    let at_goal = equilibrium(arm, &m.p, &m.poses[1], [0.0; 3])?.state;
    let mut goal = y.clone();
    arm.outputs(At { t: 0.0, x: &at_goal, u: now.u, p: &m.p, modes: now.modes }, &mut goal);
    for k in 0..(TIME / STEP) as usize {
        let time = k as f64 * STEP;
        arm.outputs(At { t: time, x: now.x, u: now.u, p: &m.p, modes: now.modes }, &mut y);
        way.push([0, 1, 2].map(|i| y[to.tip_position + i] - goal[to.tip_position + i]));
        let left = 1.0 - (time / RAMP).min(1.0);
        for j in 0..N {
            for (which, value) in [
                (input::POSITION_REFERENCE, m.goal[j] + (from[j] - m.goal[j]) * left),
                (input::MOTOR_ANGLE, y[to.motor_angle + j]),
                (input::MOTOR_VELOCITY, y[to.motor_velocity + j]),
                (input::LOAD_ANGLE, y[to.joint_angle + j]),
                (input::LOAD_VELOCITY, y[to.joint_velocity + j]),
            ] {
                sensed[which * N + j] = value;
            }
        }
        if k == 0 {
            // States from the inputs, the first sample later; the integral holds the weight already.
            controller.start_modes(At { t: STEP, x: &cx, u: &[], p: law, modes: &[] }, &mut sampled);
            controller.update(time, &mut cx, &sensed, law, &mut sampled);
            cx[state::INTEGRAL_TORQUE * N..][..N].copy_from_slice(&begin.drive);
        }
        controller.update(time + STEP, &mut cx, &sensed, law, &mut sampled);
        now.u[..N].copy_from_slice(&cx[state::HELD_OUTPUT * N..][..N]);
        driver.advance_to(arm, &mut now, time + STEP, Inputs::Hold, &mut |_| Flow::Continue)?;
    }
    let window = (std::f64::consts::TAU / m.first / STEP) as usize | 1;
    let off = way.last().map_or(0.0, |tip| tip.iter().map(|v| v * v).sum::<f64>().sqrt());
    Ok([vibration(&way, window, 0), vibration(&way, window, (1.0 / STEP) as usize), off].map(|v| 1e3 * v))
}

pub(crate) fn study(asked: &Asked) -> Result<(), Box<dyn Error>> {
    let arm = FlexibleArm::new(structure(false))?;
    let moves = draw(&arm, asked.moves(), false)?;
    println!("mm: vibration over the whole move, after the first second, from the goal");
    let mut all: Vec<(&str, Vec<[f64; 3]>)> = Vec::new();
    for (i, m) in moves.iter().enumerate() {
        let bounds = table(&arm, m.payload, false, 1)?;
        let follow = [bounds[0], bounds[1].map(|b| within(0.2, b, 400.0))];
        let of = |strategy, omega| control(&arm, &m.p, strategy, [omega; N], None);
        let mut scheduled = of(Strategy::VwbcAdaptive, 20.0);
        schedule(&mut scheduled, 3, &follow, [20.0, 400.0], m.poses[0][2]);
        let laws = [
            ("P/PI", of(Strategy::PPi, 40.0)),
            ("VWBC, 20 rad/s", of(Strategy::Vwbc, 20.0)),
            ("VWBC, 100 rad/s", of(Strategy::Vwbc, 100.0)),
            ("VWBC, over joint 3", scheduled),
            ("VWBC_WASHOUT, 20 rad/s", of(Strategy::VwbcWashout, 20.0)),
        ];
        println!("{:.2} kg, first mode {:.1} rad/s, bound {:.0} rad/s", m.payload, m.first, GAIN * m.bound);
        for (k, (name, law)) in laws.iter().enumerate() {
            let done = run(&arm, m, law)?;
            println!("  {name:24} {:8.3} {:8.3} {:8.2}", done[0], done[1], done[2]);
            if i == 0 {
                all.push((name, vec![]));
            }
            all[k].1.push(done);
        }
    }
    let still = all[0].1.clone();
    println!("less than P/PI in %, median: whole, after the first second; mm from the goal, median");
    for (name, row) in &all {
        let less = |i: usize| {
            spread(&row.iter().zip(&still).map(|(a, b)| 100.0 * (1.0 - a[i] / b[i])).collect::<Vec<_>>())[1]
        };
        let off = spread(&row.iter().map(|r| r[2]).collect::<Vec<_>>())[1];
        println!("  {name:24} {:7.1} {:7.1} {off:8.2}", less(0), less(1));
    }
    Ok(())
}
