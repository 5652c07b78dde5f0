//! Which steps an FMU in Co-Simulation is given, and how it follows its inputs within them
//! ([decision 0030](../../../docs/decisions/0030-steps-as-asked-for.md)).

use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, DescriptionVariable,
    InterfaceCapabilities as Offered, VariableType,
};
use trueup_numerics::ShortNumber;

use crate::grid;
use crate::plan::{MasterPlan, PlannedComponent};
use crate::system::{Algorithm, ComponentInterface};

/// Where on their lines inputs are held in each part of a step, as a part of the step: so held, they have the moments of
/// order 0, 1 and 2 of the line, and act on a smooth system as the line does but for the fifth order of the step.
static PARTS: [f64; 2] = [1.0 / 6.0, 5.0 / 6.0];
/// A whole step with the mean of the line: of second order.
static MIDDLE: [f64; 1] = [0.5];
/// A whole step with the values at its start.
static START: [f64; 1] = [0.0];
/// Part of a number of internal steps that is rounding.
const ROUNDING: f64 = 1e-6;

/// How an FMU follows its inputs on lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum InputFollowing {
    /// FMI 2.0, `canInterpolateInputs`: `fmi2SetRealInputDerivatives`.
    Derivatives,
    /// FMI 3.0, `providesIntermediateUpdate`: it requests inputs within its steps.
    Intermediate,
    /// The step in as many parts as there are places of the step (0 to 1); at each the inputs are held over its part.
    Held(&'static [f64]),
}

/// The steps of one FMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StepRule {
    /// How it follows inputs.
    pub(crate) way: InputFollowing,
    /// The shortest part of a communication step that it may be given, in s; infinite: none.
    shortest: f64,
    /// `fixedInternalStepSize` in s: whole multiples of it only.
    internal: Option<f64>,
}

impl StepRule {
    /// Of a component of a plan; `None`: it is integrated by the master.
    pub(crate) fn of(component: &PlannedComponent, plan: &MasterPlan) -> Option<Self> {
        let offered = component.description().co_simulation.as_ref();
        let offered = offered.filter(|_| component.interface == ComponentInterface::CoSimulation)?;
        let step = plan.grid.step * f64::from(component.every);
        // A request for lines includes the parts that they require.
        let asked = plan.algorithm.is_some_and(|a| a != Algorithm::Jacobi);
        Some(Self::new(component.description(), offered, step, asked))
    }

    fn new(d: &Description, offered: &Offered, step: f64, asked: bool) -> Self {
        let default = d.experiment.step_size.filter(|h| *h > 0.0);
        let stored = offered.can_get_and_set_fmu_state;
        let updates = offered.provides_intermediate_update;
        let declared = match d.version {
            FmiVersion::V2 if stored && offered.can_interpolate_inputs => Some(0.0),
            FmiVersion::V2 => default.filter(|_| stored),
            FmiVersion::V3 => {
                let stops = offered.might_return_early_from_do_step
                    || offered.can_return_early_after_intermediate_update;
                (offered.has_event_mode || stops || updates).then_some(0.0)
            }
        };
        let shortest = if asked { Some(0.0) } else { declared };
        let variable = offered.can_handle_variable_communication_step_size;
        let shortest_or_none = shortest.filter(|_| variable).unwrap_or(f64::INFINITY);
        let mut rule = Self {
            way: InputFollowing::Held(&START),
            shortest: shortest_or_none,
            internal: internal_step(offered),
        };
        let inputs = || d.variables.iter().filter(|v| is_continuous_input(v));
        rule.way = match d.version {
            FmiVersion::V2 if offered.can_interpolate_inputs => InputFollowing::Derivatives,
            // An FMU that requests its inputs holds them over its next internal step, of unknown length: first order. So parts
            // come before intermediate updates.
            _ if rule.allows(step / PARTS.len() as f64) => InputFollowing::Held(&PARTS),
            FmiVersion::V3 if updates && inputs().all(|v| v.intermediate_update) => {
                InputFollowing::Intermediate
            }
            // With states that are continuous it is no sampler, which would take the middle of a line for a measurement.
            _ if shortest.is_some() || !d.structure.derivatives.is_empty() => InputFollowing::Held(&MIDDLE),
            _ => InputFollowing::Held(&START),
        };
        rule
    }

