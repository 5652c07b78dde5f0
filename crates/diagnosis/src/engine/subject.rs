//! The plant under diagnosis: its structure, with any effects, and where a named value lies in it.

use std::collections::BTreeSet;

use trueup_identification::plant::{Plant, followers};
use trueup_models::arm::{self, PlanarManipulator};
use trueup_models::effect::{self, Choice, EffectSet, Role, Scope};
use trueup_models::joint::{self, TwoMassJoint};
use trueup_models::presets;
use trueup_numerics::Scalar;
use trueup_numerics::delegate_hybrid;
use trueup_numerics::hybrid::{At, Hybrid};

/// One of the plants, with effects.
#[derive(Clone, Debug)]
pub enum Model {
    /// TwoMassJoint.
    Joint(TwoMassJoint),
    /// PlanarManipulator.
    Arm(PlanarManipulator),
}

delegate_hybrid!(Model {
    Model::Joint(m) => m,
    Model::Arm(m) => m,
});

impl Plant for Model {
    fn affine(&self) -> bool {
        match self {
            Self::Joint(m) => m.affine(),
            Self::Arm(_) => false,
        }
    }
    fn followers(&self) -> Vec<usize> {
        followers(self.effects())
    }
    fn rest<T: Scalar>(&self, p: &mut [T], u: &[T]) {
        if let Self::Joint(m) = self {
            m.rest(p, u);
        }
    }
}

impl Model {
    /// Rates of the states where these rows of an arm's equations have accelerations that are given, whatever force that takes.
    /// The motor and load of a joint feel each other by the spring alone.
    pub fn rates_led<T: Scalar>(&self, at: At<T>, led: &[(usize, T)], dx: &mut [T]) {
        match self {
            Self::Joint(m) => m.rates(at, dx),
            Self::Arm(m) => m.rates_led(at, led, dx),
        }
    }
    /// The row of an arm's equations whose acceleration changes this state.
    pub fn row_of(&self, velocity: usize) -> Option<usize> {
        match self {
            Self::Joint(_) => None,
            Self::Arm(m) => velocity.checked_sub(m.dofs()).filter(|row| *row < m.dofs()),
        }
    }
    /// Its effects.
    pub fn effects(&self) -> &EffectSet {
        match self {
            Self::Joint(m) => m.effects(),
            Self::Arm(m) => m.effects(),
        }
    }
}

/// The plant as its owner declares it.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// Which plant.
    pub plant: effect::Plant,
    /// Which joints have a spring.
    pub flexible: Vec<bool>,
    /// An arm's base stays where it begins.
    pub fixed_base: bool,
    /// Which link of an arm carries a body more, from 0.
    pub payload: Option<usize>,
    /// Ids of the effects that are there for certain: every model of it has them.
    pub known: Vec<String>,
}

/// A value's name and unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    /// FMU variable, an element with its index.
    pub name: String,
    /// Its unit.
    pub unit: String,
}

fn arm_unit(name: &str) -> &'static str {
    match name {
        "baseMass" | "linkMass" => "kg",
        "baseInertia" | "linkInertia" | "motorInertia" => "kg.m2",
        "mountPosition" | "linkLength" | "linkCenterOfMass" | "initialBasePosition" => "m",
        "jointStiffness" => "N.m/rad",
        "jointDamping" | "viscousFriction" => "N.m.s/rad",
        "coulombFriction" | "staticFriction" => "N.m",
        "initialBaseVelocity" => "m/s",
        n if n.starts_with("initial") && (n.ends_with("Rate") || n.ends_with("Velocity")) => "rad/s",
        n if n.starts_with("initial") => "rad",
        "gravity" => "m/s2",
        _ => "1",
    }
}

/// Elements of a vector or, for centres of mass, of a matrix with two columns.
fn elements(name: &str, length: usize, vector: bool) -> Vec<String> {
    match name {
        "linkCenterOfMass" => (0..length).map(|i| format!("{name}[{},{}]", i / 2 + 1, i % 2 + 1)).collect(),
        _ if vector => (1..=length).map(|i| format!("{name}[{i}]")).collect(),
        _ => vec![name.to_owned()],
    }
}

