//! A move by the arm itself: not linear, stick-slip in its motors, in steps of the controllers' period.

use super::loops::N;
use super::moves::{Encoders, How, Move, Outcome, RAMP, STEP, TIME};
use std::error::Error;
use trueup_flexibility::closed_loop::linearised;
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::controller::{ManipulatorController, input, state};
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::space::layout::{Outputs, Parameters, States};
use trueup_numerics::driver::{
    DriveError, Driver, DriverMemory, DriverOptions, DriverState, Flow, Solver, StepInputs,
};
use trueup_numerics::hybrid::{At, Hybrid};

impl Move {
    pub(crate) fn run_dry(
        &self,
        arm: &FlexibleArm,
        control: &[f64],
        how: How,
    ) -> Result<Outcome, Box<dyn Error>> {
        let s = &arm.structure().robot;
        let (sizes, of, to) = (arm.sizes(), States::new(s), Outputs::new(s));
        let ratio = Parameters::new(s).gear_ratio;
        let controller = ManipulatorController { joints: N };
        controller.check(control).map_err(|e| e.1)?;
        let own = controller.sizes();
        let (mut cx, mut sampled) = (vec![0.0; own.states], vec![0; own.modes]);
        let begin = linearised(arm, &self.p, &self.poses[0])?;
        let from = begin.state[of.joint_angle..][..N].to_vec();
        let nominal: Vec<f64> = States::list(s).iter().flat_map(|e| vec![e.kind.nominal; e.len()]).collect();
        let options =
            DriverOptions { solver: Solver::FixedStiff, max_step: STEP, ..DriverOptions::default() };
        let mut driver = Driver::new(sizes, &nominal, options);
        let (mut t, mut x, mut u) = (0.0, begin.state.clone(), vec![0.0; sizes.inputs]);
        u[..N].copy_from_slice(&begin.drive);
        let (mut modes, mut memory) = (vec![0; sizes.modes], DriverMemory::default());
        let mut now = DriverState {
            t: &mut t,
            x: &mut x,
            u: &mut u,
            p: &self.p,
            modes: &mut modes,
            memory: &mut memory,
        };
        driver.initialise_from(arm, &mut now)?;
        let (mut y, mut sensed, mut way) = (vec![0.0; sizes.outputs], vec![0.0; own.inputs], Vec::new());
        let at_goal = equilibrium(arm, &self.p, &self.poses[1], [0.0; 3])?.state;
        let mut goal = y.clone();
        arm.outputs(At { t: 0.0, x: &at_goal, u: now.u, p: &self.p, modes: now.modes }, &mut goal);
        let mut encoders = Encoders::new(how);
        for k in 0..(TIME / STEP) as usize {
            let time = k as f64 * STEP;
            arm.outputs(At { t: time, x: now.x, u: now.u, p: &self.p, modes: now.modes }, &mut y);
            way.push([0, 1, 2].map(|i| y[to.tip_position + i] - goal[to.tip_position + i]));
            let left = 1.0 - (time / RAMP).min(1.0);
            for j in 0..N {
                sensed[input::POSITION_REFERENCE * N + j] = self.goal[j] + (from[j] - self.goal[j]) * left;
                let seen = encoders.read(
                    j,
                    [to.motor_angle, to.joint_angle].map(|row| y[row + j]),
                    [to.motor_velocity, to.joint_velocity].map(|row| y[row + j]),
                    self.p[ratio + j],
                );
                let rows =
                    [input::MOTOR_ANGLE, input::MOTOR_VELOCITY, input::LOAD_ANGLE, input::LOAD_VELOCITY];
                rows.into_iter().zip(seen).for_each(|(row, value)| sensed[row * N + j] = value);
            }
            if k == 0 {
                // States from the inputs, the first sample later; the integral holds the weight already.
                controller.start_modes(At { t: STEP, x: &cx, u: &[], p: control, modes: &[] }, &mut sampled);
                controller.update(time, &mut cx, &sensed, control, &mut sampled);
                cx[state::INTEGRAL_TORQUE * N..][..N].copy_from_slice(&begin.drive);
            }
            controller.update(time + STEP, &mut cx, &sensed, control, &mut sampled);
            now.u[..N].copy_from_slice(&cx[state::HELD_OUTPUT * N..][..N]);
            match driver.advance_to(arm, &mut now, time + STEP, StepInputs::Hold, &mut |_| Flow::Continue) {
                Ok(_) => {}
                // It has run away, far beyond what an arm can.
                Err(DriveError::NotFinite { .. }) => return Ok(Outcome::lost()),
                Err(other) => return Err(other.into()),
            }
        }
        Ok(self.outcome(&way, &cx, control, how))
    }
}
