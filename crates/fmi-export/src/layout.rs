//! The variable table made ready for look-up by value reference.

use crate::fault::{CallOutcome, error};
use crate::model::FmuModel;
use crate::state_machine::InstanceVersion;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{BoundaryType, Depends, ModelTable, Storage, TableVariable};
use trueup_numerics::hybrid::ModelSizes;

/// Elements of the variable of a value reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReferenceElements {
    /// Index of the variable in the table.
    pub variable: usize,
    /// First element.
    pub first: usize,
    /// Number of elements: 1 in FMI 2.0, the whole array in FMI 3.0.
    pub len: usize,
}

/// The meaning of a value reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceTarget {
    /// Elements of a variable of the table.
    Variable(ReferenceElements),
    /// An event indicator (FMI 3.0).
    Indicator(usize),
}

/// Table, look-up and start values of one FMU; immutable after instantiation.
#[derive(Debug)]
pub struct Layout {
    /// The table, numbered, with the start values of this FMU.
    pub table: ModelTable,
    /// Sizes of the model.
    pub sizes: ModelSizes,
    /// Start values of the parameters.
    pub parameters: Vec<f64>,
    /// Start values of the inputs.
    pub inputs: Vec<f64>,
    /// Which parameter elements count as set from the start (start values packed in).
    pub given: Vec<bool>,
    /// Nominal values of the states.
    pub nominals: Vec<f64>,
    /// By value reference: variable and element.
    elements: Vec<(u32, u32)>,
    /// Pairs (follower, followed) of parameter elements; in an order in which one pass suffices.
    followers: Vec<(usize, usize)>,
}

impl Layout {
    /// From a model and its configuration; the message names what does not fit.
    pub fn new<M: FmuModel>(model: &M, configuration: &Configuration) -> Result<Self, String> {
        let mut table = model.table();
        table.number();
        for (element, value) in &configuration.start {
            table.set_start(element, *value)?;
        }
        let sizes = model.sizes();
        let mut given = vec![false; sizes.parameters];
        let mut elements = Vec::new();
        for (k, v) in table.variables.iter().enumerate() {
            for i in 0..v.len() {
                elements.push((k as u32, i as u32));
                if let Storage::Parameter(base) = v.storage {
                    given[base + i] = configuration.start.iter().any(|(name, _)| *name == v.element_name(i));
                }
            }
        }
        let mut parameters = table.parameter_starts();
        parameters.resize(sizes.parameters, 0.0);
        let mut inputs = table.input_starts();
        inputs.resize(sizes.inputs, 0.0);
        let mut nominals = vec![1.0; sizes.states];
        for v in &table.variables {
            if let (Storage::State(base), Some(nominal)) = (v.storage, v.nominal) {
                nominals.iter_mut().skip(base).take(v.len()).for_each(|n| *n = nominal);
            }
        }
        let followers = followers(&table)?;
        let layout = Self { table, sizes, parameters, inputs, given, nominals, elements, followers };
        let (mut p, given) = (layout.parameters.clone(), &layout.given);
        layout.follow(&mut p, given);
        Ok(Self { parameters: p, ..layout })
    }

