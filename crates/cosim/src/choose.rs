//! Which algorithm runs a system, and why.

use crate::error::Error;
use crate::graph;
use crate::plan::{Plan, Planned};
use crate::stepper::Way;
use crate::system::{Algorithm, Interface};

/// What steps as one: each FMU in Co-Simulation, all in Model Exchange together.
pub(crate) fn units(components: &[Planned]) -> Vec<Vec<usize>> {
    let mut units: Vec<Vec<usize>> = Vec::new();
    let mut group: Option<usize> = None;
    for (i, c) in components.iter().enumerate() {
        match (c.interface, group) {
            (Interface::CoSimulation, _) => units.push(vec![i]),
            (Interface::ModelExchange, Some(at)) => units[at].push(i),
            (Interface::ModelExchange, None) => {
                group = Some(units.len());
                units.push(vec![i]);
            }
        }
    }
    units
}

/// The units in the order in which they hand on values, those of a circle in their own order; whether there are
/// connections between units at all, and whether there is a circle.
pub(crate) fn order(plan: &Plan, units: &[Vec<usize>]) -> (Vec<usize>, bool, bool) {
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

/// The algorithm and the reason in words.
///
/// # Errors
/// [`Error::Setting`]: one was asked for that the FMUs cannot follow.
pub(crate) fn choose(plan: &Plan) -> Result<(Algorithm, String), Error> {
    let units = units(&plan.components);
    let rigid: Vec<&str> = plan
        .components
        .iter()
        .filter(|c| c.interface == Interface::CoSimulation)
        .filter(|c| !c.description().co_simulation.as_ref().is_some_and(|i| i.can_get_and_set_fmu_state))
        .map(|c| c.name.as_str())
        .collect();
    if let Some(algorithm) = plan.algorithm {
        if matches!(algorithm, Algorithm::Iterative | Algorithm::Adaptive) && !rigid.is_empty() {
            return Err(Error::Setting(vec![format!(
                "the algorithm {algorithm} repeats steps, but the FMUs of {} cannot store and restore their state; \
                 choose extrapolate, which needs no repetition",
                crate::mistake::quoted(&rigid)
            )]));
        }
        return Ok((algorithm, "as asked for".into()));
    }
    let (_, coupled, circle) = order(plan, &units);
    let ways = plan.components.iter().map(|c| (c, Way::of(c.description())));
    let lines = plan.driven.iter().any(|d| d.linear);
    if !coupled {
        let native = plan.driven.iter().filter(|d| d.linear).all(|d| {
            let c = &plan.components[d.to.component];
            c.interface == Interface::ModelExchange || Way::of(c.description()) != Way::Parts(1)
        });
        return Ok(match (lines, native) {
            (true, true) => (
                Algorithm::Extrapolate,
                "inputs from the file are followed on lines; nothing is coupled, so nothing is extrapolated"
                    .into(),
            ),
            (true, false) => (
                Algorithm::Jacobi,
                "nothing is coupled, and the FMU cannot follow inputs within a step: they are held".into(),
            ),
            (false, _) => (Algorithm::Jacobi, "nothing is coupled".into()),
        });
    }
    if !circle {
        return Ok((
            Algorithm::GaussSeidel,
            "values are handed on in one direction only: each FMU steps when its inputs over the step are known".into(),
        ));
    }
    let parts: Vec<&str> = ways
        .filter(|(c, way)| c.interface == Interface::CoSimulation && !way.is_native())
        .map(|(c, _)| c.name.as_str())
        .collect();
    let how = if parts.is_empty() {
        "all FMUs follow inputs on lines".to_owned()
    } else {
        format!("{}: no lines within a step, so each step is made in parts", crate::mistake::quoted(&parts))
    };
    Ok((
        Algorithm::Extrapolate,
        format!(
            "values go round in a circle; inputs extrapolated on lines are of second order without repeating steps; {how}"
        ),
    ))
}
