//! A robot with effects for tests: its values, states and readings.

use trueup_models::space::SpatialFreeFlyer;
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::{
    FrictionOutputs, FrictionParameters, Inputs, Outputs, Parameters, States,
};
use trueup_numerics::Dual;
use trueup_numerics::hybrid::{At, Hybrid};

use super::flyer::{Flyer, everything, lost};
use crate::arm_common::Random;

/// A robot with effects, its values, and where they are.
pub(crate) struct Affected {
    pub(crate) model: SpatialFreeFlyer,
    pub(crate) p: Vec<f64>,
    pub(crate) at: States,
    pub(crate) input: Inputs,
    pub(crate) output: Outputs,
    pub(crate) parameter: Parameters,
}

impl Affected {
    pub(crate) fn of(design: &RobotDesign, ids: &[&str]) -> Self {
        let model = SpatialFreeFlyer::with_effects(design.structure(), ids).unwrap();
        let p = [design.parameters(), model.effect_defaults()].concat();
        assert_eq!(p.len(), model.sizes().parameters);
        let s = model.structure();
        let (at, input) = (States::new(s), Inputs::new(s));
        Self { output: Outputs::new(s), parameter: Parameters::new(s), at, input, p, model }
    }
    pub(crate) fn joints(&self) -> usize {
        self.model.structure().bodies()
    }
    pub(crate) fn friction(&self) -> (FrictionParameters, FrictionOutputs) {
        let n = self.joints();
        (
            FrictionParameters::new(&n).behind(self.parameter.count),
            FrictionOutputs::new(&n).behind(self.output.count),
        )
    }
    /// Gives a parameter of an effect these values, from its first element on.
    pub(crate) fn set(&mut self, id: &str, name: &str, values: &[f64]) {
        let e = self.model.effects().iter().find(|e| e.choice.id() == id).unwrap();
        let k = e.choice.parameters().iter().position(|s| s.name == name).unwrap();
        let begin = e.begin.parameters + k * e.sites;
        self.p[begin..begin + values.len()].copy_from_slice(values);
    }
    /// Begin of an effect's states.
    pub(crate) fn states(&self, id: &str) -> usize {
        self.model.effects().iter().find(|e| e.choice.id() == id).unwrap().begin.states
    }
    /// A state in which everything moves, and torques of the joints.
    pub(crate) fn anywhere(&self, random: &mut Random) -> (Vec<f64>, Vec<f64>) {
        let mut x = random.vector(self.model.sizes().states, 1.0);
        x[self.at.base_quaternion] += 2.0;
        let mut u = vec![0.0; self.model.sizes().inputs];
        u[self.input.joint_torque..][..self.joints()].copy_from_slice(&random.vector(self.joints(), 3.0));
        (x, u)
    }
    /// The modes that fit.
    pub(crate) fn modes(&self, t: f64, x: &[f64], u: &[f64]) -> Vec<i32> {
        let (mut x, mut modes) = (x.to_vec(), vec![0; self.model.sizes().modes]);
        self.model.start_modes(At { t, x: &x, u, p: &self.p, modes: &[] }, &mut modes);
        let before = x.clone();
        while !self.model.update(t, &mut x, u, &self.p, &mut modes).settled() {}
        assert_eq!(x, before);
        modes
    }
    pub(crate) fn rates(&self, t: f64, x: &[f64], u: &[f64], modes: &[i32]) -> Vec<f64> {
        let mut dx = vec![0.0; x.len()];
        self.model.rates(At { t, x, u, p: &self.p, modes }, &mut dx);
        dx
    }
    pub(crate) fn outputs(&self, t: f64, x: &[f64], u: &[f64], modes: &[i32]) -> Vec<f64> {
        let mut y = vec![0.0; self.model.sizes().outputs];
        self.model.outputs(At { t, x, u, p: &self.p, modes }, &mut y);
        y
    }
    /// Outputs and their rates of change, the inputs held.
    pub(crate) fn moving(&self, t: f64, x: &[f64], u: &[f64], modes: &[i32]) -> (Vec<f64>, Vec<f64>) {
        let slope = self.rates(t, x, u, modes);
        let held = |v: &[f64]| v.iter().map(|re| Dual { re: *re, eps: [0.0] }).collect::<Vec<Dual<1>>>();
        let x: Vec<Dual<1>> = x.iter().zip(&slope).map(|(re, e)| Dual { re: *re, eps: [*e] }).collect();
        let (u, p) = (held(u), held(&self.p));
        let mut y = held(&vec![0.0; self.model.sizes().outputs]);
        self.model.outputs(At { t: Dual { re: t, eps: [1.0] }, x: &x, u: &u, p: &p, modes }, &mut y);
        (y.iter().map(|y| y.re).collect(), y.iter().map(|y| y.eps[0]).collect())
    }
    /// Power of the joints' torques less what springs' dampers, panels and friction take, W.
    pub(crate) fn power(&self, y: &[f64], u: &[f64]) -> f64 {
        let plain = Flyer::of(&everything(false, true));
        let o = &self.output;
        let mut power = -lost(&plain, y);
        for j in 0..self.joints() {
            let (motor, joint) = (y[o.motor_velocity + j], y[o.joint_velocity + j]);
            power += u[self.input.joint_torque + j] * motor;
            power -= self.p[self.parameter.joint_damping + j] * (motor - joint) * (motor - joint);
            if self.model.sizes().outputs > o.count {
                power -= y[self.friction().1.torque + j] * motor;
            }
        }
        power
    }
}
