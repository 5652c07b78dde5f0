//! The plant of a case along a trajectory, and the same with another structure.

use trueup_models::arm::PAYLOAD;
use trueup_models::effect::{EffectSet, ParameterRole, PlacedEffect, Scope};
use trueup_models::plants::{self, PlantStructure, StructureError};
use trueup_plant::PlantQuantity;
use trueup_signals::{Case, ParameterValue};

use super::plant::{TrajectoryError, TrajectoryPlant};
use crate::case_structure::case_structure;

/// A case whose plant cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CasePlantError {
    /// Its structure.
    #[error("{file}: {what}")]
    Structure {
        /// The case.
        file: String,
        /// What is wrong, with the remedy.
        what: String,
    },
    /// A known effect that no trajectory has.
    #[error(
        "{file}: causes cannot be compared with `{id}` as a known effect of an arm: {why}; remove it from [effects]"
    )]
    Effect {
        /// The case.
        file: String,
        /// The effect.
        id: String,
        /// Why not.
        why: &'static str,
    },
    /// Along a trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
}

/// Where a known effect of a case acts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KnownPlace {
    /// Its id in the list of effects.
    pub id: &'static str,
    /// What of the plant it belongs to.
    pub component: &'static str,
    /// Joints at which it acts, from 0; empty: at none of them.
    pub joints: Vec<usize>,
}

/// The plant of a case with its structure, its known effects and the nominal parameters.
#[derive(Clone, Debug)]
pub struct PlantStructures {
    structure: PlantStructure,
    /// The plant.
    pub plant: TrajectoryPlant,
    /// The nominal parameters, in the order of the model's table.
    pub nominal: Vec<f64>,
    /// Known effects that are not neutral.
    pub known: Vec<KnownPlace>,
}

impl PlantStructures {
    /// Of a case, with the effects that it declares.
    ///
    /// # Errors
    /// See [`CasePlantError`].
    pub fn of(case: &Case) -> Result<Self, CasePlantError> {
        let what = |e| match e {
            StructureError::Model(model) => {
                format!("{model} is no plant; model has to be one of {:?}", plants::NAMES)
            }
            StructureError::Structure(what) => what,
            StructureError::Parameter { name, what } => format!("{name}: {what}"),
            StructureError::Payload { link, links } => {
                format!("the payload is on link {link} of {links}; name a link that is there")
            }
        };
        let wrong = |e| CasePlantError::Structure { file: case.file.display().to_string(), what: what(e) };
        let structure = case_structure(case, &[]).map_err(wrong)?;
        let built = plants::build(&structure).map_err(wrong)?;
        let given = |q: &PlantQuantity| case.parameters.get(&q.name).and_then(|v| number_of(q, v));
        let value = |q: &PlantQuantity| given(q).unwrap_or_else(|| q.neutral.unwrap_or(q.start));
        let table = built.table();
        let mut nominal: Vec<f64> = table.parameters.iter().map(value).collect();
        // What a link carries is at its end, unless the case gives its centre.
        let center = table.parameter(PAYLOAD[1].name).filter(|k| given(&table.parameters[*k]).is_none());
        let length = case.payload.and_then(|link| table.parameter(&format!("linkLength[{link}]")));
        center.zip(length).into_iter().for_each(|(k, length)| nominal[k] = nominal[length]);
        let effects = plants::effects(&*built);
        for e in effects.iter() {
            if let Some(why) = no_trajectory(e, &nominal) {
                let file = case.file.display().to_string();
                return Err(CasePlantError::Effect { file, id: e.choice.id(), why });
            }
        }
        let known = known_places(effects, &nominal);
        let plant = TrajectoryPlant::new(built, &nominal)?;
        Ok(Self { structure, plant, nominal, known })
    }

    /// The same with a spring in joint `joint` (from 0), its parameters in the same order; `None`: the plant cannot have it.
    pub fn with_spring(&self, joint: usize, theta: &[f64]) -> Option<TrajectoryPlant> {
        let mut structure = self.structure.clone();
        *structure.flexible.get_mut(joint)? = true;
        TrajectoryPlant::new(plants::build(&structure).ok()?, theta).ok()
    }

    /// The same with a passive hinge inside link `link` (from 0) at a share of its length, and its parameters where the plant's are
    /// `theta`; `None`: the plant cannot have it.
    pub fn with_hinge(&self, theta: &[f64], link: usize, at: f64) -> Option<(TrajectoryPlant, Vec<f64>)> {
        let (plant, theta) = plants::hinged(self.plant.plant(), theta, link, at)?;
        Some((TrajectoryPlant::new(plant, &theta).ok()?, theta))
    }
}

/// The number that a value of a parameter is, of a choice that of its item; `None`: neither.
pub(crate) fn number_of(q: &PlantQuantity, value: &ParameterValue) -> Option<f64> {
    match value {
        ParameterValue::Text(item) => q.items.iter().position(|i| i.0 == item).map(|k| k as f64 + 1.0),
        other => other.number(),
    }
}

/// Values of a parameter of an effect at its sites.
fn at_sites<'a>(e: &PlacedEffect, parameter: usize, theta: &'a [f64]) -> &'a [f64] {
    &theta[e.begin.parameters + parameter * e.sites..][..e.sites]
}

/// Why an effect is none that a trajectory of coordinates and rates has.
fn no_trajectory(e: &PlacedEffect, theta: &[f64]) -> Option<&'static str> {
    if e.is_sensor() {
        return Some("it changes readings");
    }
    // The integral of a servo does not matter where its rate is 0.
    let integral = e.choice.parameters().iter().position(|p| p.name == "servoIntegralRate");
    let integrates = integral.is_none_or(|k| at_sites(e, k, theta).iter().any(|r| *r != 0.0));
    match e.spec().servo {
        true => integrates.then_some("its integral is a state of its own"),
        false => (!e.spec().states.is_empty()).then_some("it has states of its own"),
    }
}

/// Where known effects act: at a joint where one of their sizes is not neutral, or, of what only shapes friction, where there is some.
fn known_places(effects: &EffectSet, theta: &[f64]) -> Vec<KnownPlace> {
    let of = |e: &PlacedEffect| {
        let sizes = e.choice.parameters().iter().enumerate();
        let sizes: Vec<_> = sizes.filter(|(_, s)| s.role == ParameterRole::Amplitude).collect();
        let acts = |site: &usize| {
            sizes.is_empty() || sizes.iter().any(|(k, s)| at_sites(e, *k, theta)[*site] != s.neutral)
        };
        let sites: Vec<usize> = (0..e.sites).filter(acts).collect();
        let joints = if e.choice.scope() == Scope::Joint { sites.clone() } else { Vec::new() };
        let (id, component) = (e.spec().id, e.choice.component());
        (!sites.is_empty()).then_some(KnownPlace { id, component, joints })
    };
    effects.iter().filter_map(of).collect()
}
