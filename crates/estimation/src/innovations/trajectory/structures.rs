//! The plant of a case along a trajectory, and the same with another structure.

use trueup_models::plants::{self, PlantStructure, StructureError};
use trueup_signals::{Case, ParameterValue};

use super::plant::{TrajectoryError, TrajectoryPlant};

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
    /// Along a trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
}

/// The plant of a case with its structure and the nominal parameters.
#[derive(Clone, Debug)]
pub struct PlantStructures {
    structure: PlantStructure,
    /// The plant.
    pub plant: TrajectoryPlant,
    /// The nominal parameters, in the order of the model's table.
    pub nominal: Vec<f64>,
}

impl PlantStructures {
    /// Of a case, without effects.
    ///
    /// # Errors
    /// See [`CasePlantError`].
    pub fn of(case: &Case) -> Result<Self, CasePlantError> {
        let flexible: Vec<bool> = case.elements("jointFlexible").iter().filter_map(|v| v.boolean()).collect();
        let flexible =
            if flexible.is_empty() { plants::usual_flexible(&case.model).to_vec() } else { flexible };
        let text = |name: &str| match case.parameters.get(name) {
            Some(ParameterValue::Text(item)) => Some(item.as_str()),
            _ => None,
        };
        let structure = PlantStructure {
            model: case.model.clone(),
            flexible,
            fixed_base: text("base") == Some("fixed"),
            effects: Vec::new(),
            led: Vec::new(),
            payload: case.payload.and_then(|link| link.checked_sub(1)),
        };
        let what = |e| match e {
            StructureError::Model(model) => {
                format!("{model} is no plant; model has to be one of {:?}", plants::NAMES)
            }
            StructureError::Structure(what) => what,
            StructureError::Payload { link, links } => {
                format!("the payload is on link {link} of {links}; name a link that is there")
            }
        };
        let built = plants::build(&structure).map_err(|e| CasePlantError::Structure {
            file: case.file.display().to_string(),
            what: what(e),
        })?;
        let value = |q: &trueup_plant::PlantQuantity| {
            let item = text(&q.name).and_then(|t| q.items.iter().position(|i| i.0 == t));
            let number = case.number(&q.name).or_else(|| item.map(|k| k as f64 + 1.0));
            number.unwrap_or_else(|| q.neutral.unwrap_or(q.start))
        };
        let nominal: Vec<f64> = built.table().parameters.iter().map(value).collect();
        let plant = TrajectoryPlant::new(built, &nominal)?;
        Ok(Self { structure, plant, nominal })
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
