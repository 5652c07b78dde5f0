//! Ports against what the FMU does: each check with its figure.

use crate::conjugate::asymmetry;
use crate::experiment::{DirectionalComparison, Experiment};
use crate::guess::short;
use crate::kind::PortKind;
use crate::quantity::FmuQuantities;
use crate::roles::{FmuPorts, PortPlace, PortRole};

/// Outcome of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PortOutcome {
    /// The experiment agrees.
    Holds,
    /// It contradicts.
    Contradicted,
    /// It shows nothing.
    Open,
}

impl PortOutcome {
    /// In reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Contradicted => "contradicted",
            Self::Open => "open",
        }
    }
}

/// One check.
#[derive(Clone, Debug, PartialEq)]
pub struct PortCheck {
    /// Of a place, or of the FMU.
    pub place: Option<PortPlace>,
    /// Its name.
    pub check: &'static str,
    /// The outcome.
    pub outcome: PortOutcome,
    /// Its figure.
    pub figure: Option<f64>,
    /// In a sentence.
    pub text: String,
}

/// A gear ratio that differs by more is another one.
const RATIO: f64 = 0.05;
/// One row in so many may be at a kink.
const KINKS: usize = 4;

/// Name of the check that a joint is rigid.
pub(crate) const ONE_COORDINATE: &str = "one coordinate";

struct ChecksOfPorts<'a> {
    ports: &'a FmuPorts,
    all: &'a FmuQuantities,
    e: &'a Experiment,
    found: Vec<PortCheck>,
}

/// All checks of these ports.
pub fn checks(ports: &FmuPorts, all: &FmuQuantities, e: &Experiment) -> Vec<PortCheck> {
    let mut c = ChecksOfPorts { ports, all, e, found: Vec::new() };
    for place in ports.places() {
        match &place {
            PortPlace::Joint(_) => c.joint(&place),
            _ => c.body(&place),
        }
    }
    c.reciprocity();
    c.fmu();
    c.found
}

/// Checks of a place that contradict.
pub fn contradicted<'a>(
    checks: &'a [PortCheck],
    place: &'a PortPlace,
) -> impl Iterator<Item = &'a PortCheck> {
    checks.iter().filter(move |c| c.outcome == PortOutcome::Contradicted && c.place.as_ref() == Some(place))
}

