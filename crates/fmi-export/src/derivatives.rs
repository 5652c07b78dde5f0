//! Exact partial derivatives by dual numbers.
//!
//! Unknowns: outputs, rates, event indicators; during initialization the initial states too.
//! Knowns: inputs, parameters, time; states except during initialization, when they follow from the parameters.

use crate::duals::{InstanceParts, KnownVariable, NOT_FINITE, UnknownVariable};
use crate::fault::{CallOutcome, discard, error};
use crate::instance::ModelInstance;
use crate::layout::ReferenceTarget;
use crate::model::FmuModel;
use crate::state_machine::{CallGroup, InstanceState};
use trueup_fmi::table::{BoundaryType, LinearFactor, Storage};

/// Element of the dependent, value reference of the independent, element of the independent, the factor where the dependence
/// is linear; elements from 1.
pub type Dependency = (usize, u32, usize, Option<LinearFactor>);

impl<M: FmuModel> ModelInstance<M> {
    fn resolve(&mut self, unknowns: &[u32], knowns: &[u32]) -> CallOutcome {
        let initial = self.memory.state == InstanceState::Initialization;
        let (version, layout) = (self.settings.version, &self.layout);
        let duals = &mut self.duals;
        duals.unknowns.clear();
        duals.knowns.clear();
        for reference in unknowns {
            let r = match layout.find(version, *reference)? {
                ReferenceTarget::Indicator(i) => {
                    duals.unknowns.push(UnknownVariable::Indicator(i));
                    continue;
                }
                ReferenceTarget::Variable(r) => r,
            };
            let v = layout.variable(r.variable);
            for i in r.first..r.first + r.len {
                duals.unknowns.push(match (v.storage, v.kind) {
                    (Storage::Output(b), BoundaryType::Real) => UnknownVariable::Output(b + i),
                    (Storage::Rate(b), BoundaryType::Real) => UnknownVariable::Rate(b + i),
                    (Storage::State(b), BoundaryType::Real) if initial => UnknownVariable::State(b + i),
                    _ => {
                        return error(format!(
                            "`{}` is no unknown here: take outputs and derivatives of states that are real numbers{}",
                            v.element_name(i),
                            if initial { ", or initial states" } else { "" }
                        ));
                    }
                });
            }
        }
        for reference in knowns {
            let ReferenceTarget::Variable(r) = layout.find(version, *reference)? else {
                return error("an event indicator is an unknown, no known");
            };
            let v = layout.variable(r.variable);
            for i in r.first..r.first + r.len {
                duals.knowns.push(match (v.storage, v.kind) {
                    (Storage::Time, _) => KnownVariable::Time,
                    (Storage::State(b), BoundaryType::Real) if !initial => KnownVariable::State(b + i),
                    (Storage::Input(b), BoundaryType::Real) => KnownVariable::Input(b + i),
                    (Storage::Parameter(b), BoundaryType::Real) => KnownVariable::Parameter(b + i),
                    _ => {
                        return error(format!(
                            "`{}` is no known here: take inputs, parameters and time{}, if they are real numbers",
                            v.element_name(i),
                            if initial { "" } else { " or states" }
                        ));
                    }
                });
            }
        }
        Ok(())
    }

