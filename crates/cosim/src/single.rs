//! One FMU in Co-Simulation that its caller steps: a controller of one's own in the loop.

use trueup_fmi_description::description::{
    DescriptionCausality, DescriptionVariability, DescriptionVariable,
};
use trueup_fmi_import::fmi3;

use crate::buffer::{BlockAccess, ElementNumber, ValueBuffer, VariableBlock};
use crate::check::names;
use crate::error::CosimError;
use crate::grid::ROUNDING;
use crate::node::InstanceNode;
use crate::plan::MasterPlan;
use crate::system::ComponentInterface;
use crate::value;

/// Steps that end early on the way to the end of one step, after which they are assumed to be endless.
const EARLY: u32 = 100_000;

/// A running FMU. Values are numbers: Booleans 0 or 1, items of an enumeration by their values.
pub struct SteppedFmu {
    node: InstanceNode,
    time: f64,
}

/// Partial derivatives of some variables with respect to others, elements of arrays row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartialDerivatives {
    /// Names of the rows.
    pub of: Vec<String>,
    /// Names of the columns.
    pub by: Vec<String>,
    /// Row by row.
    pub values: Vec<f64>,
}

impl SteppedFmu {
    /// The plan's one FMU after initialization, at the start of its run.
    ///
    /// # Errors
    /// [`CosimError::Setting`]: several FMUs, or Model Exchange. Whatever the FMU returns.
    pub fn begin(mut plan: MasterPlan) -> Result<Self, CosimError> {
        let wrong = |message: &str| Err(CosimError::Setting(vec![message.to_owned()]));
        let (Some(planned), true) = (plan.components.pop(), plan.components.is_empty()) else {
            return wrong("a system of several FMUs has no steps of its own; simulate it, or step one FMU");
        };
        if planned.interface != ComponentInterface::CoSimulation {
            return wrong("steps are for Co-Simulation; choose that interface");
        }
        let time = plan.grid.start;
        let slave = InstanceNode::instantiate(&planned, fmi3::CoSimulationOptions::default())?;
        let mut node = InstanceNode::new(planned, slave);
        node.initialize(time, plan.tolerance)?;
        Ok(Self { node, time })
    }

    /// Time in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Advances by `step` s.
    ///
    /// # Errors
    /// A step that is not above 0; whatever the FMU returns; that it does not come further, or requests the end.
    pub fn step(&mut self, step: f64) -> Result<(), CosimError> {
        if !(step > 0.0 && step.is_finite()) {
            return Err(CosimError::Setting(vec![format!(
                "a step of {step} s leads nowhere; give one above 0"
            )]));
        }
        let end = self.time + step;
        for _ in 0..EARLY {
            let (time, left) = (self.time, end - self.time);
            let stepped = self.node.slave.step(time, left, true);
            let Some(stepped) = stepped.map_err(|source| CosimError::Call { time, source: *source })? else {
                self.time = end;
                return Ok(());
            };
            let stuck = |what: &str| {
                let reason = format!("instance \"{}\" {what}", self.node.slave.name());
                CosimError::Stuck { time: stepped.time, reason, log: self.node.slave.log() }
            };
            // Its clock and ours differ by rounding.
            let rounding = ROUNDING * step;
            if !(time - rounding..=end + rounding).contains(&stepped.time) {
                return Err(stuck("does not report the time that it came to"));
            }
            if stepped.terminate {
                return Err(stuck("ends the run at this point"));
            }
            if stepped.discarded && stepped.time <= time {
                return Err(stuck("refuses this step; give a shorter one"));
            }
            if !stepped.early && !stepped.discarded {
                self.time = end;
                return Ok(());
            }
            self.time = stepped.time;
        }
        let reason = format!("instance \"{}\" returns early again and again", self.node.slave.name());
        Err(CosimError::Stuck { time: self.time, reason, log: self.node.slave.log() })
    }

    /// Shape and values of a variable or an element; a scalar has no shape.
    ///
    /// # Errors
    /// [`CosimError::Setting`]: no variable of that name, or no numbers. Whatever the FMU returns.
    pub fn get(&mut self, name: &str) -> Result<(Vec<usize>, Vec<f64>), CosimError> {
        let found = self.find(name)?;
        let mut values = Vec::with_capacity(found.elements.len());
        let mut at = 0;
        while let Some((variable, _)) = found.elements.get(at).copied() {
            let block = self.block(variable, name)?;
            let own = found.elements[at..].iter().take_while(|e| e.0 == variable);
            for (_, element) in own {
                values.push(block.values.number(*element).ok_or_else(|| no_number(name))?);
                at += 1;
            }
        }
        Ok((found.shape, values))
    }

