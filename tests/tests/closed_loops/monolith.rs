//! Plant and controller as one hybrid system, integrated by one solver: what a co-simulation of both should give.

use trueup_models::arm::{self, PlanarManipulator};
use trueup_models::controller::{self, JointController, ManipulatorController, Strategy};
use trueup_models::joint::{self, TwoMassJoint};
use trueup_models::presets;
use trueup_numerics::Scalar;
use trueup_numerics::driver::{DriverOptions, SimulationRecord, simulate};
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// A plant whose fed back outputs are functions of its states alone, and its controller. States, parameters, modes and
/// outputs: those of the plant, then those of the controller; inputs: those of the controller (references).
struct Loop<P, C> {
    plant: P,
    controller: C,
    /// Output of the plant, input of the controller.
    back: Vec<(usize, usize)>,
    /// Output of the controller, input of the plant.
    forth: Vec<(usize, usize)>,
}

/// The signals of both at one instant.
struct Signals<T> {
    plant_in: Vec<T>,
    controller_in: Vec<T>,
}

impl<P: Hybrid, C: Hybrid> Loop<P, C> {
    fn split<'a, T: Scalar>(&self, at: &At<'a, T>) -> (At<'a, T>, At<'a, T>) {
        let n = self.plant.sizes();
        let (x, p, modes) =
            (at.x.split_at(n.states), at.p.split_at(n.parameters), at.modes.split_at(n.modes));
        (At { x: x.0, p: p.0, modes: modes.0, ..*at }, At { x: x.1, p: p.1, modes: modes.1, ..*at })
    }

    fn signals<T: Scalar>(&self, at: &At<T>) -> Signals<T> {
        let (plant, controller) = self.split(at);
        let (n, m) = (self.plant.sizes(), self.controller.sizes());
        let (mut y, mut c) = (vec![T::zero(); n.outputs], vec![T::zero(); m.outputs]);
        let (mut plant_in, mut controller_in) = (vec![T::zero(); n.inputs], at.u.to_vec());
        self.plant.outputs(At { u: &plant_in, ..plant }, &mut y);
        self.back.iter().for_each(|(from, to)| controller_in[*to] = y[*from]);
        self.controller.outputs(At { u: &controller_in, ..controller }, &mut c);
        self.forth.iter().for_each(|(from, to)| plant_in[*to] = c[*from]);
        Signals { plant_in, controller_in }
    }

    /// Both with their inputs, one after the other.
    fn both<T: Scalar>(
        &self,
        at: &At<T>,
        out: &mut [T],
        length: impl Fn(ModelSizes) -> usize,
        plant: impl Fn(&P, At<T>, &mut [T]),
        controller: impl Fn(&C, At<T>, &mut [T]),
    ) {
        let (s, (a, b)) = (self.signals(at), self.split(at));
        let (first, second) = out.split_at_mut(length(self.plant.sizes()));
        plant(&self.plant, At { u: &s.plant_in, ..a }, first);
        controller(&self.controller, At { u: &s.controller_in, ..b }, second);
    }
}

impl<P: Hybrid, C: Hybrid> Hybrid for Loop<P, C> {
    fn sizes(&self) -> ModelSizes {
        let (a, b) = (self.plant.sizes(), self.controller.sizes());
        ModelSizes {
            states: a.states + b.states,
            inputs: b.inputs,
            parameters: a.parameters + b.parameters,
            outputs: a.outputs + b.outputs,
            modes: a.modes + b.modes,
            indicators: a.indicators + b.indicators,
        }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        let n = self.plant.sizes();
        let ((p, q), (x, z)) = (p.split_at(n.parameters), x.split_at_mut(n.states));
        self.plant.start(p, x);
        self.controller.start(q, z);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        let (s, (a, b)) = (self.signals(&at), self.split(&at));
        let (first, second) = modes.split_at_mut(self.plant.sizes().modes);
        self.plant.start_modes(At { u: &s.plant_in, ..a }, first);
        self.controller.start_modes(At { u: &s.controller_in, ..b }, second);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.both(&at, dx, |n| n.states, |m, at, out| m.rates(at, out), |m, at, out| m.rates(at, out));
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        self.both(&at, y, |n| n.outputs, |m, at, out| m.outputs(at, out), |m, at, out| m.outputs(at, out));
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        let (plant, controller) = (P::indicators, C::indicators);
        self.both(&at, z, |n| n.indicators, plant, controller);
    }
    fn direction(&self, indicator: usize) -> Direction {
        let n = self.plant.sizes().indicators;
        if indicator < n { self.plant.direction(indicator) } else { self.controller.direction(indicator - n) }
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let s = self.signals(&At { t, x, u, p, modes });
        let n = self.plant.sizes();
        let ((x, z), (p, q)) = (x.split_at_mut(n.states), p.split_at(n.parameters));
        let (first, second) = modes.split_at_mut(n.modes);
        let a = self.plant.update(t, x, &s.plant_in, p, first);
        let b = self.controller.update(t, z, &s.controller_in, q, second);
        EventUpdate { modes: a.modes || b.modes, states: a.states || b.states }
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        let n = self.plant.sizes();
        let ((p, q), (a, b)) = (p.split_at(n.parameters), modes.split_at(n.modes));
        let both = [self.plant.next_event(p, a), self.controller.next_event(q, b)];
        both.into_iter().flatten().reduce(f64::min)
    }
}