impl ChecksOfPorts<'_> {
    fn add(
        &mut self,
        place: Option<&PortPlace>,
        check: &'static str,
        outcome: PortOutcome,
        figure: Option<f64>,
        text: String,
    ) {
        self.found.push(PortCheck {
            place: place.cloned(),
            check,
            outcome,
            figure: figure.filter(|f| f.is_finite()),
            text,
        });
    }

    fn output(&self, place: &PortPlace, role: PortRole) -> Option<usize> {
        self.all.output(&self.ports.variable(place, role)?.variable)
    }

    fn joint(&mut self, place: &PortPlace) {
        let drive = self.ports.drive(place).and_then(|v| self.all.input(&v.variable));
        let velocity = self.output(place, PortRole::MotorVelocity);
        if let (Some(j), Some(v)) = (drive, velocity) {
            self.accelerates(place, j, v);
        }
        let external =
            self.ports.variable(place, PortRole::ExternalTorque).and_then(|v| self.all.input(&v.variable));
        let link = self.output(place, PortRole::LinkVelocity);
        if let (Some(j), Some(v)) = (external, link) {
            self.accelerates(place, j, v);
        }
        self.derivative(place, self.output(place, PortRole::MotorAngle), velocity);
        self.derivative(place, self.output(place, PortRole::LinkAngle), link);
        self.gear(place, drive);
        self.torque_constant(place, drive);
    }

    fn body(&mut self, place: &PortPlace) {
        let pairs = [
            (PortRole::BodyForce, PortRole::BodyVelocity, PortRole::BodyPosition),
            (PortRole::BodyTorque, PortRole::BodyRate, PortRole::BodyAttitude),
        ];
        for (effort, velocity, position) in pairs {
            let names = |role| self.ports.list(place, role).map(|v| v.variable.clone()).collect::<Vec<_>>();
            let inputs: Vec<Option<usize>> = names(effort).iter().map(|n| self.all.input(n)).collect();
            let outputs = |role| names(role).iter().map(|n| self.all.output(n)).collect::<Vec<_>>();
            let (velocities, positions) = (outputs(velocity), outputs(position));
            let differ = |a: usize, b: usize| a != b && a * b != 0;
            if differ(inputs.len(), velocities.len()) {
                let text = format!(
                    "{} {} elements, {} {}: one for each is needed",
                    effort.key(),
                    inputs.len(),
                    velocity.key(),
                    velocities.len()
                );
                self.add(Some(place), "elements", PortOutcome::Contradicted, None, text);
            } else {
                for (j, v) in inputs.iter().zip(&velocities) {
                    if let (Some(j), Some(v)) = (j, v) {
                        self.accelerates(place, *j, *v);
                    }
                }
            }
            // A quaternion has another rate.
            if positions.len() == velocities.len() {
                for (q, v) in positions.iter().zip(&velocities) {
                    self.derivative(place, *q, *v);
                }
            }
        }
    }

    /// Positive effort, positive acceleration: power goes in.
    fn accelerates(&mut self, place: &PortPlace, j: usize, v: usize) {
        let values: Vec<f64> = self.e.mobilities.iter().map(|m| m[v][j]).collect();
        let value = values.first().copied().unwrap_or(0.0);
        let (input, output) = (&self.all.inputs[j], &self.all.outputs[v]);
        let size = self.e.mobilities.iter().flatten().map(|row| row[j].abs()).fold(0.0, f64::max);
        let per = if input.unit.is_empty() { "unit" } else { &input.unit };
        let by = format!("{} {} SI per {per} of {}", output.name, short(value), input.name);
        let (outcome, text) = if self.e.amplitudes[j].is_none() && value == 0.0 {
            (
                PortOutcome::Contradicted,
                format!("{by}: no step of it up to 1e6 nominal values accelerates an output"),
            )
        } else if values.iter().any(|x| x.abs() <= 1e-8 * size) {
            (
                PortOutcome::Contradicted,
                format!("{by}: it acts on another output; name the velocity that is conjugate to it"),
            )
        } else if values.iter().any(|x| *x < 0.0) {
            (PortOutcome::Contradicted, format!("{by}: power is taken out; one of both has the other sign"))
        } else {
            let late = if self.e.late[j] { ", one communication step late" } else { "" };
            (PortOutcome::Holds, format!("{by}: power goes in{late}"))
        };
        self.add(Some(place), "acceleration", outcome, Some(value), text);
    }

    fn derivative(&mut self, place: &PortPlace, angle: Option<usize>, velocity: Option<usize>) {
        let (Some(q), Some(v)) = (angle, velocity) else { return };
        let names = format!("{} is the derivative of {}", self.all.outputs[v].name, self.all.outputs[q].name);
        let (outcome, figure, text) = match self.e.derivative_error(q, v) {
            None => (PortOutcome::Open, None, format!("{names}: neither moved")),
            Some(e) if e < self.e.derivative_tolerance() => {
                (PortOutcome::Holds, Some(e), format!("{names}: difference {}", short(e)))
            }
            Some(e) => (
                PortOutcome::Contradicted,
                Some(e),
                format!("it is not so that {names}: difference {}", short(e)),
            ),
        };
        self.add(Some(place), "derivative", outcome, figure, text);
    }

    fn gear(&mut self, place: &PortPlace, drive: Option<usize>) {
        let of = |role| self.output(place, role);
        let (Some(qm), Some(vm)) = (of(PortRole::MotorAngle), of(PortRole::MotorVelocity)) else { return };
        let (Some(ql), Some(vl)) = (of(PortRole::LinkAngle), of(PortRole::LinkVelocity)) else { return };
        let given = self.ports.figure(place, "gearRatio").map_or(1.0, |f| f.value);
        let Some(j) = drive else { return };
        let Some(gear) = self.e.gear([qm, vm], [ql, vl], j) else {
            let text = format!(
                "no spring couples {} and {}, as far as it shows: gearRatio is not compared",
                self.all.outputs[qm].name, self.all.outputs[ql].name
            );
            return self.add(Some(place), "gear ratio", PortOutcome::Open, None, text);
        };
        if gear.rigid {
            let text = format!(
                "{} and {} are one coordinate: the joint is rigid",
                self.all.outputs[qm].name, self.all.outputs[ql].name
            );
            self.add(Some(place), ONE_COORDINATE, PortOutcome::Holds, None, text);
        }
        let by = format!("gearRatio {} against {} measured", short(given), short(gear.ratio));
        let error = (gear.ratio / given - 1.0).abs();
        // By a run the ratio is only as good as it is steady.
        let bound = RATIO + 2.0 * gear.error;
        let outcome = match error < bound {
            true => PortOutcome::Holds,
            false if gear.error > RATIO => PortOutcome::Open,
            false => PortOutcome::Contradicted,
        };
        self.add(Some(place), "gear ratio", outcome, Some(gear.ratio), by);
    }

    fn torque_constant(&mut self, place: &PortPlace, drive: Option<usize>) {
        let (Some(given), Some(j)) = (self.ports.figure(place, "torqueConstant"), drive) else { return };
        let given = given.value;
        let shown = (0..self.all.outputs.len())
            .filter(|k| self.all.outputs[*k].kind == PortKind::Torque && self.e.direct[*k][j] != 0.0)
            .map(|k| (k, self.e.direct[k][j]))
            .min_by(|a, b| (a.1 / given - 1.0).abs().total_cmp(&(b.1 / given - 1.0).abs()));
        let (outcome, figure, text) = match shown {
            None => (
                PortOutcome::Open,
                None,
                "no output shows the motor's torque: torqueConstant is not compared".to_owned(),
            ),
            Some((k, value)) => {
                let close = (value / given - 1.0).abs() < RATIO;
                let by = format!(
                    "torqueConstant {} against {} by {}",
                    short(given),
                    short(value),
                    self.all.outputs[k].name
                );
                (if close { PortOutcome::Holds } else { PortOutcome::Contradicted }, Some(value), by)
            }
        };
        self.add(Some(place), "torque constant", outcome, figure, text);
    }

    /// The matrix of conjugate pairs is symmetric.
    fn reciprocity(&mut self) {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for place in self.ports.places() {
            let roles = [
                (PortRole::Torque, PortRole::MotorVelocity),
                (PortRole::ExternalTorque, PortRole::LinkVelocity),
                (PortRole::BodyForce, PortRole::BodyVelocity),
                (PortRole::BodyTorque, PortRole::BodyRate),
            ];
            for (effort, velocity) in roles {
                let both = self.ports.list(&place, effort).zip(self.ports.list(&place, velocity));
                let found = both
                    .filter_map(|(u, y)| Some((self.all.input(&u.variable)?, self.all.output(&y.variable)?)));
                pairs.extend(found.filter(|(j, _)| self.e.amplitudes[*j].is_some()));
            }
        }
        let Some(error) = asymmetry(self.e, &pairs) else { return };
        let text = format!(
            "reciprocity of {} pairs of torques or forces and velocities: difference {}",
            pairs.len(),
            short(error)
        );
        let outcome = if error < self.e.tolerance() { PortOutcome::Holds } else { PortOutcome::Contradicted };
        self.add(None, "reciprocity", outcome, Some(error), text);
    }

    fn fmu(&mut self) {
        let offers = self.e.offers.clone();
        let [states, acting] = offers.states;
        if states > 0 {
            let outcome = if acting == states { PortOutcome::Holds } else { PortOutcome::Open };
            let text = format!("{acting} of {states} states can be set and move a rate or an output");
            self.add(None, "states", outcome, Some(acting as f64), text);
        }
        match offers.directional_error {
            Some(Ok(found)) => {
                let outcome = match found.differing {
                    0 => PortOutcome::Holds,
                    // A start at a kink has two derivatives.
                    n if n <= found.rows / KINKS => PortOutcome::Open,
                    _ => PortOutcome::Contradicted,
                };
                let DirectionalComparison { worst, differing, rows } = found;
                let text = format!(
                    "directional derivatives: {differing} of {rows} rows differ from differences at the start, the largest by {}",
                    short(worst)
                );
                self.add(None, "directional derivatives", outcome, Some(worst), text);
            }
            Some(Err(why)) => self.add(None, "directional derivatives", PortOutcome::Contradicted, None, why),
            None => {
                let text = if offers.directional {
                    "directional derivatives: declared, not used in Co-Simulation"
                } else {
                    "directional derivatives: none, differences take their place"
                };
                self.add(None, "directional derivatives", PortOutcome::Open, None, text.into());
            }
        }
        let n = offers.indicators;
        self.add(
            None,
            "event indicators",
            PortOutcome::Holds,
            Some(n as f64),
            format!("{n} event indicators"),
        );
        let (outcome, text) = match offers.fmu_state_restored {
            None => (PortOutcome::Open, "the FMU's state cannot be stored".to_owned()),
            Some(Ok(true)) => (PortOutcome::Holds, "a restored state continues bit by bit as before".into()),
            Some(Ok(false)) => {
                (PortOutcome::Contradicted, "a restored state does not continue as before".into())
            }
            Some(Err(why)) => (PortOutcome::Contradicted, why),
        };
        self.add(None, "FMU state", outcome, None, text);
    }
}