    /// Sets an input or a tunable parameter, all elements of an array or one.
    ///
    /// # Errors
    /// [`CosimError::Setting`]: no such variable, one that cannot be set during a run, another number of values, one that its type
    /// cannot hold. Whatever the FMU returns.
    pub fn set(&mut self, name: &str, values: &[f64]) -> Result<(), CosimError> {
        let wrong = |message: String| CosimError::Setting(vec![message]);
        let found = self.find(name)?;
        let (given, wanted) = (values.len(), found.elements.len());
        if given != wanted {
            return Err(wrong(format!("`{name}` has {wanted} elements, not {given}; give as many values")));
        }
        if let Some(x) = values.iter().find(|x| !x.is_finite()) {
            return Err(wrong(format!("`{name}` cannot be {x}; give a finite value")));
        }
        let mut at = 0;
        while let Some((variable, _)) = found.elements.get(at).copied() {
            settable(&self.node.description().variables[variable], name).map_err(wrong)?;
            // The others of an array stay as they are.
            let mut block = self.block(variable, name)?;
            while let Some((_, element)) = found.elements.get(at).filter(|e| e.0 == variable) {
                let value = values[at];
                if !block.values.set_exact(*element, ElementNumber::Real(value)) {
                    return Err(wrong(format!("`{name}` cannot be {value}; give a value of its type")));
                }
                at += 1;
            }
            let time = self.time;
            self.node.slave.set(&block).map_err(|source| CosimError::Call { time, source })?;
        }
        Ok(())
    }

    /// Partial derivatives at this point.
    ///
    /// # Errors
    /// [`CosimError::Setting`]: the FMU gives none, or no such variable. Whatever the FMU returns.
    pub fn derivatives(&mut self, of: &[String], by: &[String]) -> Result<PartialDerivatives, CosimError> {
        let wrong = |message: String| CosimError::Setting(vec![message]);
        if !self.node.offered().is_some_and(|i| i.provides_directional_derivatives) {
            let file = self.node.planned.fmu.file().display().to_string();
            return Err(wrong(format!("{file} gives no directional derivatives; take differences of steps")));
        }
        let chosen = |names: &[String]| -> Result<Vec<(u32, Vec<String>)>, CosimError> {
            let mut all = Vec::new();
            for name in names {
                let d = self.node.description();
                let found = self.find(name)?;
                let mut variables: Vec<usize> = found.elements.iter().map(|e| e.0).collect();
                variables.dedup();
                for at in variables {
                    let v = &d.variables[at];
                    all.push((v.value_reference, value::elements(d, v).unwrap_or_default()));
                }
            }
            Ok(all)
        };
        let (of, by) = (chosen(of)?, chosen(by)?);
        let names = |list: &[(u32, Vec<String>)]| -> Vec<String> {
            list.iter().flat_map(|c| c.1.iter().cloned()).collect()
        };
        let unknowns: Vec<u32> = of.iter().map(|c| c.0).collect();
        let mut found = PartialDerivatives { of: names(&of), by: names(&by), values: Vec::new() };
        let (rows, columns) = (found.of.len(), found.by.len());
        found.values = vec![0.0; rows * columns];
        let (mut column, mut at, time) = (vec![0.0; rows], 0, self.time);
        for (reference, elements) in &by {
            for element in 0..elements.len() {
                let mut seed = vec![0.0; elements.len()];
                seed[element] = 1.0;
                let made = self.node.slave.directional(&unknowns, &[*reference], &seed, &mut column);
                made.map_err(|source| CosimError::Call { time, source })?;
                column.iter().enumerate().for_each(|(row, x)| found.values[row * columns + at] = *x);
                at += 1;
            }
        }
        Ok(found)
    }

    /// Ends the run.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn end(mut self) -> Result<(), CosimError> {
        let time = self.time;
        self.node.slave.terminate().map_err(|source| CosimError::Call { time, source })
    }

    fn find(&self, name: &str) -> Result<names::ResolvedName, CosimError> {
        names::find(self.node.description(), name).map_err(|message| CosimError::Setting(vec![message]))
    }

    /// All values of a variable as they are now.
    fn block(&mut self, variable: usize, name: &str) -> Result<VariableBlock, CosimError> {
        let d = self.node.description();
        let v = &d.variables[variable];
        let values = d.elements(v).and_then(|n| ValueBuffer::new(v.kind, d.version, n));
        let values = values.ok_or_else(|| no_number(name))?;
        let mut block = VariableBlock { references: vec![v.value_reference], values };
        let time = self.time;
        self.node.slave.get(&mut block).map_err(|source| CosimError::Call { time, source })?;
        Ok(block)
    }
}

fn no_number(name: &str) -> CosimError {
    CosimError::Setting(vec![format!(
        "`{name}` is no number, so it has no value here; read another variable"
    )])
}

/// Whether a variable may be set between steps.
fn settable(v: &DescriptionVariable, name: &str) -> Result<(), String> {
    match (v.causality, v.variability) {
        (DescriptionCausality::Input, _) => Ok(()),
        (DescriptionCausality::Parameter, DescriptionVariability::Tunable) => Ok(()),
        (DescriptionCausality::Parameter | DescriptionCausality::StructuralParameter, _) => Err(format!(
            "`{name}` stays as it is during a run; give it where the instance is made, as a parameter"
        )),
        _ => Err(format!("`{name}` is calculated; set an input or a tunable parameter")),
    }
}
