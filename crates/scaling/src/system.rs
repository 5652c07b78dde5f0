//! Systems and FMUs: start values, also those that the system leaves to its FMUs, the run, and transformations of connections.

mod emit;

use std::collections::HashSet;

use trueup_cosim::names;
use trueup_cosim::plan::MasterPlan;
use trueup_cosim::system::{CosimSystem, SystemComponent, VariablePort};
use trueup_cosim::{InputMistake, check};
use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionUnit, DescriptionVariability, DescriptionVariable, Initial,
    StartValues, VariableType,
};

pub use emit::toml;

use crate::error::ScalingError;
use crate::law::{AffineScale, ScalingLaw, UnitDimension};

/// A system at the other size.
#[derive(Clone, Debug)]
pub struct ScaledSystem {
    /// With its new values, to be written as SSP.
    pub system: CosimSystem,
    /// The places of values in the old one.
    pub(crate) changes: Changes,
    /// What was left as it is, and should be looked at.
    pub notes: Vec<String>,
}

/// What scaling changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Changes {
    /// Per component, per start value.
    pub(crate) starts: Vec<Vec<Option<AffineScale>>>,
    /// Per component: values that the FMU itself has, by name, with their new values.
    pub(crate) added: Vec<Vec<(String, Vec<f64>)>>,
    /// Per connection: new factor and offset, where they change.
    pub(crate) links: Vec<Option<(f64, f64)>>,
}

/// Scales a system: every start value by its unit, the values that FMUs have where the system names none, the run's times, and
/// what connections add.
///
/// # Errors
/// [`ScalingError::System`] if it does not fit its FMUs; [`ScalingError::Mistakes`] with every quantity that has no law.
pub fn scale(system: &CosimSystem, law: &ScalingLaw) -> Result<ScaledSystem, ScalingError> {
    let plan = check(system)?;
    let mut work = SystemScaling {
        system,
        plan: &plan,
        law,
        mistakes: Vec::new(),
        notes: Vec::new(),
        changes: Changes::default(),
    };
    for (at, component) in system.components.iter().enumerate() {
        work.component(at, component);
    }
    for at in 0..system.connections.len() {
        work.connection(at);
    }
    let SystemScaling { mistakes, notes, changes, .. } = work;
    if !mistakes.is_empty() {
        return Err(ScalingError::Mistakes(mistakes));
    }
    let mut scaled = ScaledSystem { system: system.clone(), changes, notes };
    scaled.apply(&plan, law);
    Ok(scaled)
}

/// How a column of inputs or results scales: the variable of a system that it is named after, or that the system's inputs
/// give it.
///
/// # Errors
/// There is no such variable, or it has no law; in words.
pub fn column(
    system: &CosimSystem,
    plan: &MasterPlan,
    law: &ScalingLaw,
    name: &str,
) -> Result<AffineScale, String> {
    let given = system.inputs.iter().flat_map(|i| &i.columns).find(|(column, _)| column == name);
    let connector =
        system.connectors.iter().find(|(own, _)| own == name).and_then(|(_, ports)| ports.first());
    let port = given.map(|(_, port)| port).or(connector).cloned().or_else(|| system.port(name));
    let port = port.ok_or_else(|| "it names no variable of the system".to_owned())?;
    let (d, v) = variable(system, plan, &port)?;
    if !v.kind.is_float() {
        return Ok(law.scale(0.0, None));
    }
    let (unit, dimension) = unit(d, v);
    law.of(&port.to_string(), dimension).map_err(|why| crate::recording::refused(&unit, &why))
}

/// Unit as it is called, and what it measures.
fn unit(d: &Description, v: &DescriptionVariable) -> (String, Option<UnitDimension>) {
    let Some(name) = d.attributes(v).unit else { return (String::new(), None) };
    let known = d.unit(&name).cloned();
    let unit = known.unwrap_or(DescriptionUnit { name, base: None, display: Vec::new(), line: 0 });
    let mut dimension = UnitDimension::of(&unit);
    if d.attributes(v).relative_quantity {
        dimension = dimension.map(|it| UnitDimension { zero: 0.0, ..it });
    }
    (unit.name, dimension)
}

fn variable<'p>(
    system: &CosimSystem,
    plan: &'p MasterPlan,
    port: &VariablePort,
) -> Result<(&'p Description, &'p DescriptionVariable), String> {
    let at = system.components.iter().position(|c| c.name == port.component);
    let planned = at.and_then(|at| plan.components.get(at));
    let planned = planned.ok_or_else(|| format!("there is no component `{}`", port.component))?;
    let d = planned.description();
    let found = names::find(d, &port.variable)?;
    let (variable, _) = found.elements.first().ok_or_else(|| format!("`{}` is empty", port.variable))?;
    Ok((d, &d.variables[*variable]))
}

