//! `SpatialFreeFlyer` as a model: what its tests share.

mod analysis;
mod balances;
mod limits;
mod runs;
mod tables;

use trueup_models::space::design::{DesignMotor, DesignTip, RobotDesign, Thruster};
use trueup_models::space::layout::{Inputs, Outputs, Parameters, States};
use trueup_models::space::{SpatialFreeFlyer, presets};
use trueup_numerics::Dual;
use trueup_numerics::hybrid::{At, Hybrid};

pub(crate) use balances::lost;

use crate::arm_common::Random;

/// A model with the places and the values of its variables.
pub(crate) struct Flyer {
    pub(crate) model: SpatialFreeFlyer,
    pub(crate) at: States,
    pub(crate) input: Inputs,
    pub(crate) output: Outputs,
    pub(crate) parameter: Parameters,
    pub(crate) p: Vec<f64>,
}

impl Flyer {
    pub(crate) fn of(design: &RobotDesign) -> Self {
        let s = design.structure();
        let model = SpatialFreeFlyer::new(s.clone()).unwrap();
        let p = design.parameters();
        model.check(&p).unwrap();
        Self {
            at: States::new(&s),
            input: Inputs::new(&s),
            output: Outputs::new(&s),
            parameter: Parameters::new(&s),
            model,
            p,
        }
    }
    pub(crate) fn start(&mut self, begin: usize, values: &[f64]) {
        self.p[begin..][..values.len()].copy_from_slice(values);
    }
    pub(crate) fn now<'a>(&'a self, x: &'a [f64], u: &'a [f64]) -> At<'a, f64> {
        At { t: 0.0, x, u, p: &self.p, modes: &[] }
    }
    pub(crate) fn rates(&self, x: &[f64], u: &[f64]) -> Vec<f64> {
        let mut dx = vec![0.0; x.len()];
        self.model.rates(self.now(x, u), &mut dx);
        dx
    }
    pub(crate) fn outputs(&self, x: &[f64], u: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.output.count];
        self.model.outputs(self.now(x, u), &mut y);
        y
    }
    /// Outputs and their rates of change, the inputs held.
    pub(crate) fn moving(&self, x: &[f64], u: &[f64]) -> (Vec<f64>, Vec<f64>) {
        self.along(x, &self.rates(x, u), u)
    }
    /// Outputs and how they change with the states along `slope`.
    pub(crate) fn along(&self, x: &[f64], slope: &[f64], u: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let along = |v: &[f64], slope: &[f64]| -> Vec<Dual<1>> {
            v.iter().zip(slope).map(|(re, e)| Dual { re: *re, eps: [*e] }).collect()
        };
        let zeros = vec![0.0; self.p.len().max(u.len())];
        let (x, u, p) = (along(x, slope), along(u, &zeros), along(&self.p, &zeros));
        let mut y = vec![Dual { re: 0.0, eps: [0.0] }; self.output.count];
        self.model.outputs(At { t: Dual { re: 0.0, eps: [0.0] }, x: &x, u: &u, p: &p, modes: &[] }, &mut y);
        (y.iter().map(|y| y.re).collect(), y.iter().map(|y| y.eps[0]).collect())
    }
    /// A state in which everything moves, and inputs.
    pub(crate) fn anywhere(&self, random: &mut Random) -> (Vec<f64>, Vec<f64>) {
        let mut x = random.vector(self.at.count, 1.0);
        if !self.model.structure().held {
            // Its length does not matter.
            x[self.at.base_quaternion] += 2.0;
        }
        (x, random.vector(self.input.count, 3.0))
    }
}

pub(crate) fn three(v: &[f64], at: usize) -> [f64; 3] {
    [v[at], v[at + 1], v[at + 2]]
}
pub(crate) fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

pub(crate) const ANGLES: [f64; 6] = [0.3, -0.9, 1.4, 0.2, -0.6, 0.5];

/// Everything at once: two arms, a prismatic joint, springs, rotors, thrusters.
pub(crate) fn everything(held: bool, geared: bool) -> RobotDesign {
    let mut d = RobotDesign { thrusters: Vec::new(), ..presets::chaser() };
    for (k, position) in [[0.5, 0.4, -0.3], [-0.6, 0.2, 0.1], [0.0, -0.7, 0.2]].into_iter().enumerate() {
        let direction = [[1.0, 0.0, 2.0], [0.0, -1.0, 0.5], [0.3, 0.3, -1.0]][k];
        d.thrusters.push(Thruster { position, direction });
    }
    for k in 0..3 {
        let mut link = d.links[k].clone();
        link.parent = if k == 0 { 0 } else { 6 + k };
        link.position[1] -= 0.4;
        d.links.push(link);
    }
    d.links[7].joint = trueup_models::space::tree::JointType::Prismatic;
    d.links[7].orientation = [0.8, 0.0, 0.6, 0.0];
    d.tips.push(DesignTip { name: "other".into(), body: 9, offset: [0.1, 0.2, -0.3], mount: [0.0; 3] });
    for (k, link) in d.links.iter_mut().enumerate() {
        let flexible = k % 2 == 1;
        let gear_ratio = 3.0 + k as f64;
        link.motor = DesignMotor { flexible, inertia: 0.3, gear_ratio, stiffness: 20.0, damping: 2.0 };
    }
    let mut panels = presets::table_1_with_panels().appendages;
    panels[1].shapes.y = 3;
    panels[1].orientation = [0.6, 0.0, 0.8, 0.0];
    RobotDesign { held, geared, appendages: panels, ..d }
}