/// Outputs at the requested times.
fn run<P: Hybrid, C: Hybrid>(
    model: &Loop<P, C>,
    p: &[f64],
    reference: &[(usize, f64)],
    times: &[f64],
) -> SimulationRecord {
    let options = DriverOptions { tolerance: 1e-12, max_step: 1e-3, ..DriverOptions::default() };
    let inputs = |_: f64, u: &mut [f64]| {
        u.fill(0.0);
        reference.iter().for_each(|(i, value)| u[*i] = *value);
    };
    let nominal = vec![1e-2; model.sizes().states];
    simulate(model, p, &nominal, options, &inputs, times).expect("the monolithic solution")
}

/// Load angle of DELIAN's joint 1 without dry friction, under P/PI and with no limit of the current; the parameters
/// are those that `loops.rs` gives to the FMUs.
pub(crate) fn joint(reference: f64, times: &[f64]) -> Vec<f64> {
    joint_under(Strategy::PPi, 1e3, false, reference, times)
}

/// Load angle of DELIAN's joint 1 as in `examples/01-joint/joint.toml`: dry friction, VWBC, and a current at its limit at first.
#[allow(dead_code, reason = "the benchmark draws smooth loops only")]
pub(crate) fn limited_joint(reference: f64, times: &[f64]) -> Vec<f64> {
    joint_under(Strategy::Vwbc, 0.25, true, reference, times)
}

fn joint_under(strategy: Strategy, limit: f64, friction: bool, reference: f64, times: &[f64]) -> Vec<f64> {
    use joint::{input as i, output as o, parameter as p};
    let plant = TwoMassJoint::new::<&str>(true, &[]).expect("a joint");
    let mut values = presets::delian(1).expect("joint 1").to_vec();
    if !friction {
        values[p::COULOMB_FRICTION] = 0.0;
        values[p::STATIC_FRICTION] = 0.0;
    }
    let n = values[p::GEAR_RATIO];
    values.extend([2.5, 7.2e-6 * n * n, 0.1, n, 0.02, limit, 41.648, 1.0, 0.0, strategy as u8 as f64]);
    // No strategy here adapts.
    values.extend(
        [0.0; controller::adaptation::parameter::end(1) - controller::adaptation::parameter::first(1)],
    );
    use controller::input as c;
    let back = vec![
        (o::MOTOR_ANGLE, c::MOTOR_ANGLE),
        (o::MOTOR_VELOCITY, c::MOTOR_VELOCITY),
        (o::LOAD_ANGLE, c::LOAD_ANGLE),
        (o::LOAD_VELOCITY, c::LOAD_VELOCITY),
    ];
    let model = Loop { plant, controller: JointController, back, forth: vec![(0, i::MOTOR_CURRENT)] };
    let run = run(&model, &values, &[(c::POSITION_REFERENCE, reference)], times);
    run.y.iter().map(|y| y[o::LOAD_ANGLE]).collect()
}

/// Angle of joint 1 of the free-floating test-bed under P/PI.
pub(crate) fn arm(reference: f64, times: &[f64]) -> Vec<f64> {
    use arm::{input as i, output as o};
    let (links, flexible) = (3, [true, false, false]);
    let plant = PlanarManipulator::new::<&str>(&flexible, &[]).expect("an arm");
    let mut values = plant.defaults();
    let gains = [
        [0.1, 0.5, 0.5],
        [56.0, 5.8, 1.0],
        [1.0; 3],
        [1.0; 3],
        [1.0; 3],
        [1e3; 3],
        [1.494, 10.0, 10.0],
        [0.05, 0.1, 0.1],
    ];
    values.extend(gains.concat());
    values.extend([0.0, Strategy::PPi as u8 as f64]);
    values.resize(
        values.len() + controller::adaptation::parameter::end(links)
            - controller::adaptation::parameter::first(links),
        0.0,
    );
    use controller::input as c;
    let back = [
        (o::motor_angle(links), c::MOTOR_ANGLE),
        (o::motor_velocity(links), c::MOTOR_VELOCITY),
        (o::joint_angle(links), c::LOAD_ANGLE),
        (o::joint_velocity(links), c::LOAD_VELOCITY),
    ];
    let back =
        back.iter().flat_map(|(from, to)| (0..links).map(move |j| (from + j, to * links + j))).collect();
    let forth = (0..links).map(|j| (j, i::joint_torque(links) + j)).collect();
    let model = Loop { plant, controller: ManipulatorController { joints: links }, back, forth };
    let run = run(&model, &values, &[(c::POSITION_REFERENCE * links, reference)], times);
    run.y.iter().map(|y| y[o::joint_angle(links)]).collect()
}