struct SystemScaling<'a> {
    system: &'a CosimSystem,
    plan: &'a MasterPlan,
    law: &'a ScalingLaw,
    mistakes: Vec<InputMistake>,
    notes: Vec<String>,
    changes: Changes,
}

impl SystemScaling<'_> {
    fn component(&mut self, at: usize, component: &SystemComponent) {
        let d = self.plan.components[at].description();
        let mut said: HashSet<(usize, usize)> = HashSet::new();
        let mut starts = Vec::new();
        for start in &component.start {
            let Ok(found) = names::find(d, &start.variable) else {
                starts.push(None); // optional, and of nothing
                continue;
            };
            said.extend(&found.elements);
            let v = &d.variables[found.elements.first().map_or(0, |(v, _)| *v)];
            let zero = start.values.iter().all(|text| neither(text));
            starts.push(match self.scale(component, d, v, zero) {
                Ok(by) => by,
                Err(message) => {
                    self.mistakes.push(InputMistake { place: start.place.clone(), message });
                    None
                }
            });
        }
        let driven: HashSet<(usize, usize)> = {
            let links = self.plan.links.iter().map(|l| l.to);
            let all = links.chain(self.plan.driven.iter().map(|driven| driven.to));
            all.filter(|e| e.component == at).map(|e| (e.variable, e.element)).collect()
        };
        let mut added = Vec::new();
        for (variable, v) in d.variables.iter().enumerate() {
            let Some(StartValues::Real(values)) = &v.start else { continue };
            let zero = values.iter().all(|x| *x == 0.0 || x.is_infinite());
            if !settable(v) {
                self.constant(component, d, v, zero);
                continue;
            }
            let one = (values.len() == 1).then(|| values[0]);
            let count = d.elements(v).unwrap_or(values.len());
            let own: Vec<usize> = (0..count)
                .filter(|e| !said.contains(&(variable, *e)) && !driven.contains(&(variable, *e)))
                .collect();
            if zero || own.is_empty() {
                continue;
            }
            let by = match self.scale(component, d, v, zero) {
                Ok(Some(by)) => by,
                Ok(None) => continue,
                Err(message) => {
                    let message = format!("{message}; the value is the FMU's own");
                    self.mistakes.push(InputMistake { place: component.place.clone(), message });
                    continue;
                }
            };
            let value = |e: &usize| by.apply(one.or(values.get(*e).copied()).unwrap_or(0.0));
            if own.len() == count {
                added.push((v.name.clone(), own.iter().map(value).collect()));
            } else {
                let name = |e: &usize| (names::element(d, variable, *e), vec![value(e)]);
                added.extend(own.iter().map(name));
            }
        }
        self.changes.starts.push(starts);
        self.changes.added.push(added);
    }

    /// How a variable scales; `None`: it stays. `zero`: all its values are 0 or without bound, at any size.
    fn scale(
        &self,
        component: &SystemComponent,
        d: &Description,
        v: &DescriptionVariable,
        zero: bool,
    ) -> Result<Option<AffineScale>, String> {
        let number = !matches!(
            v.kind,
            VariableType::Boolean
                | VariableType::String
                | VariableType::Binary
                | VariableType::Clock
                | VariableType::Enumeration
        );
        if !number {
            return Ok(None);
        }
        let (unit, dimension) = unit(d, v);
        let name = called(component, v);
        if !v.kind.is_float() && unit.is_empty() {
            return Ok(None); // a number of things
        }
        let by = match self.law.of(&name, dimension) {
            Ok(by) => by,
            Err(_) if zero && dimension.is_none_or(|it| it.zero == 0.0) => return Ok(None),
            Err(why) => {
                let of = if unit.is_empty() { String::new() } else { format!(" in {unit}") };
                return Err(format!("`{name}`{of}: {}", why.to_string().replace("NAME", &name)));
            }
        };
        match by.is_one() {
            true => Ok(None),
            false if v.kind.is_float() => Ok(Some(by)),
            false => Err(format!(
                "`{name}` in {unit} is a whole number and cannot be scaled; give it --exponent {name}=0"
            )),
        }
    }

    /// What no one can set, and what therefore stays.
    fn constant(
        &mut self,
        component: &SystemComponent,
        d: &Description,
        v: &DescriptionVariable,
        zero: bool,
    ) {
        if v.variability != DescriptionVariability::Constant || zero {
            return;
        }
        if let Ok(Some(_)) | Err(_) = self.scale(component, d, v, zero) {
            let (name, unit) = (called(component, v), unit(d, v).0);
            self.notes.push(format!(
                "`{name}` ({unit}) is a constant of its FMU: it stays, and is wrong at the other size"
            ));
        }
    }

    /// input = factor output + offset: the offset scales as the input, the factor as the ratio of both.
    fn connection(&mut self, at: usize) {
        let connection = &self.system.connections[at];
        let scale = |port: &VariablePort| {
            let (d, v) = variable(self.system, self.plan, port)?;
            let (_, dimension) = unit(d, v);
            Ok::<_, String>((dimension, self.law.of(&port.to_string(), dimension)))
        };
        let (Ok((a, from)), Ok((b, to))) = (scale(&connection.from), scale(&connection.to)) else {
            self.changes.links.push(None);
            return;
        };
        let alike = a.zip(b).is_some_and(|(a, b)| a.exponents == b.exponents) || (a.is_none() && b.is_none());
        let offset = connection.offset;
        let changed = match (from, to) {
            (Ok(from), Ok(to)) => {
                let factor = if alike { connection.factor } else { connection.factor * to.over(&from) };
                let changed = (factor, to.apply(offset));
                Some(changed).filter(|new| *new != (connection.factor, offset))
            }
            (_, Err(why)) if offset != 0.0 => {
                let message = format!(
                    "the offset of `{}`: {}",
                    connection.to,
                    why.to_string().replace("NAME", &connection.to.to_string())
                );
                self.mistakes.push(InputMistake { place: connection.place.clone(), message });
                None
            }
            (from, to) => {
                if let (Err(why), false) = (from.and(to), alike) {
                    let message =
                        format!("`{}` to `{}` are not of one unit: {why}", connection.from, connection.to);
                    self.mistakes.push(InputMistake { place: connection.place.clone(), message });
                }
                None
            }
        };
        self.changes.links.push(changed);
    }
}