    /// It may be given a step of this length (s) where a longer one was requested.
    pub(crate) fn allows(&self, part: f64) -> bool {
        part >= self.shortest * (1.0 - ROUNDING) && self.internal.is_none_or(|h| is_multiple(part, h))
    }

    /// It may be given steps of any length.
    pub(crate) fn allows_any(&self) -> bool {
        self.shortest == 0.0 && self.internal.is_none()
    }

    /// Its inputs are samples: its inputs are held as they are, its outputs too.
    pub(crate) fn samples(&self) -> bool {
        self.way == InputFollowing::Held(&START)
    }

    /// It follows inputs from a file within a step.
    pub(crate) fn follows(&self) -> bool {
        !matches!(self.way, InputFollowing::Held([_]))
    }

    /// Where inputs are held in a step of this length (s), while they move: a short one, at the end of a run, may not come in parts.
    pub(crate) fn places(&self, step: f64) -> &'static [f64] {
        match self.way {
            InputFollowing::Held(places @ [_, _, ..]) if self.allows(step / places.len() as f64) => places,
            InputFollowing::Held(places @ [_]) => places,
            _ => &MIDDLE,
        }
    }

    /// Its steps are made in parts.
    pub(crate) fn splits(&self) -> bool {
        matches!(self.way, InputFollowing::Held([_, _, ..]))
    }

    /// In words.
    pub(crate) fn words(&self) -> &'static str {
        match self.way {
            InputFollowing::Derivatives => "inputs on lines by their derivatives",
            InputFollowing::Intermediate => "inputs on lines by intermediate updates",
            InputFollowing::Held([_, _, ..]) => "inputs on lines, held in each part of a step",
            _ if self.samples() => "inputs held",
            InputFollowing::Held(_) => "inputs held at the middle of their lines",
        }
    }
}

pub(crate) fn is_continuous_input(v: &DescriptionVariable) -> bool {
    v.causality == DescriptionCausality::Input
        && v.kind == VariableType::Float64
        && v.variability == DescriptionVariability::Continuous
}

/// `fixedInternalStepSize` in s.
pub(crate) fn internal_step(offered: &Offered) -> Option<f64> {
    offered.fixed_internal_step_size.filter(|h| *h > 0.0)
}

/// `step` is a whole multiple of `internal`, at least one (both in s).
pub(crate) fn is_multiple(step: f64, internal: f64) -> bool {
    let n = step / internal;
    n > 0.5 && (n - n.round()).abs() <= ROUNDING * n.max(1.0)
}

/// Why communication steps of `step` s over `span` s, the last one shorter where it has to be, are none for this FMU, and the
/// remedy; `None`: they are.
pub(crate) fn refusal(offered: &Offered, step: f64, span: f64) -> Option<String> {
    let rest = span - (span / step + grid::ROUNDING).floor() * step;
    let even = rest.abs() <= grid::ROUNDING * step;
    if let Some(h) = internal_step(offered) {
        let internal = ShortNumber(h);
        if !is_multiple(step, h) {
            let below = (step / h).floor();
            let near = [below, below + 1.0].map(|n| n * h).into_iter().filter(|s| *s > 0.0);
            let near: Vec<_> = near.map(|s| format!("{} s", ShortNumber(s))).collect();
            return Some(format!(
                "takes internal steps of {internal} s (fixedInternalStepSize), of which {} s is no whole multiple; choose a step of {}",
                ShortNumber(step),
                near.join(" or ")
            ));
        }
        if !even && !is_multiple(rest, h) {
            return Some(format!(
                "takes internal steps of {internal} s (fixedInternalStepSize), which do not divide the {} s of the run; choose another stop",
                ShortNumber(span)
            ));
        }
    }
    (!offered.can_handle_variable_communication_step_size && !even).then(|| {
        format!(
            "takes steps of equal length only, and {} s does not divide {} s; choose another step or stop",
            ShortNumber(step),
            ShortNumber(span)
        )
    })
}
