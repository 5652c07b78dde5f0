//! A joint with dry friction, sensors with steps and a flexible link or play, with a JointController.

use super::chain::{CONTROLLER_STATES, INERTIA, PARAMETERS, with_adaptation};
use trueup_models::controller::{
    JointController, Strategy, adaptation::parameter as a, input, output, parameter,
};
use trueup_models::joint::{self, TwoMassJoint};
use trueup_numerics::driver::{Driver, DriverMemory, DriverOptions, DriverState, Flow, Solver, StepInputs};
use trueup_numerics::hybrid::{At, Hybrid};

/// Joint 2 of DELIAN: gear ratio, motor inertia, torque constant, stiffness of the spring on the motor's side.
pub(crate) const RATIO: f64 = 21750.0;
const MOTOR: f64 = 1.2e-7;
const TORQUE: f64 = 0.02;
const SPRING: f64 = 2.2e-5;
/// Steps of the sensors in rad: 0.001 deg on the load, 16 counts a turn on the motor.
pub(crate) const LOAD_STEP: f64 = 0.001 * core::f64::consts::PI / 180.0;
pub(crate) const MOTOR_STEP: f64 = core::f64::consts::TAU / 16.0;

/// Plant and controller, run together; the current is held over steps of `h`.
pub(crate) struct Bench {
    pub(crate) effects: &'static [&'static str],
    /// Parameters of the effects.
    pub(crate) with: [f64; 3],
    /// Of the load, or of the hub of a flexible link, in kg.m2.
    pub(crate) inertia: f64,
    /// Coulomb and static friction of the motor in N.m.
    pub(crate) friction: [f64; 2],
    /// Torque on the load in N.m, constant.
    pub(crate) load: f64,
    /// Sensors with steps; velocities are differences of what they show.
    pub(crate) quantised: bool,
}

pub(crate) const SMOOTH: Bench =
    Bench { effects: &[], with: [0.0; 3], inertia: 6.0, friction: [0.0; 2], load: 0.0, quantised: false };

/// What a run shows, step by step.
#[derive(Default)]
pub(crate) struct Seen {
    pub(crate) omega: Vec<f64>,
    pub(crate) active: Vec<bool>,
    pub(crate) current: Vec<f64>,
    /// Of the load, or of the tip of a flexible link, in rad.
    pub(crate) angle: Vec<f64>,
}

impl Bench {
    /// √(K/J) with the motor held, in rad/s.
    pub(crate) fn mode(&self) -> f64 {
        (RATIO * RATIO * SPRING / self.inertia).sqrt()
    }

    /// −δ under the load, in rad.
    pub(crate) fn twist(&self) -> f64 {
        self.load / (RATIO * RATIO * SPRING)
    }

    pub(crate) fn run(&self, p: &[f64; PARAMETERS], time: f64, reference: impl Fn(f64) -> f64) -> Seen {
        let h = if p[parameter::COUNT] > 0.0 { p[parameter::COUNT] } else { 1e-3 };
        let plant = TwoMassJoint::new(true, self.effects).expect("builds");
        let [coulomb, sticking] = self.friction;
        let mut pp = vec![
            MOTOR,
            self.inertia,
            RATIO,
            TORQUE,
            SPRING,
            3.18e-8,
            coulomb,
            sticking,
            2.5e-8,
            0.0,
            0.0,
            0.0,
            0.0,
        ];
        pp.extend(&self.with[..plant.sizes().parameters - pp.len()]);
        assert_eq!(JointController.check(p), Ok(()));
        let (n, flexible) = (plant.sizes(), self.effects.contains(&"flexible-link"));
        let options = DriverOptions { solver: Solver::Stiff, tolerance: 1e-7, ..DriverOptions::default() };
        let mut driver = Driver::new(n, &[], options);
        let (mut t, mut x, mut u) = (0.0, vec![0.0; n.states], vec![0.0; n.inputs]);
        u[joint::input::EXTERNAL_TORQUE] = self.load;
        let (mut modes, mut memory) = (vec![0; n.modes], DriverMemory::default());
        let mut s =
            DriverState { t: &mut t, x: &mut x, u: &mut u, p: &pp, modes: &mut modes, memory: &mut memory };
        driver.initialise(&plant, &mut s).expect("starts");
        let mut y = vec![0.0; n.outputs];
        let mut before = [0.0; input::COUNT];
        let mut control = Control::new(p);
        let mut seen = Seen::default();
        for k in 0..=(time / h).round() as usize {
            let t = k as f64 * h;
            plant.outputs(At { t, x: s.x, u: s.u, p: s.p, modes: s.modes }, &mut y);
            let sensed = |x: f64, step: f64| if self.quantised { (x / step).floor() * step } else { x };
            use joint::output as o;
            let mut measured = [
                reference(t),
                0.0,
                sensed(y[o::MOTOR_ANGLE], MOTOR_STEP),
                y[o::MOTOR_VELOCITY],
                sensed(y[o::LOAD_ANGLE], LOAD_STEP),
                y[o::LOAD_VELOCITY],
            ];
            if self.quantised {
                let rate = |i: usize| if k > 0 { (measured[i] - before[i]) / h } else { 0.0 };
                (measured[input::MOTOR_VELOCITY], measured[input::LOAD_VELOCITY]) =
                    (rate(input::MOTOR_ANGLE), rate(input::LOAD_ANGLE));
                before = measured;
            }
            let command = control.step(t, h, &measured);
            s.u[joint::input::MOTOR_CURRENT] = command[output::COMMAND];
            seen.omega.push(command[output::WAVE_FREQUENCY_USED]);
            seen.active.push(command[output::ADAPTATION_ACTIVE] != 0.0);
            seen.current.push(command[output::COMMAND]);
            seen.angle.push(if flexible { s.x[joint::output::STATES.len()] } else { y[o::LOAD_ANGLE] });
            driver
                .advance_to(&plant, &mut s, t + h, StepInputs::Hold, &mut |_| Flow::Continue)
                .expect("goes on");
        }
        seen
    }
}

