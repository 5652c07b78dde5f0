//! Which algorithm runs a system, and why.

use crate::error::CosimError;
use crate::graph;
use crate::mistake::quoted;
use crate::plan::{DrivenInput, LinearLink, MasterPlan, PlannedComponent};
use crate::step_rule::StepRule;
use crate::system::{Algorithm, ComponentInterface};

/// What steps as one: each FMU in Co-Simulation, all in Model Exchange together.
pub(crate) fn units(components: &[PlannedComponent]) -> Vec<Vec<usize>> {
    let mut units: Vec<Vec<usize>> = Vec::new();
    let mut group: Option<usize> = None;
    for (i, c) in components.iter().enumerate() {
        match (c.interface, group) {
            (ComponentInterface::CoSimulation, _) => units.push(vec![i]),
            (ComponentInterface::ModelExchange, Some(at)) => units[at].push(i),
            (ComponentInterface::ModelExchange, None) => {
                group = Some(units.len());
                units.push(vec![i]);
            }
        }
    }
    units
}

/// The units in the order in which they hand on values, those of a circle in their own order; whether there are
/// connections between units at all, and whether there is a circle.
pub(crate) fn order(plan: &MasterPlan, units: &[Vec<usize>]) -> (Vec<usize>, bool, bool) {
    let mut unit = vec![0; plan.components.len()];
    units.iter().enumerate().for_each(|(u, nodes)| nodes.iter().for_each(|n| unit[*n] = u));
    let mut edges = vec![Vec::new(); units.len()];
    for link in &plan.links {
        let (from, to) = (unit[link.from.component], unit[link.to.component]);
        if from != to && !edges[from].contains(&to) {
            edges[from].push(to);
        }
    }
    let components = graph::components(&edges);
    let circle = components.iter().any(|c| c.len() > 1);
    (components.concat(), edges.iter().any(|e| !e.is_empty()), circle)
}

/// The algorithm and the reason in words. `rules`: of each component, `None` of those in Model Exchange.
///
/// # Errors
/// [`CosimError::Setting`]: one was requested that the FMUs cannot follow.
pub(crate) fn choose(
    plan: &MasterPlan,
    rules: &[Option<StepRule>],
) -> Result<(Algorithm, String), CosimError> {
    let units = units(&plan.components);
    let rigid: Vec<&str> = plan
        .components
        .iter()
        .filter(|c| c.interface == ComponentInterface::CoSimulation)
        .filter(|c| !c.description().co_simulation.as_ref().is_some_and(|i| i.can_get_and_set_fmu_state))
        .map(|c| c.name.as_str())
        .collect();
    if let Some(algorithm) = plan.algorithm {
        if matches!(algorithm, Algorithm::Iterative | Algorithm::Adaptive) && !rigid.is_empty() {
            return Err(CosimError::Setting(vec![format!(
                "the algorithm {algorithm} repeats steps, but the FMUs of {} cannot store and restore their state; \
                 choose extrapolate, which needs no repetition",
                quoted(&rigid)
            )]));
        }
        return Ok((algorithm, "as requested".into()));
    }
    let (_, coupled, circle) = order(plan, &units);
    let samples = |component: usize| rules[component].is_some_and(|rule| rule.samples());
    if !coupled {
        let lines = || plan.driven.iter().filter(|d| d.linear);
        let follows = |d: &DrivenInput| rules[d.to.component].is_none_or(|rule| rule.follows());
        return Ok(if lines().any(follows) {
            let reason =
                "inputs from the file are followed on lines; nothing is coupled, so nothing is extrapolated";
            (Algorithm::Extrapolate, reason.into())
        } else if lines().next().is_some() {
            let reason = "nothing is coupled, and the FMU does not declare that it follows inputs within a step: they are held";
            (Algorithm::Jacobi, reason.into())
        } else {
            (Algorithm::Jacobi, "nothing is coupled".into())
        });
    }
    // What samples has neither inputs nor outputs on lines; what the master integrates needs none.
    let integrated = |l: &LinearLink| rules[l.from.component].is_none() && rules[l.to.component].is_none();
    let mut outer = plan.links.iter().filter(|l| !integrated(l));
    if outer.all(|l| samples(l.from.component) || samples(l.to.component))
        && !plan.driven.iter().any(|d| d.linear && !samples(d.to.component))
    {
        let reason = "no two FMUs that are connected declare that they can be followed within a step (event mode, early return, intermediate update, \
                      input derivatives, FMU state with a default step, continuous states): inputs are held";
        return Ok((Algorithm::Jacobi, reason.into()));
    }
    let held = names(plan, samples);
    let held = if held.is_empty() {
        String::new()
    } else {
        format!("; {}: whole steps, inputs and outputs held", quoted(&held))
    };
    if !circle {
        let reason = "values are handed on in one direction only: each FMU steps when its inputs over the step are known";
        return Ok((Algorithm::GaussSeidel, format!("{reason}{held}")));
    }
    let parts = names(plan, |i| rules[i].is_some_and(|rule| rule.splits()));
    let parts = if parts.is_empty() {
        String::new()
    } else {
        format!("; {}: no lines within a step, so each step is made in parts", quoted(&parts))
    };
    let reason = "values go round in a circle; inputs extrapolated on lines are of second order without repeating steps";
    Ok((Algorithm::Extrapolate, format!("{reason}{parts}{held}")))
}

/// Of the components of which this holds.
fn names(plan: &MasterPlan, holds: impl Fn(usize) -> bool) -> Vec<&str> {
    plan.components.iter().enumerate().filter(|(i, _)| holds(*i)).map(|(_, c)| c.name.as_str()).collect()
}
