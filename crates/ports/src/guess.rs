//! A first `ports.toml`: by units, declared and measured derivatives, reciprocity, and names where these leave a choice.

mod bodies;
mod joints;

use trueup_numerics::ShortNumber;
use trueup_signals::base_name;

use crate::conjugate::{ConjugatePair, conjugates};
use crate::experiment::{Experiment, SensitivityRows};
use crate::kind::PortKind;
use crate::quantity::FmuQuantities;
use crate::roles::{FmuPorts, PortFigure, PortPlace, PortRole, PortSensor, PortVariable};
use crate::words::{self, NamedSite, affinity};

/// dL/dt per torque is 1 for a torque from outside, within this.
const WHOLE: f64 = 1e-3;

struct PortsDraft<'a> {
    e: &'a Experiment,
    all: &'a FmuQuantities,
    pairs: Vec<ConjugatePair>,
    ports: FmuPorts,
}

/// Drafts the ports of an FMU of this file name.
pub fn guess(e: &Experiment, all: &FmuQuantities, fmu: &str) -> FmuPorts {
    let (pairs, whole) = conjugates(e, all);
    let mut draft =
        PortsDraft { e, all, pairs, ports: FmuPorts { fmu: fmu.to_owned(), ..FmuPorts::default() } };
    if !whole {
        draft.ports.open.push(
            "velocities of inputs: there are too many assignments to try them all; compare them".into(),
        );
    }
    let bodies = draft.bodies();
    draft.joints(&bodies);
    draft.open_inputs();
    draft.sensors();
    draft.ports
}

/// Six digits are enough for a reason.
pub(crate) fn short(x: f64) -> String {
    ShortNumber(format!("{x:.3e}").parse().unwrap_or(x)).to_string()
}

impl PortsDraft<'_> {
    fn input(&self, j: usize) -> &str {
        &self.all.inputs[j].name
    }
    fn output(&self, k: usize) -> &str {
        &self.all.outputs[k].name
    }
    fn mobility(&self) -> &SensitivityRows {
        &self.e.mobilities[0]
    }
    fn pair(&self, input: usize) -> Option<&ConjugatePair> {
        self.pairs.iter().find(|p| p.input == input)
    }

    /// The output whose derivative is `v`, and the difference.
    fn angle_of(&self, v: usize) -> Option<(usize, f64)> {
        let kind = self.all.outputs[v].kind;
        let angle = |q: &usize| self.all.outputs[*q].kind.derivative() == Some(kind);
        let error = |q: usize| {
            Some((q, self.e.derivative_error(q, v).filter(|e| *e < self.e.derivative_tolerance())?))
        };
        let name = |q: usize| affinity(self.output(q), self.output(v));
        (0..self.all.outputs.len()).filter(angle).filter_map(error).max_by(|a, b| {
            // Angles that are equal are chosen by name, others by the difference.
            match self.e.same(a.0, b.0) {
                true => name(a.0).total_cmp(&name(b.0)),
                false => b.1.total_cmp(&a.1),
            }
        })
    }

    /// Where names of an input and its velocity suggest that it is.
    fn site(&self, input: usize) -> Option<NamedSite> {
        let velocity = || words::site(self.output(self.pair(input)?.output));
        words::site(self.input(input)).or_else(velocity)
    }

    /// Torques that change the angular momentum of the whole by themselves act from outside: all elements of one variable, or none.
    fn is_from_outside(&self, input: usize) -> bool {
        let rows =
            || (0..self.all.outputs.len()).filter(|k| self.all.outputs[*k].kind == PortKind::AngularMomentum);
        let whole = |j: usize| {
            let square: f64 = rows().map(|k| self.mobility()[k][j].powi(2)).sum();
            (square.sqrt() - 1.0).abs() < WHOLE
        };
        let of = base_name(self.input(input));
        let mut siblings = (0..self.all.inputs.len()).filter(|j| base_name(self.input(*j)) == of);
        self.all.inputs[input].kind == PortKind::Torque && siblings.all(whole)
    }

    fn put(&mut self, place: &PortPlace, role: PortRole, variable: String, reason: String) {
        self.ports.variables.push(PortVariable { place: place.clone(), role, variable, reason, line: 0 });
    }
    fn figure(&mut self, place: &PortPlace, key: &'static str, value: f64, reason: String) {
        self.ports.figures.push(PortFigure { place: place.clone(), key, value, reason });
    }

    /// Unit, or that there is none.
    fn by(&self, unit: &str, by_name: bool) -> String {
        if by_name { "by name, it has no unit".into() } else { format!("unit {unit}") }
    }

    fn conjugate_reason(&self, pair: &ConjugatePair) -> String {
        let rate = self.mobility()[pair.output][pair.input];
        let unit = &self.all.inputs[pair.input].unit;
        let per = if unit.is_empty() { "unit" } else { unit };
        let others: Vec<&str> = pair.others.iter().map(|k| self.output(*k)).collect();
        let but = match others.is_empty() {
            true => String::new(),
            false => format!("; {} would do as well", others.join(", ")),
        };
        format!("conjugate to {}: {} SI per {per} at once{but}", self.input(pair.input), short(rate))
    }

    /// Inputs that no port takes, with what was seen.
    fn open_inputs(&mut self) {
        let mut open = Vec::new();
        for (j, q) in self.all.inputs.iter().enumerate() {
            let taken = self.ports.variables.iter().any(|v| v.variable == q.name);
            if taken
                || !crate::experiment::effort(q)
                || self.ports.open.iter().any(|o| o.contains(&format!("`{}`", q.name)))
            {
                continue;
            }
            open.push(match (self.e.amplitudes[j], self.pair(j)) {
                (None, _) => format!(
                    "input `{}` accelerates no output: it may act through a state, or on none",
                    q.name
                ),
                (_, None) => format!("input `{}`: no output is its velocity", q.name),
                _ => format!("input `{}`: its place cannot be known", q.name),
            });
        }
        if self.ports.variables.is_empty() {
            let why = match self.pairs.is_empty() {
                true => "no torque, force or current among the inputs accelerates an output at once",
                false => "what is open above leaves none",
            };
            open.push(format!("no joint and no body is drafted: {why}"));
        }
        self.ports.open.extend(open);
    }

    fn sensors(&mut self) {
        let kind = |kind| {
            Some(match kind {
                PortKind::Angle => "encoder",
                PortKind::AngularVelocity => "tachometer",
                PortKind::AngularAcceleration | PortKind::Acceleration => "accelerometer",
                PortKind::Torque => "torque",
                PortKind::Force => "force",
                PortKind::Position => "position",
                PortKind::Velocity => "velocity",
                PortKind::Current => "current",
                _ => return None,
            })
        };
        let sensor = |q: &crate::quantity::FmuQuantity| {
            Some(PortSensor { variable: q.name.clone(), kind: kind(q.kind)?.into(), line: 0 })
        };
        self.ports.sensors = self.all.outputs.iter().filter_map(sensor).collect();
    }
}