    /// sensitivity = (d unknowns / d knowns) seed, element by element of arrays.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> CallOutcome {
        self.prepare(unknowns, knowns, seed)?;
        self.expect_len(self.duals.knowns.len(), seed.len())?;
        self.expect_len(self.duals.unknowns.len(), sensitivity.len())?;
        let (m, d) = (&self.memory, &mut self.duals);
        d.workspace.load(self.layout.sizes, m.t, &m.x, &m.u, &m.p);
        for (k, s) in d.knowns.iter().zip(seed) {
            d.workspace.known(*k).eps[0] += s;
        }
        let parts = InstanceParts {
            model: &*self.model,
            layout: &self.layout,
            set: &m.set,
            modes: &m.modes,
            initial: m.state == InstanceState::Initialization,
        };
        d.workspace.sweep(&parts, &d.unknowns);
        d.results(sensitivity)
    }

    /// sensitivity = (d unknowns / d knowns)^T seed, by one forward sweep a known.
    pub fn adjoint_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> CallOutcome {
        self.prepare(unknowns, knowns, seed)?;
        self.expect_len(self.duals.unknowns.len(), seed.len())?;
        self.expect_len(self.duals.knowns.len(), sensitivity.len())?;
        let (m, d) = (&self.memory, &mut self.duals);
        let parts = InstanceParts {
            model: &*self.model,
            layout: &self.layout,
            set: &m.set,
            modes: &m.modes,
            initial: m.state == InstanceState::Initialization,
        };
        for (out, k) in sensitivity.iter_mut().zip(&d.knowns) {
            d.workspace.load(self.layout.sizes, m.t, &m.x, &m.u, &m.p);
            d.workspace.known(*k).eps[0] = 1.0;
            d.workspace.sweep(&parts, &d.unknowns);
            *out = d.unknowns.iter().zip(seed).map(|(k, s)| s * d.workspace.unknown(*k).eps[0]).sum();
        }
        if sensitivity.iter().any(|s| !s.is_finite()) {
            return discard(NOT_FINITE);
        }
        Ok(())
    }

    fn prepare(&mut self, unknowns: &[u32], knowns: &[u32], seed: &[f64]) -> CallOutcome {
        self.permit(CallGroup::Derivatives)?;
        if let Some(i) = seed.iter().position(|s| !s.is_finite()) {
            return error(format!("seed {} is {}: it must be a finite number", i + 1, seed[i]));
        }
        self.ready()?;
        self.resolve(unknowns, knowns)
    }

    /// Time derivatives of outputs along the flow, with the slopes of the inputs; order 1 only.
    pub fn output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> CallOutcome {
        self.permit(CallGroup::OutputDerivatives)?;
        if let Some(order) = orders.iter().find(|o| **o != 1) {
            return error(format!("output derivative of order {order}: only order 1 is offered"));
        }
        for reference in references {
            let target = self.layout.find(self.settings.version, *reference)?;
            let output = match target {
                ReferenceTarget::Variable(r) => {
                    let v = self.layout.variable(r.variable);
                    matches!((v.storage, v.kind), (Storage::Output(_), BoundaryType::Real))
                        .then_some(())
                        .ok_or(&v.name)
                }
                ReferenceTarget::Indicator(_) => Err(&self.layout.table.name),
            };
            if let Err(name) = output {
                return error(format!("`{name}` is no continuous output: it has no output derivative"));
            }
        }
        self.evaluate_rates()?;
        self.resolve(references, &[])?;
        self.expect_len(self.duals.unknowns.len(), values.len())?;
        let (m, d) = (&self.memory, &mut self.duals);
        d.workspace.load(self.layout.sizes, m.t, &m.x, &m.u, &m.p);
        d.workspace.t.eps[0] = 1.0;
        d.workspace.x.iter_mut().zip(&self.cache.dx).for_each(|(x, dx)| x.eps[0] = *dx);
        d.workspace.u.iter_mut().zip(&m.slopes).for_each(|(u, slope)| u.eps[0] = *slope);
        let parts = InstanceParts {
            model: &*self.model,
            layout: &self.layout,
            set: &m.set,
            modes: &m.modes,
            initial: false,
        };
        d.workspace.sweep(&parts, &d.unknowns);
        d.results(values)
    }

    /// What a variable depends on, element by element.
    pub fn dependencies(&self, dependent: u32) -> CallOutcome<Vec<Dependency>> {
        self.permit(CallGroup::Any)?;
        let mut found = Vec::new();
        let knowns = || {
            let table = &self.layout.table;
            table.variables.iter().filter(|v| matches!(v.storage, Storage::State(_) | Storage::Input(_)))
        };
        match self.layout.find(self.settings.version, dependent)? {
            ReferenceTarget::Indicator(_) => {
                found.extend(knowns().flat_map(|k| (1..=k.len()).map(|j| (1, k.value_reference, j, None))));
            }
            ReferenceTarget::Variable(r) => {
                let v = self.layout.variable(r.variable);
                if !matches!(v.storage, Storage::Output(_) | Storage::Rate(_)) {
                    return Ok(found);
                }
                for (i, k) in (0..v.len()).flat_map(|i| knowns().map(move |k| (i, k))) {
                    let elements = (0..k.len()).filter(|j| self.layout.depends(v, i, k, *j));
                    let factor = v.depends.factor(&k.name);
                    found.extend(elements.map(|j| (i + 1, k.value_reference, j + 1, factor)));
                }
            }
        }
        Ok(found)
    }
}