    /// The meaning of a value reference in this version.
    pub fn find(&self, version: InstanceVersion, reference: u32) -> CallOutcome<ReferenceTarget> {
        let known = self.elements.len();
        let Some((variable, element)) = self.elements.get(reference as usize).copied() else {
            let k = (reference as usize).wrapping_sub(known);
            if version == InstanceVersion::Fmi3 && k < self.sizes.indicators {
                return Ok(ReferenceTarget::Indicator(k));
            }
            return error(format!(
                "unknown value reference {reference}: this FMU has 0 to {}; take them from its modelDescription.xml",
                known.saturating_sub(1)
            ));
        };
        let (variable, first) = (variable as usize, element as usize);
        if version == InstanceVersion::Fmi2 {
            return Ok(ReferenceTarget::Variable(ReferenceElements { variable, first, len: 1 }));
        }
        let v = &self.table.variables[variable];
        if first > 0 {
            return error(format!(
                "unknown value reference {reference}: it is inside the array `{}`, which is read and set as a whole by {}",
                v.name, v.value_reference
            ));
        }
        Ok(ReferenceTarget::Variable(ReferenceElements { variable, first, len: v.len() }))
    }
    /// Variable of an index that [`Layout::find`] gave.
    pub fn variable(&self, index: usize) -> &TableVariable {
        &self.table.variables[index]
    }
    /// Name of the element at a place of storage, for messages.
    pub fn name_of(&self, place: Storage) -> String {
        let index = |s: Storage| match s {
            Storage::Parameter(i) => Some((0, i)),
            Storage::Input(i) => Some((1, i)),
            Storage::Output(i) => Some((2, i)),
            Storage::State(i) => Some((3, i)),
            Storage::Rate(i) => Some((4, i)),
            Storage::Time | Storage::Constant => None,
        };
        let Some((class, i)) = index(place) else { return "time".to_owned() };
        let hit = self.table.variables.iter().find_map(|v| {
            let (c, base) = index(v.storage)?;
            (c == class && (base..base + v.len()).contains(&i)).then(|| v.element_name(i - base))
        });
        hit.unwrap_or_else(|| format!("{place:?}"))
    }
    /// Gives every parameter element that was not set the value (with duals: and derivatives) of the one that
    /// it follows.
    pub fn follow<T: Copy>(&self, p: &mut [T], set: &[bool]) {
        for (to, from) in &self.followers {
            if !set[*to] {
                p[*to] = p[*from];
            }
        }
    }
    /// Whether an unknown may depend on a known element, by the table's declaration.
    pub fn depends(
        &self,
        unknown: &TableVariable,
        element: usize,
        known: &TableVariable,
        known_element: usize,
    ) -> bool {
        let is_state = matches!(known.storage, Storage::State(_));
        let named = |names: &[String]| {
            names.contains(&known.name)
                && (known.len() != unknown.len() || known.len() == 1 || element == known_element)
        };
        match &unknown.depends {
            Depends::All => true,
            Depends::On(names) => named(names),
            Depends::StatesAnd(names) => is_state || named(names),
            Depends::Linear(terms) => terms.iter().any(|(name, _)| named(core::slice::from_ref(name))),
        }
    }
}

fn followers(table: &ModelTable) -> Result<Vec<(usize, usize)>, String> {
    let base = |v: &TableVariable| if let Storage::Parameter(i) = v.storage { Some(i) } else { None };
    let mut waiting: Vec<&TableVariable> = table.variables.iter().filter(|v| v.follows.is_some()).collect();
    let mut pairs = Vec::new();
    while !waiting.is_empty() {
        let before = waiting.len();
        let names: Vec<String> = waiting.iter().map(|v| v.name.clone()).collect();
        let mut wrong = None;
        waiting.retain(|v| {
            let leader = v.follows.as_deref().unwrap_or_default();
            if names.iter().any(|n| n == leader) {
                return true;
            }
            match (base(v), table.find(leader).map(|l| (base(l), l.len()))) {
                (Some(to), Some((Some(from), n))) if n == v.len() => {
                    pairs.extend((0..n).map(|i| (to + i, from + i)));
                }
                _ => wrong = Some(format!("`{}` cannot follow `{leader}`", v.name)),
            }
            false
        });
        if wrong.is_some() || waiting.len() == before {
            return Err(
                wrong.unwrap_or_else(|| format!("parameters that follow each other in a circle: {names:?}"))
            );
        }
    }
    Ok(pairs)
}

/// How a function of a version names a data type.
pub fn setter(version: InstanceVersion, kind: BoundaryType) -> &'static str {
    match (version, kind) {
        (InstanceVersion::Fmi2, BoundaryType::Real) => "Real",
        (InstanceVersion::Fmi3, BoundaryType::Real) => "Float64",
        (_, BoundaryType::Boolean) => "Boolean",
        (InstanceVersion::Fmi2, BoundaryType::Integer | BoundaryType::Enumeration(_)) => "Integer",
        (InstanceVersion::Fmi3, BoundaryType::Integer) => "Int32",
        (InstanceVersion::Fmi3, BoundaryType::Enumeration(_)) => "Int64",
    }
}
