//! An FMU about a state: its exact derivatives as a matrix.

use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, VariableType,
};
use trueup_fmi_import::{AnyInstance, fmi3};

use crate::error::CosimError;
use crate::mistake::suggestion;
use crate::node::InstanceNode;
use crate::plan::MasterPlan;
use crate::system::ComponentInterface;
use crate::value;

/// Names of variables' elements, and their values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OperatingPoint {
    /// `a[1,2]`, arrays row by row.
    pub names: Vec<String>,
    /// In the variables' units.
    pub values: Vec<f64>,
}

/// dx/dt = f(x, u), y = g(x, u) about one point, as it is between events.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Linear {
    /// x: continuous states.
    pub states: OperatingPoint,
    /// u: continuous inputs.
    pub inputs: OperatingPoint,
    /// f: derivatives of the states.
    pub rates: OperatingPoint,
    /// y: continuous outputs.
    pub outputs: OperatingPoint,
    /// Of rates, then outputs (rows) by states, then inputs (columns), row by row.
    pub jacobian: Vec<f64>,
}

/// Some variables of an FMU.
#[derive(Default)]
struct Chosen {
    references: Vec<u32>,
    lengths: Vec<usize>,
    names: Vec<String>,
}

impl Chosen {
    fn of(d: &Description, variables: impl IntoIterator<Item = usize>) -> Self {
        let mut chosen = Self::default();
        for at in variables {
            let names = value::elements(d, &d.variables[at]).unwrap_or_default();
            chosen.references.push(d.variables[at].value_reference);
            chosen.lengths.push(names.len());
            chosen.names.extend(names);
        }
        chosen
    }
    fn read(&self, slave: &mut AnyInstance) -> Result<Vec<f64>, trueup_fmi_import::ImportError> {
        let mut values = vec![0.0; self.names.len()];
        if !values.is_empty() {
            let block = slave.prepare(&self.references)?;
            slave.read(&block, &mut values).map_err(|e| *e)?;
        }
        Ok(values)
    }
}

fn settle(slave: &mut AnyInstance, time: f64) -> Result<(), CosimError> {
    let call = |source| CosimError::Call { time, source };
    if slave.iterate_events().map_err(call)?.terminate {
        let reason = format!("instance \"{}\" ends the run at this point", slave.name());
        return Err(CosimError::Stuck { time, reason, log: slave.log() });
    }
    slave.enter_continuous_time_mode().map_err(call)
}

impl Linear {
    /// Of the plan's one FMU, for Model Exchange, where a run would begin with its start values: of parameters, of inputs. `states`
    /// replace those that it begins with; an event that is due then is handled first, which may change them.
    ///
    /// # Errors
    /// [`CosimError::Setting`]: several FMUs, Co-Simulation, no directional derivatives, a state that there is not. Whatever the FMU
    /// returns; a value that is not finite.
    pub fn of(mut plan: MasterPlan, states: &[(String, f64)]) -> Result<Self, CosimError> {
        let wrong = |message: String| Err(CosimError::Setting(vec![message]));
        let (Some(planned), true) = (plan.components.pop(), plan.components.is_empty()) else {
            return wrong("a system of several FMUs has no derivatives of its own; linearize one FMU".into());
        };
        if planned.interface != ComponentInterface::ModelExchange {
            return wrong("derivatives by states are for Model Exchange; choose that interface".into());
        }
        let time = plan.grid.start;
        let call = |source| CosimError::Call { time, source };
        let slave = InstanceNode::instantiate(&planned, fmi3::CoSimulationOptions::default())?;
        let mut node = InstanceNode::new(planned, slave);
        if !node.offered().is_some_and(|i| i.provides_directional_derivatives) {
            let file = node.planned.fmu.file().display().to_string();
            return wrong(format!("{file} gives no directional derivatives; take differences of runs"));
        }
        let d = node.description().clone();
        let rates: Option<Vec<usize>> =
            d.structure.derivatives.iter().map(|u| d.resolve(u.reference)).collect();
        let rates = rates.unwrap_or_default();
        let behind: Option<Vec<usize>> =
            rates.iter().map(|at| d.variables[*at].derivative.and_then(|r| d.resolve(r))).collect();
        let continuous = |causality| {
            let is = |at: &usize| {
                let v = &d.variables[*at];
                v.causality == causality
                    && v.variability == DescriptionVariability::Continuous
                    && v.kind == VariableType::Float64
            };
            Chosen::of(&d, (0..d.variables.len()).filter(is))
        };
        let (x, dx) = (Chosen::of(&d, behind.unwrap_or_default()), Chosen::of(&d, rates));
        let (u, y) = (continuous(DescriptionCausality::Input), continuous(DescriptionCausality::Output));
        for (name, _) in states {
            if !x.names.contains(name) {
                let known = x.names.iter().map(String::as_str);
                return wrong(format!("there is no state `{name}`{}", suggestion(name, known)));
            }
        }
        node.initialize(time, plan.tolerance)?;
        let slave = &mut node.slave;
        settle(slave, time)?;
        let mut now = vec![0.0; x.names.len()];
        slave.set_time(time).map_err(call)?;
        slave.get_states(&mut now).map_err(call)?;
        if !states.is_empty() {
            for (at, name) in x.names.iter().enumerate() {
                if let Some((_, value)) = states.iter().find(|(n, _)| n == name) {
                    now[at] = *value;
                }
            }
            slave.set_states(&now).map_err(call)?;
            slave.enter_event_mode().map_err(call)?;
            settle(slave, time)?;
            slave.get_states(&mut now).map_err(call)?;
        }
        let mut f = vec![0.0; now.len()];
        slave.derivatives(&mut f).map_err(call)?;
        let (input, output) = (u.read(slave).map_err(call)?, y.read(slave).map_err(call)?);
        let unknowns = [&dx.references[..], &y.references].concat();
        let (rows, columns) = (dx.names.len() + y.names.len(), x.names.len() + u.names.len());
        let mut jacobian = vec![0.0; rows * columns];
        let (mut column, mut at) = (vec![0.0; rows], 0);
        let knowns = x.references.iter().zip(&x.lengths).chain(u.references.iter().zip(&u.lengths));
        for (reference, length) in knowns {
            for element in 0..*length {
                let mut seed = vec![0.0; *length];
                seed[element] = 1.0;
                slave.directional(&unknowns, &[*reference], &seed, &mut column).map_err(call)?;
                column.iter().enumerate().for_each(|(row, value)| jacobian[row * columns + at] = *value);
                at += 1;
            }
        }
        if let Some(at) = jacobian.iter().position(|v| !v.is_finite()) {
            let known = x.names.iter().chain(&u.names).nth(at % columns);
            let unknown = dx.names.iter().chain(&y.names).nth(at / columns);
            let (known, unknown) = (known.cloned().unwrap_or_default(), unknown.cloned().unwrap_or_default());
            let (variable, value) = (format!("the derivative of {unknown} by {known}"), jacobian[at]);
            let (instance, log) = (slave.name().to_owned(), slave.log());
            return Err(CosimError::NotFinite { time, instance, variable, value, log });
        }
        slave.terminate().map_err(call)?;
        let point = |chosen: Chosen, values| OperatingPoint { names: chosen.names, values };
        Ok(Self {
            states: point(x, now),
            inputs: point(u, input),
            rates: point(dx, f),
            outputs: point(y, output),
            jacobian,
        })
    }
}