impl ScaledSystem {
    fn apply(&mut self, plan: &MasterPlan, law: &ScalingLaw) {
        let time = law.time();
        let (system, changes) = (&mut self.system, &self.changes);
        for (component, (starts, added)) in
            system.components.iter_mut().zip(changes.starts.iter().zip(&changes.added))
        {
            component.step = component.step.map(|step| time.apply(step));
            for (start, by) in component.start.iter_mut().zip(starts) {
                if let Some(by) = by {
                    start.values.iter_mut().for_each(|text| *text = texts(text, *by));
                }
            }
            for (name, values) in added {
                let place = component.place.clone();
                let values = values.iter().map(|x| format!("{x:?}")).collect();
                component.start.push(trueup_cosim::system::StartValue {
                    variable: name.clone(),
                    values,
                    place,
                    ..Default::default()
                });
            }
        }
        for (connection, changed) in system.connections.iter_mut().zip(&changes.links) {
            if let Some((factor, offset)) = changed {
                (connection.factor, connection.offset) = (*factor, *offset);
            }
        }
        let (grid, run) = (&plan.grid, &mut system.run);
        run.start = Some(time.apply(grid.start));
        run.stop = Some(time.apply(grid.stop));
        run.step = Some(time.apply(grid.step));
    }
}

/// Numbers of a start value, which may be several with commas between.
fn texts(text: &str, by: AffineScale) -> String {
    let one = |part: &str| match part.trim().parse::<f64>() {
        Ok(x) => format!("{:?}", by.apply(x)),
        Err(_) => part.to_owned(),
    };
    text.split(',').map(one).collect::<Vec<_>>().join(",")
}

/// 0 or without bound: the same at any size.
fn neither(text: &str) -> bool {
    text.split(',').all(|part| part.trim().parse::<f64>().is_ok_and(|x| x == 0.0 || x.is_infinite()))
}

fn called(component: &SystemComponent, v: &DescriptionVariable) -> String {
    if component.name.is_empty() { v.name.clone() } else { format!("{}.{}", component.name, v.name) }
}

/// Its start value is the user's: of parameters, inputs, and of what a run begins with.
fn settable(v: &DescriptionVariable) -> bool {
    let free = matches!(v.causality, DescriptionCausality::Parameter | DescriptionCausality::Input);
    let begins = matches!(v.causality, DescriptionCausality::Output | DescriptionCausality::Local)
        && matches!(v.initial, Some(Initial::Exact | Initial::Approx));
    v.variability != DescriptionVariability::Constant && (free || begins)
}
