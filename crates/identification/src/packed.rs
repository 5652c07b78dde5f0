//! A model with estimated values as data: what `trueup fmu pack --from` packs.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};
use trueup_models::arm::{BASE, BASE_CHOICE, FIXED_BASE, PAYLOAD};
use trueup_plant::PlantQuantity;
use trueup_signals::Case;

use crate::model::SimulatedPlant;

/// Structure, effects and start values of an estimated model, as the options of `trueup fmu pack` have them; `"pack"` in the JSON
/// of an identification and of a diagnosis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PackedModel {
    /// Name of the model.
    pub model: String,
    /// Name of the case whose diagnosis added effects: the FMU is `<Model>.augmented` then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub case: Option<String>,
    /// What the robot is made of: a file, or a preset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// The robot's base does not move, whatever its file has.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub held: bool,
    /// Effects, a place behind a colon.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<String>,
    /// Which joints are flexible.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub flexible: Vec<bool>,
    /// Choices of structure by name, as `base = "fixed"`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub structure: BTreeMap<String, String>,
    /// Start values by FMU variable, an array's elements by index, in the variables' units.
    pub start: BTreeMap<String, PackedValue>,
}

/// A start value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PackedValue {
    /// A number.
    Number(f64),
    /// An item of an enumeration.
    Item(String),
}

impl fmt::Display for PackedValue {
    /// As few digits as give a number back bit by bit.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{x:?}"),
            Self::Item(name) => f.write_str(name),
        }
    }
}

impl PackedModel {
    /// A plant with the values `p` of its parameters. How a run begins is not of the model and is left out.
    pub fn of(model: &SimulatedPlant, p: &[f64]) -> Self {
        let structure = model.structure();
        let merged = model.arm().map(|arm| arm.merged(p));
        let values = merged.as_deref().unwrap_or(p);
        Self {
            model: structure.model.clone(),
            robot: None,
            held: structure.robot.is_some() && structure.fixed_base,
            case: None,
            effects: structure.effects.clone(),
            flexible: structure.flexible.clone(),
            structure: Self::base(structure.robot.is_none() && structure.fixed_base),
            start: Self::named(model.parameters(), values).collect(),
        }
    }

    /// The same of a case: with its robot.
    #[must_use]
    pub fn of_case(self, case: &Case) -> Self {
        Self { robot: case.robot_file().map(|file| file.display().to_string()), ..self }
    }

    /// Parameters with their values. A payload has none: its link contains it.
    pub fn named<'a>(
        parameters: &'a [PlantQuantity],
        values: &'a [f64],
    ) -> impl Iterator<Item = (String, PackedValue)> + 'a {
        let own = |q: &&PlantQuantity| !q.is_initial() && !PAYLOAD.iter().any(|p| p.name == q.name);
        parameters.iter().zip(values).filter(move |(q, _)| own(q)).map(|(q, v)| {
            let item = q.items.get((*v - 1.0).max(0.0) as usize).map(|item| item.0.to_owned());
            (q.name.clone(), item.map_or(PackedValue::Number(*v), PackedValue::Item))
        })
    }

    /// The choice of a base that is fixed; a floating one is the default.
    pub fn base(fixed: bool) -> BTreeMap<String, String> {
        let item = BASE.items[FIXED_BASE as usize - 1].0;
        fixed.then(|| (BASE_CHOICE.to_owned(), item.to_owned())).into_iter().collect()
    }

    /// Values of `--structure`.
    pub fn structures(&self) -> impl Iterator<Item = String> {
        self.structure.iter().map(|(name, item)| format!("{name}={item}"))
    }

    /// Values of `--set`.
    pub fn sets(&self) -> impl Iterator<Item = String> {
        self.start.iter().map(|(name, value)| format!("{name}={value}"))
    }

    /// The arguments of `trueup` that pack it.
    pub fn arguments(&self) -> Vec<String> {
        let mut all = vec!["fmu".to_owned(), "pack".to_owned(), self.model.clone()];
        let mut option = |name: &str, value: String| all.extend([name.to_owned(), value]);
        self.robot.iter().for_each(|robot| option("--robot", robot.clone()));
        self.effects.iter().for_each(|e| option("--effect", e.clone()));
        if !self.flexible.is_empty() {
            let each: Vec<String> = self.flexible.iter().map(bool::to_string).collect();
            option("--flexible", each.join(","));
        }
        self.structures().for_each(|choice| option("--structure", choice));
        self.sets().for_each(|set| option("--set", set));
        all.extend(Some("--held".to_owned()).filter(|_| self.held));
        all
    }
}
