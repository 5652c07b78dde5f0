//! `SpaceController`: rates by the generalized Jacobian, straight lines of the hand, singularities, limits.

mod contact;
mod loops;
mod pulses;
mod rates;
mod vibration;

use super::flyer::Flyer;
use trueup_models::space::SpatialFreeFlyer;
use trueup_models::space::control::SpaceController;
use trueup_models::space::control::layout::{Inputs, Outputs, Parameters, States};
use trueup_models::space::design::RobotDesign;
use trueup_numerics::hybrid::{At, Hybrid};

/// A controller with the places and the values of its variables.
pub(crate) struct Controlled {
    pub(crate) model: SpaceController,
    pub(crate) own: Parameters,
    pub(crate) input: Inputs,
    pub(crate) output: Outputs,
    pub(crate) state: States,
    pub(crate) p: Vec<f64>,
}

impl Controlled {
    pub(crate) fn of(design: &RobotDesign) -> Self {
        let model = SpaceController::new(design.structure()).unwrap();
        let s = model.structure().clone();
        let p = model.parameters(design);
        model.check(&p).unwrap();
        let robot: usize = model.robot_parameters().iter().map(|e| e.len()).sum();
        let own = Parameters::new(&s).behind(robot);
        assert_eq!(own.count, p.len());
        Self { own, input: Inputs::new(&s), output: Outputs::new(&s), state: States::new(&s), model, p }
    }
    pub(crate) fn outputs(&self, x: &[f64], u: &[f64], modes: &[i32]) -> Vec<f64> {
        let mut y = vec![0.0; self.output.count];
        self.model.outputs(At { t: 0.0, x, u, p: &self.p, modes }, &mut y);
        y
    }
    /// Inputs at rest with zero references.
    pub(crate) fn inputs(&self) -> Vec<f64> {
        let mut u = vec![0.0; self.input.count];
        if !self.model.structure().held {
            u[self.input.base_quaternion] = 1.0;
        }
        u
    }
    /// Puts what `plant` measures at `x` where it belongs.
    pub(crate) fn measure(&self, plant: &Flyer, x: &[f64], u: &mut [f64]) {
        let n = self.model.structure().bodies();
        let mut copy = |from: usize, to: usize, count: usize| {
            u[to..][..count].copy_from_slice(&x[from..][..count]);
        };
        copy(plant.at.joint_angle, self.input.joint_angle, n);
        copy(plant.at.joint_velocity, self.input.joint_velocity, n);
        if !self.model.structure().held {
            copy(plant.at.base_quaternion, self.input.base_quaternion, 4);
            copy(plant.at.base_velocity, self.input.base_velocity, 3);
            copy(plant.at.base_angular_velocity, self.input.base_angular_velocity, 3);
            let s = self.model.structure();
            copy(plant.at.modal_coordinate, self.input.modal_coordinate, s.modes() - s.linked());
        }
    }
}

/// What a run leaves at every sample: time, outputs of the plant, outputs of the controller.
pub(crate) type RunSample = (f64, Vec<f64>, Vec<f64>);

/// Runs plant and controller, sampled every `period` s, the plant in steps of that by Runge and Kutta's method of fourth order.
pub(crate) fn run(
    plant: &mut Flyer,
    control: &mut Controlled,
    times: (f64, f64),
    refer: impl FnMut(f64, &mut [f64]),
) -> Vec<RunSample> {
    run_with(plant, control, times, refer, None)
}

/// The same, with more inputs of the plant by time and its outputs.
pub(crate) fn run_with(
    plant: &mut Flyer,
    control: &mut Controlled,
    (stop, period): (f64, f64),
    mut refer: impl FnMut(f64, &mut [f64]),
    act: Option<&dyn Fn(f64, &[f64], &mut [f64])>,
) -> Vec<RunSample> {
    control.p[control.own.sample_period] = period;
    control.model.check(&control.p).unwrap();
    let mut x = vec![0.0; plant.at.count];
    SpatialFreeFlyer::start(&plant.model, &plant.p, &mut x);
    let mut u = vec![0.0; plant.input.count];
    let (mut memory, mut modes) = (vec![0.0; control.state.count], vec![0; 2]);
    let mut said = control.inputs();
    let mut rows = Vec::new();
    let steps = (stop / period).round() as usize;
    for k in 0..=steps {
        let t = k as f64 * period;
        control.measure(plant, &x, &mut said);
        refer(t, &mut said);
        let y = control.outputs(&memory, &said, &[0, k as i32]);
        control.model.update(t, &mut memory, &said, &control.p, &mut modes);
        let (n, held) = (control.model.structure().bodies(), control.model.structure().held);
        u[plant.input.joint_torque..][..n].copy_from_slice(&y[control.output.joint_torque..][..n]);
        if !held {
            u[plant.input.base_torque..][..3].copy_from_slice(&y[control.output.base_torque..][..3]);
            let k = control.model.structure().thrusters;
            u[plant.input.thruster_force..][..k].copy_from_slice(&y[control.output.thruster_force..][..k]);
        }
        rows.push((t, plant.outputs(&x, &u), y));
        let at =
            |x: &[f64], k: &[f64], h: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + h * k).collect() };
        let rates = |t: f64, x: &[f64]| {
            let mut u = u.clone();
            if let Some(act) = act {
                act(t, &plant.outputs(x, &u), &mut u);
            }
            plant.rates(x, &u)
        };
        let half = period / 2.0;
        let a = rates(t, &x);
        let b = rates(t + half, &at(&x, &a, half));
        let c = rates(t + half, &at(&x, &b, half));
        let d = rates(t + period, &at(&x, &c, period));
        for i in 0..x.len() {
            x[i] += period / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
    }
    rows
}