/// A JointController with a plant: sampled, or continuous by the classical Runge-Kutta method with inputs that
/// go on as they went over the last step.
pub(crate) struct Control {
    p: [f64; PARAMETERS],
    pub(crate) x: [f64; CONTROLLER_STATES],
    modes: [i32; 5],
    last: Option<[f64; input::COUNT]>,
}

impl Control {
    pub(crate) fn new(p: &[f64; PARAMETERS]) -> Self {
        let mut modes = [0; 5];
        let x = [0.0; CONTROLLER_STATES];
        JointController.start_modes(At { t: 0.0, x: &x, u: &[], p, modes: &[] }, &mut modes);
        Self { p: *p, x, modes, last: None }
    }

    /// Outputs at `t`; the states go on to t + h.
    pub(crate) fn step(&mut self, t: f64, h: f64, u: &[f64; input::COUNT]) -> [f64; output::COUNT] {
        for pass in 0.. {
            assert!(pass < 5, "the event iteration does not settle");
            if JointController.update(t, &mut self.x, u, &self.p, &mut self.modes).settled() {
                break;
            }
        }
        let mut y = [0.0; output::COUNT];
        JointController.outputs(At { t, x: &self.x, u, p: &self.p, modes: &self.modes }, &mut y);
        if self.p[parameter::COUNT] == 0.0 {
            let last = self.last.replace(*u).unwrap_or(*u);
            let rates = |x: &[f64; CONTROLLER_STATES], share: f64| {
                let u: [f64; input::COUNT] = core::array::from_fn(|i| u[i] + share * (u[i] - last[i]));
                let mut dx = [0.0; CONTROLLER_STATES];
                let at = At { t: t + share * h, x, u: &u, p: &self.p, modes: &self.modes };
                JointController.rates(at, &mut dx);
                dx
            };
            let x = self.x;
            let moved = |k: &[f64; CONTROLLER_STATES], c: f64| core::array::from_fn(|i| x[i] + c * h * k[i]);
            let k1 = rates(&x, 0.0);
            let k2 = rates(&moved(&k1, 0.5), 0.5);
            let k3 = rates(&moved(&k2, 0.5), 0.5);
            let k4 = rates(&moved(&k3, 1.0), 1.0);
            self.x = core::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        y
    }
}

/// A controller of joint 2, K_p = 2.
pub(crate) fn controller(strategy: Strategy, omega: f64, h: f64, rate: f64) -> [f64; PARAMETERS] {
    let velocity_gain = INERTIA[0] * 60.0;
    let strategy = f64::from(strategy as u8);
    let mut p = with_adaptation([2.0, velocity_gain, 0.1, RATIO, TORQUE, 0.25, omega, 1.0, h, strategy]);
    p[a::first(1) + a::RATE] = rate;
    (p[a::first(1) + a::MIN], p[a::first(1) + a::MAX]) = (5.0, 400.0);
    p
}
