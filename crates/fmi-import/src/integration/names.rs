//! Names of states and event indicators, for messages.

use trueup_fmi_description::description::Description;
use trueup_plant::elements;

use super::{Failure, Fmus, IntegratedGroup};

/// Name of an element of a variable.
fn element(d: &Description, variable: usize, element: usize) -> String {
    let v = &d.variables[variable];
    let names = d.lengths(v).map(|lengths| elements(&v.name, &lengths)).unwrap_or_default();
    names.into_iter().nth(element).unwrap_or_else(|| v.name.clone())
}

/// Name of a state or its derivative.
fn state_name(d: &Description, mut at: usize, derivative: bool) -> String {
    let variables = d.structure.derivatives.iter().map(|u| d.resolve(u.reference));
    for rate in variables.map_while(|at| at) {
        let n = d.elements(&d.variables[rate]).unwrap_or(usize::MAX);
        if at >= n {
            at -= n;
            continue;
        }
        let state = d.variables[rate].derivative.and_then(|r| d.resolve(r));
        return match (derivative, state) {
            (false, Some(state)) => element(d, state, at),
            (false, None) => format!("the state behind {}", element(d, rate, at)),
            (true, _) => element(d, rate, at),
        };
    }
    format!("{} {}", if derivative { "derivative" } else { "state" }, at + 1)
}

/// Name of an event indicator.
fn indicator_name(d: &Description, mut at: usize) -> String {
    let variables = d.structure.event_indicators.iter().map(|u| d.resolve(u.reference));
    for indicator in variables.map_while(|at| at) {
        let n = d.elements(&d.variables[indicator]).unwrap_or(usize::MAX);
        if at < n {
            return format!("event indicator {}", element(d, indicator, at));
        }
        at -= n;
    }
    format!("event indicator {}", at + 1)
}

impl IntegratedGroup {
    /// The FMU and the name of an indicator.
    pub(super) fn indicator<F: Fmus + ?Sized>(&self, fmus: &F, i: usize) -> (Option<usize>, String) {
        let member = self.members.iter().position(|m| m.indicators.contains(&i));
        let name = |at: usize| indicator_name(fmus.description(at), i - self.members[at].indicators.start);
        (member, member.map(name).unwrap_or_default())
    }

    pub(super) fn bad_indicator<F: Fmus + ?Sized>(&self, fmus: &mut F, i: usize) -> Failure<F::Error> {
        let (member, variable) = self.indicator(fmus, i);
        let (instance, log) = match member.map(|at| fmus.instance(at)) {
            Some(instance) => (instance.name().to_owned(), instance.log()),
            None => (String::new(), Vec::new()),
        };
        Failure::NotFinite { time: self.time, instance, variable, value: f64::NAN, log }
    }

    /// A state or its derivative that is not finite.
    pub(super) fn not_finite<F: Fmus + ?Sized>(
        &self,
        fmus: &mut F,
        at: usize,
        derivative: bool,
        value: f64,
    ) -> Failure<F::Error> {
        let time = self.time;
        let Some(member) = self.members.iter().position(|m| m.states.contains(&at)) else {
            return Failure::NoDerivative { time, reason: "its derivatives along the way are not finite" };
        };
        let variable =
            state_name(fmus.description(member), at - self.members[member].states.start, derivative);
        let instance = fmus.instance(member);
        Failure::NotFinite {
            time,
            instance: instance.name().to_owned(),
            variable,
            value,
            log: instance.log(),
        }
    }

    /// Names of all instances.
    pub(super) fn instances<F: Fmus + ?Sized>(&self, fmus: &mut F) -> Vec<String> {
        (0..self.members.len()).map(|at| fmus.instance(at).name().to_owned()).collect()
    }
}
