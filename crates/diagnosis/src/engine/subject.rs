//! The plant under diagnosis: its structure, with any effects, and where a named value is in it.

use std::collections::BTreeSet;
use std::sync::Arc;

use trueup_models::arm::{self, ArmScalar, PlanarManipulator};
use trueup_models::compiled::Compiled;
use trueup_models::effect::{self, EffectChoice, EffectSet};
use trueup_models::joint::{self, TwoMassJoint};
use trueup_numerics::hybrid::{At, ModelSizes};
use trueup_plant::{Plant, PlantQuantity};

/// One of the plants, with effects.
#[derive(Clone, Debug)]
pub enum EngineModel {
    /// TwoMassJoint.
    Joint(Arc<Compiled<TwoMassJoint>>),
    /// PlanarManipulator.
    Arm(Arc<Compiled<PlanarManipulator>>),
}

impl EngineModel {
    /// This joint.
    pub fn joint(joint: TwoMassJoint) -> Self {
        Self::Joint(Arc::new(Compiled::new(joint)))
    }
    /// The plant itself.
    pub fn plant(&self) -> &dyn Plant {
        match self {
            Self::Joint(m) => m.plant(),
            Self::Arm(m) => m.plant(),
        }
    }
    /// How many values of each kind.
    pub fn sizes(&self) -> ModelSizes {
        self.plant().sizes()
    }
    /// Rates of the states where these rows of an arm's equations have accelerations that are given, whatever force that takes.
    /// The motor and load of a joint interact by the spring alone.
    pub fn rates_prescribed<T: ArmScalar>(&self, at: At<T>, prescribed: &[(usize, T)], dx: &mut [T]) {
        match self {
            Self::Joint(m) => T::rates(m.plant(), at, &[], dx),
            Self::Arm(m) => T::rates_prescribed(m, at, prescribed, dx),
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
            Self::Joint(m) => m.inner().effects(),
            Self::Arm(m) => m.inner().effects(),
        }
    }
}

/// The plant as the user declares it.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagnosisSubject {
    /// Which plant.
    pub plant: effect::PlantKind,
    /// Which joints have a spring.
    pub flexible: Vec<bool>,
    /// An arm's base stays where it begins.
    pub fixed_base: bool,
    /// Which link of an arm carries a body more, from 0.
    pub payload: Option<usize>,
    /// Ids of the effects that are there for certain: every model of it has them.
    pub known: Vec<String>,
}

impl DiagnosisSubject {
    /// On a base that floats, nothing but its joints known.
    pub fn new(plant: effect::PlantKind, flexible: Vec<bool>) -> Self {
        Self { plant, flexible, fixed_base: false, payload: None, known: Vec::new() }
    }
    /// With these effects (ids, places behind a colon) in addition to those that are known.
    ///
    /// # Errors
    /// An effect that this plant cannot have.
    pub fn model<S: AsRef<str>>(&self, effects: &[S]) -> Result<EngineModel, String> {
        let effects = self.with_known(effects.iter().map(|e| e.as_ref().to_owned()));
        match self.plant {
            effect::PlantKind::Joint => TwoMassJoint::new(self.flexible[0], &effects)
                .map(EngineModel::joint)
                .map_err(|e| e.to_string()),
            effect::PlantKind::Arm | effect::PlantKind::Space => {
                let arm = PlanarManipulator::on_base(self.fixed_base, &self.flexible, &effects);
                let arm = arm.map_err(|e| e.to_string())?.with_payload(self.payload);
                Ok(EngineModel::Arm(Arc::new(Compiled::new(arm))))
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
        let model = self.model(&[] as &[&str]);
        model.map_or_else(|_| Vec::new(), |m| names(&m.plant().table().inputs))
    }
    fn nominal_effects(&self) -> Option<EffectSet> {
        self.model(&[] as &[&str]).ok().map(|m| m.effects().clone())
    }
    /// The input that commands the motor of a joint.
    pub fn motor_input(&self, site: usize) -> usize {
        match self.plant {
            effect::PlantKind::Joint => joint::input::MOTOR_CURRENT,
            effect::PlantKind::Arm | effect::PlantKind::Space => {
                arm::input::joint_torque(self.joints()) + site
            }
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
        let plain = Self { known: Vec::new(), ..self.clone() };
        let model = plain.model(&[] as &[&str]);
        model.map_or_else(|_| Vec::new(), |m| names(&m.plant().table().outputs))
    }
    /// Outputs that are positions, each with its velocity; those of effects that are known to be there among them.
    pub fn velocities(&self) -> Vec<(String, String)> {
        let Ok(model) = self.model(&[] as &[&str]) else { return Vec::new() };
        let all = &model.plant().table().outputs;
        let velocities = (0..all.len()).filter(|k| PlantQuantity::is_velocity(all, *k));
        let pair = |k: usize| Some((all[all[k].rate_of?].name.clone(), all[k].name.clone()));
        velocities.filter_map(pair).collect()
    }
    /// All parameters of a model in their order.
    pub fn parameters(&self, model: &EngineModel) -> Vec<PlantQuantity> {
        model.plant().table().parameters.clone()
    }
    /// Values to begin with: those of the preset; effects are neutral.
    pub fn defaults(&self, model: &EngineModel) -> Vec<f64> {
        let all = model.plant().table().parameters.iter();
        let mut p: Vec<f64> = all.map(|q| q.neutral.unwrap_or(q.start)).collect();
        if let EngineModel::Arm(_) = model {
            // The rotor of a joint that the user declares rigid is neglected, whatever loosens the joint.
            let rotors = arm::parameter::motor_inertia(self.joints());
            (0..self.joints()).filter(|j| !self.flexible[*j]).for_each(|j| p[rotors + j] = 0.0);
        }
        p
    }
    /// Every effect that may be missing here, in every place.
    pub fn choices(&self) -> impl Iterator<Item = EffectChoice> {
        let missing = |c: &EffectChoice| !c.spec().installed && c.spec().acts_in(self.plant, self.fixed_base);
        EffectChoice::all(self.plant).filter(missing)
    }
}

fn names(all: &[PlantQuantity]) -> Vec<String> {
    all.iter().map(|q| q.name.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_defaults_cover_every_parameter() {
        for (plant, flexible, fixed_base) in [
            (effect::PlantKind::Joint, vec![true], false),
            (effect::PlantKind::Arm, vec![true, false, false], false),
            (effect::PlantKind::Arm, vec![true, false, false], true),
        ] {
            let subject = DiagnosisSubject { fixed_base, ..DiagnosisSubject::new(plant, flexible) };
            let all: Vec<String> = subject.choices().map(|c| c.id()).collect();
            // It holds on to the ground, which a base that floats does not.
            let grounded = plant == effect::PlantKind::Joint || fixed_base;
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
