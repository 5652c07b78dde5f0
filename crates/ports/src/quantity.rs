//! The real variables of an FMU, element by element, with what their units make of them.

use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, DescriptionVariable, StartValues, VariableType,
};
use trueup_fmi_import::MAX_ELEMENTS;
use trueup_plant::elements;
use trueup_signals::SignalUnit;

use crate::kind::{BY_UNIT, PortKind};
use crate::words;

/// One element of a variable.
#[derive(Clone, Debug, PartialEq)]
pub struct FmuQuantity {
    /// Name, of an array's element with its indices.
    pub name: String,
    /// Its unit as written; empty: none.
    pub unit: String,
    /// What it measures.
    pub kind: PortKind,
    /// The kind is of the name: there is no unit.
    pub by_name: bool,
    /// SI value per value.
    pub factor: f64,
    /// Start value, in its unit.
    pub start: f64,
    /// Nominal value, in its unit.
    pub nominal: f64,
    /// Of the variable.
    pub causality: DescriptionCausality,
}

/// All of them, in the order of the description.
#[derive(Clone, Debug, Default)]
pub struct FmuQuantities {
    /// Inputs.
    pub inputs: Vec<FmuQuantity>,
    /// Outputs.
    pub outputs: Vec<FmuQuantity>,
    /// Parameters.
    pub parameters: Vec<FmuQuantity>,
    /// Names of everything else, with the reason why no port takes it.
    pub others: Vec<(String, String)>,
    /// Value references of the inputs' and of the outputs' variables, in the same order.
    pub references: [Vec<u32>; 2],
}

impl FmuQuantities {
    /// Of a description.
    ///
    /// # Errors
    /// More elements than can be listed.
    pub fn of(d: &Description) -> Result<Self, String> {
        let (mut all, mut left) = (Self::default(), MAX_ELEMENTS);
        for v in &d.variables {
            let count = d.elements(v).unwrap_or(0);
            left = left.checked_sub(count).ok_or_else(|| {
                format!("`{}` has {count} elements: export the FMU with shorter arrays", v.name)
            })?;
            all.add(d, v);
        }
        Ok(all)
    }

    fn add(&mut self, d: &Description, v: &DescriptionVariable) {
        let constant = v.variability == DescriptionVariability::Constant;
        let list = match v.causality {
            _ if v.kind != VariableType::Float64 || constant => None,
            DescriptionCausality::Input => Some(&mut self.inputs),
            DescriptionCausality::Output => Some(&mut self.outputs),
            DescriptionCausality::Parameter => Some(&mut self.parameters),
            _ => None,
        };
        let (Some(list), Some(lengths)) = (list, d.lengths(v)) else {
            let what = match v.kind {
                VariableType::Float64 if constant => "a constant".to_owned(),
                VariableType::Float64 => causality(v.causality).to_owned(),
                kind => format!("of type {}", kind.name(d.version)),
            };
            self.others.push((v.name.clone(), what));
            return;
        };
        let a = d.attributes(v);
        let unit = a.unit.unwrap_or_default();
        let (by_unit, factor) = kind_of(d, &unit);
        let starts = v.start.as_ref().and_then(StartValues::as_f64).unwrap_or_default();
        for (k, name) in elements(&v.name, &lengths).into_iter().enumerate() {
            let kind = by_unit.unwrap_or_else(|| words::kind(&name, v.causality));
            list.push(FmuQuantity {
                name,
                unit: unit.clone(),
                kind,
                by_name: by_unit.is_none(),
                factor,
                start: starts.get(k).or(starts.first()).copied().unwrap_or(0.0),
                nominal: a.nominal.filter(|n| n.is_finite() && *n != 0.0).map_or(1.0, f64::abs),
                causality: v.causality,
            });
        }
        match v.causality {
            DescriptionCausality::Input => self.references[0].push(v.value_reference),
            DescriptionCausality::Output => self.references[1].push(v.value_reference),
            _ => {}
        }
    }

    /// Index of an input.
    pub fn input(&self, name: &str) -> Option<usize> {
        self.inputs.iter().position(|q| q.name == name)
    }
    /// Index of an output.
    pub fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|q| q.name == name)
    }
    /// A parameter.
    pub fn parameter(&self, name: &str) -> Option<&FmuQuantity> {
        self.parameters.iter().find(|q| q.name == name)
    }
}

/// For messages.
pub fn causality(c: DescriptionCausality) -> &'static str {
    match c {
        DescriptionCausality::Parameter => "a parameter",
        DescriptionCausality::CalculatedParameter => "a calculated parameter",
        DescriptionCausality::StructuralParameter => "a structural parameter",
        DescriptionCausality::Input => "an input",
        DescriptionCausality::Output => "an output",
        DescriptionCausality::Local => "a local variable",
        DescriptionCausality::Independent => "the independent variable",
    }
}

/// Kind and SI factor of a unit; `None`: no unit is given.
fn kind_of(d: &Description, unit: &str) -> (Option<PortKind>, f64) {
    if unit.is_empty() {
        return (None, 1.0);
    }
    let bare = unit.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(unit);
    let defined = d.unit(unit).and_then(|u| u.base).map(|b| {
        let [kg, m, s, a, k, mol, cd, rad] = b.exponents;
        ([kg, m, s, a, rad], [k, mol, cd] == [0; 3], b.factor)
    });
    let known = || {
        let u = SignalUnit::parse(bare)?;
        let [kg, m, s, a, k, rad, cycles] = u.exponents.map(i32::from);
        Some(([kg, m, s, a, rad], [k, cycles] == [0; 2], u.factor))
    };
    let Some((exponents, plain, factor)) = defined.or_else(known) else {
        return (Some(PortKind::Other), 1.0);
    };
    let kind = BY_UNIT.iter().find(|(e, _)| plain && *e == exponents).map_or(PortKind::Other, |(_, k)| *k);
    let energy = kind == PortKind::Torque && bare.ends_with('J');
    (Some(if energy { PortKind::Energy } else { kind }), factor)
}