const ARM_SCALARS: &[&str] = &[
    "baseMass",
    "baseInertia",
    "initialBaseAttitude",
    "initialBaseRate",
    "motorCoupling",
    "baseTorque",
    "tipTorque",
    "baseAttitude",
    "baseRate",
    "tipAttitude",
    "tipRate",
    "angularMomentum",
    "kineticEnergy",
    "potentialEnergy",
];

/// A name and its number of elements for so many links.
type Length = (&'static str, fn(usize) -> usize);

fn arm_names(list: &[Length], n: usize) -> Vec<String> {
    list.iter().flat_map(|(name, length)| elements(name, length(n), !ARM_SCALARS.contains(name))).collect()
}

impl Subject {
    /// On a base that floats, nothing but its joints known.
    pub fn new(plant: effect::Plant, flexible: Vec<bool>) -> Self {
        Self { plant, flexible, fixed_base: false, payload: None, known: Vec::new() }
    }
    /// With these effects (ids, places behind a colon) beside those that are known.
    ///
    /// # Errors
    /// An effect that this plant cannot have.
    pub fn model<S: AsRef<str>>(&self, effects: &[S]) -> Result<Model, String> {
        let effects = self.with_known(effects.iter().map(|e| e.as_ref().to_owned()));
        match self.plant {
            effect::Plant::Joint => {
                TwoMassJoint::new(self.flexible[0], &effects).map(Model::Joint).map_err(|e| e.to_string())
            }
            effect::Plant::Arm => {
                let arm = PlanarManipulator::on_base(self.fixed_base, &self.flexible, &effects);
                Ok(Model::Arm(arm.map_err(|e| e.to_string())?.with_payload(self.payload)))
            }
        }
    }
    /// Effects and those that are known, each once, in the order of their names.
    pub fn with_known(&self, effects: impl IntoIterator<Item = String>) -> Vec<String> {
        effects.into_iter().chain(self.known.iter().cloned()).collect::<BTreeSet<_>>().into_iter().collect()
    }
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.flexible.len()
    }
    /// Inputs in their order, those of effects that are known to be there behind.
    pub fn inputs(&self) -> Vec<String> {
        let mut all = match self.plant {
            effect::Plant::Joint => joint::input::NAMES.map(|n| n.0.to_owned()).to_vec(),
            effect::Plant::Arm => arm_names(arm::input::NAMES, self.joints()),
        };
        let vector = self.plant == effect::Plant::Arm;
        for e in self.nominal_effects().iter().flat_map(EffectSet::iter) {
            let own = e.spec().inputs.iter();
            all.extend(own.flat_map(|u| elements(u.name_in(self.plant), e.sites, vector)));
        }
        all
    }
    fn nominal_effects(&self) -> Option<EffectSet> {
        self.model(&[] as &[&str]).ok().map(|m| m.effects().clone())
    }
    /// The input that commands the motor of a joint.
    pub fn motor_input(&self, site: usize) -> usize {
        match self.plant {
            effect::Plant::Joint => joint::input::MOTOR_CURRENT,
            effect::Plant::Arm => arm::input::joint_torque(self.joints()) + site,
        }
    }
    /// The input that is the reference of a joint's servo, if it has one.
    pub fn servo(&self, site: usize) -> Option<usize> {
        self.nominal_effects()?.servo().map(|e| e.begin.inputs + site)
    }
    /// The inputs by which a joint is driven.
    pub fn drives(&self, site: usize) -> impl Iterator<Item = usize> {
        [Some(self.motor_input(site)), self.servo(site)].into_iter().flatten()
    }
    /// Outputs in their order (those of the plant without effects).
    pub fn outputs(&self) -> Vec<String> {
        match self.plant {
            effect::Plant::Joint => joint::output::NAMES.map(|n| n.0.to_owned()).to_vec(),
            effect::Plant::Arm => arm_names(arm::output::NAMES, self.joints()),
        }
    }
    /// All parameters of a model in their order.
    pub fn parameters(&self, model: &Model) -> Vec<Named> {
        let mut all: Vec<Named> = match model {
            Model::Joint(_) => joint::parameter::NAMES
                .iter()
                .map(|(name, unit)| Named { name: (*name).into(), unit: (*unit).into() })
                .collect(),
            Model::Arm(m) => {
                let mut list = arm::parameter::NAMES.to_vec();
                if m.has_friction() {
                    for name in ["coulombFriction", "staticFriction", "viscousFriction"] {
                        list.push((name, |n| n));
                    }
                }
                list.iter()
                    .flat_map(|(name, length)| {
                        let names =
                            elements(name, length(self.joints()), !ARM_SCALARS.contains(name)).into_iter();
                        names.map(|n| Named { name: n, unit: arm_unit(name).into() })
                    })
                    .collect()
            }
        };
        for e in model.effects().iter() {
            let scope = e.choice.scope();
            let vector = self.plant == effect::Plant::Arm && scope == Scope::Joint
                || scope == Scope::Channel && e.sites > 1;
            for spec in e.choice.parameters() {
                let unit = e.choice.unit(spec.unit);
                let names = elements(&e.choice.variable(spec.name), e.sites, vector);
                all.extend(names.into_iter().map(|name| Named { name, unit: unit.into() }));
            }
        }
        if self.payload.is_some() {
            all.extend(arm::PAYLOAD.iter().map(|p| Named { name: p.name.into(), unit: p.unit.into() }));
        }
        all
    }
    /// Values to begin with: those of the preset; effects are neutral.
    pub fn defaults(&self, model: &Model) -> Vec<f64> {
        let mut p = match model {
            Model::Joint(_) => presets::delian(1).map_or_else(Vec::new, |p| p.to_vec()),
            Model::Arm(m) => {
                let mut p = presets::cbk_pan(&self.flexible);
                if m.has_friction() {
                    p.resize(p.len() + 3 * self.joints(), 0.0);
                }
                p
            }
        };
        for e in model.effects().iter() {
            for spec in e.choice.parameters() {
                let start = match (spec.role, self.plant) {
                    (Role::Amplitude, _) => spec.neutral,
                    (_, effect::Plant::Joint) => spec.joint_start,
                    (_, effect::Plant::Arm) => spec.arm_start,
                };
                p.resize(p.len() + e.sites, start);
            }
        }
        p.resize(p.len() + self.payload.map_or(0, |_| arm::PAYLOAD.len()), 0.0);
        p
    }
    /// Every effect that may be missing here, in every place.
    pub fn choices(&self) -> impl Iterator<Item = Choice> {
        let missing = |c: &Choice| !c.spec().installed && c.spec().acts_in(self.plant, self.fixed_base);
        Choice::all(self.plant).filter(missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_numerics::hybrid::Hybrid;

    #[test]
    fn names_and_defaults_cover_every_parameter() {
        for (plant, flexible, fixed_base) in [
            (effect::Plant::Joint, vec![true], false),
            (effect::Plant::Arm, vec![true, false, false], false),
            (effect::Plant::Arm, vec![true, false, false], true),
        ] {
            let subject = Subject { fixed_base, ..Subject::new(plant, flexible) };
            let all: Vec<String> = subject.choices().map(|c| c.id()).collect();
            // It holds on to the ground, which a base that floats does not.
            let grounded = plant == effect::Plant::Joint || fixed_base;
            assert_eq!(all.iter().any(|id| id == "gravity-torque"), grounded);
            for effects in [&[][..], &all] {
                let model = subject.model(effects).unwrap();
                let n = model.sizes().parameters;
                let names = subject.parameters(&model);
                assert_eq!((names.len(), subject.defaults(&model).len()), (n, n));
                let mut distinct: Vec<_> = names.iter().map(|n| &n.name).collect();
                distinct.sort();
                distinct.dedup();
                assert_eq!(distinct.len(), n);
            }
            assert_eq!(subject.inputs().len(), subject.model(&[] as &[&str]).unwrap().sizes().inputs);
        }
    }
}
