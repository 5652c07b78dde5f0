//! An FMU with its ports as a plant: coordinates on which a force acts through an input, and readings.
//!
//! A coordinate requires an input that is conjugate to its velocity, a state that is its rate, and parameters that are its position
//! and rate at the start. The last two are found by experiments: derivatives of outputs by states, and of the start by parameters.

use std::sync::Arc;

use trueup_fmi_import::{ForceInput, HybridFmu, HybridPorts, UnpackedFmu};
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{Coordinate, Follows, LANES, Lanes};
pub use trueup_plant::{CoordinateKind, InsertionPoint, Plant};

use crate::error::PortsError;
use crate::experiment::{Experiment, SensitivityRows};
use crate::kind::PortKind;
use crate::quantity::{FmuQuantities, FmuQuantity};
use crate::roles::{FmuPorts, PortPlace, PortRole};

/// A derivative that is 1 or 0 is so within errors of its differences.
const SAME: f64 = 1e-6;

/// The plant, and what it lacks.
#[derive(Debug)]
pub struct PlantOfPorts {
    /// With the coordinates and readings that the ports give.
    pub plant: HybridFmu,
    /// Places that are no coordinates, with the reason.
    pub unreached: Vec<String>,
    /// How its motions begin, those on which no force acts too.
    pub starts: Vec<MotionStart>,
    /// Parameter that is the gear ratio of the first joint; `None`: no single one has the value of its `gearRatio`.
    pub gear_ratio: Option<usize>,
}

/// Where a motion begins, and what shows it: indices of parameters and outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotionStart {
    /// Parameter: position at the start.
    pub initial_position: usize,
    /// Parameter: rate at the start.
    pub initial_rate: usize,
    /// Output that shows the position.
    pub position_output: usize,
    /// Output that shows the rate.
    pub rate_output: usize,
}

impl PlantOfPorts {
    /// Where something that the FMU lacks can act.
    pub fn points(&self) -> Vec<InsertionPoint> {
        self.plant.insertion_points()
    }
}

/// What could be a coordinate.
struct PortCoordinate<'a> {
    name: String,
    kind: CoordinateKind,
    place: &'a PortPlace,
    effort: Option<(PortRole, &'a str)>,
    /// Outputs.
    position: Option<&'a str>,
    rate: Option<&'a str>,
}

struct PlantSearch<'a> {
    plant: HybridFmu,
    ports: &'a FmuPorts,
    all: &'a FmuQuantities,
    /// Derivatives of the outputs by the states at the start.
    outputs: &'a SensitivityRows,
    /// Parameters that may be a start value, and how they move the states at the start.
    starts: Vec<(usize, PortKind, Vec<f64>)>,
}

/// This FMU with these ports. `e`: its experiments by Model Exchange.
///
/// # Errors
/// Experiments by Co-Simulation; a call that failed.
pub fn plant(
    fmu: &Arc<UnpackedFmu>,
    ports: &FmuPorts,
    all: &FmuQuantities,
    e: &Experiment,
) -> Result<PlantOfPorts, PortsError> {
    let failed = |what: String| PortsError::Fmu(format!("{}: {what}", fmu.file().display()));
    let Some(rest) = &e.rest else {
        return Err(failed("a plant requires experiments by Model Exchange".into()));
    };
    let start = fmu.description().experiment.start_time.unwrap_or(0.0);
    let plant = HybridFmu::new(fmu, start).map_err(|e| PortsError::Fmu(e.to_string()))?;
    let mut search = PlantSearch { plant, ports, all, outputs: &rest.outputs, starts: Vec::new() };
    search.starts = search.starts().map_err(PortsError::Fmu)?;
    let (mut found, mut unreached) = (HybridPorts::default(), Vec::new());
    let places = ports.places();
    let starts = places.iter().flat_map(|place| search.candidates(place));
    let starts = starts.filter_map(|candidate| search.motion_start(&candidate).ok()).collect();
    for candidate in places.iter().flat_map(|place| search.candidates(place)) {
        match search.coordinate(&candidate) {
            Ok((coordinate, force)) => {
                let motor = match (&candidate.kind, candidate.place) {
                    (CoordinateKind::Link, PortPlace::Joint(_)) => {
                        found.coordinates.iter().position(|c| c.name == motor_of(candidate.place))
                    }
                    _ => None,
                };
                let ratio = search.figure(candidate.place, "gearRatio", PortKind::Number);
                let follows = motor.map(|coordinate| Follows { coordinate, ratio });
                found.coordinates.push(Coordinate { follows, ..coordinate });
                found.forces.push(force);
            }
            Err(why) => unreached.push(format!("{}: {why}", candidate.name)),
        }
    }
    let read = |name: &String| search.plant.table().output(name);
    found.readings = Some(ports.sensors.iter().filter_map(|s| read(&s.variable)).collect());
    let joint = places.iter().find(|place| matches!(place, PortPlace::Joint(_)));
    let gear_ratio = joint.and_then(|place| search.figure(place, "gearRatio", PortKind::Number));
    let plant = search.plant.with_ports(found).map_err(|e| PortsError::Fmu(e.to_string()))?;
    Ok(PlantOfPorts { plant, unreached, starts, gear_ratio })
}

fn motor_of(place: &PortPlace) -> String {
    format!("motor of {}", place.title())
}

impl<'a> PlantSearch<'a> {
    fn named(&self, place: &'a PortPlace, role: PortRole) -> Option<&'a str> {
        self.ports.variable(place, role).map(|v| v.variable.as_str())
    }

    fn candidates(&self, place: &'a PortPlace) -> Vec<PortCoordinate<'a>> {
        let effort = |roles: &[PortRole]| {
            roles.iter().find_map(|role| self.named(place, *role).map(|name| (*role, name)))
        };
        let of = |role| self.named(place, role);
        match place {
            PortPlace::Joint(_) => {
                let motor = PortCoordinate {
                    name: motor_of(place),
                    kind: CoordinateKind::Motor,
                    place,
                    effort: effort(&[PortRole::Torque, PortRole::Current]),
                    position: of(PortRole::MotorAngle),
                    rate: of(PortRole::MotorVelocity),
                };
                let link = PortCoordinate {
                    name: format!("link of {}", place.title()),
                    kind: CoordinateKind::Link,
                    place,
                    effort: effort(&[PortRole::ExternalTorque]),
                    position: of(PortRole::LinkAngle),
                    rate: of(PortRole::LinkVelocity),
                };
                let apart = link.rate.is_some() && !self.one(motor.rate, link.rate);
                std::iter::once(motor).chain(apart.then_some(link)).collect()
            }
            PortPlace::Base | PortPlace::Tip => {
                let sides = [
                    (PortRole::BodyForce, PortRole::BodyPosition, PortRole::BodyVelocity),
                    (PortRole::BodyTorque, PortRole::BodyAttitude, PortRole::BodyRate),
                ];
                let list = |role| {
                    self.ports.list(place, role).map(|v| v.variable.as_str()).collect::<Vec<&'a str>>()
                };
                let side = |(effort, position, rate)| {
                    let (positions, rates) = (list(position), list(rate));
                    // A quaternion has an element more than there are torques.
                    let apart = positions.len() == list(effort).len();
                    let one = move |(k, name): (usize, &'a str)| PortCoordinate {
                        name: format!("{} along `{name}`", place.title()),
                        kind: CoordinateKind::Base,
                        place,
                        effort: Some((effort, name)),
                        position: positions.get(k).copied().filter(|_| apart),
                        rate: rates.get(k).copied(),
                    };
                    list(effort).into_iter().enumerate().map(one).collect::<Vec<_>>()
                };
                sides.into_iter().flat_map(side).collect()
            }
        }
    }

    /// Two outputs move as one: the joint is rigid.
    fn one(&self, a: Option<&str>, b: Option<&str>) -> bool {
        let row = |name: Option<&str>| Some(&self.outputs[self.all.output(name?)?]);
        let (Some(a), Some(b)) = (row(a), row(b)) else { return false };
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (aa, ab, bb) = (product(a, a), product(a, b), product(b, b));
        aa * bb - ab * ab <= SAME * aa * bb
    }

    /// Derivatives of the start by parameters that are angles, positions or their rates.
    fn starts(&self) -> Result<Vec<(usize, PortKind, Vec<f64>)>, String> {
        let table = self.plant.table();
        let starts = |q: &&FmuQuantity| {
            matches!(
                q.kind,
                PortKind::Angle | PortKind::AngularVelocity | PortKind::Position | PortKind::Velocity
            ) && q.factor == 1.0
        };
        let some = self.all.parameters.iter().filter(starts);
        let some: Vec<(usize, PortKind)> =
            some.filter_map(|q| Some((table.parameter(&q.name)?, q.kind))).collect();
        let mut found = Vec::new();
        for group in some.chunks(LANES) {
            let mut p: Vec<Lanes> = table.parameters.iter().map(|q| Dual::constant(q.start)).collect();
            group.iter().enumerate().for_each(|(lane, (k, _))| p[*k].eps[lane] = 1.0);
            let mut x = vec![Lanes::default(); self.plant.sizes().states];
            self.plant.start_lanes(&p, &mut x);
            self.plant.failure().map_or(Ok(()), Err)?;
            let column = |lane: usize| x.iter().map(|v| v.eps[lane]).collect();
            found.extend(group.iter().enumerate().map(|(lane, (k, kind))| (*k, *kind, column(lane))));
        }
        Ok(found)
    }

    /// The parameter that has the value of a figure.
    fn figure(&self, place: &PortPlace, key: &str, kind: PortKind) -> Option<usize> {
        let value = self.ports.figure(place, key)?.value;
        let same = |q: &&FmuQuantity| {
            q.kind == kind && (q.factor * q.start - value).abs() <= SAME * value.abs() && value != 1.0
        };
        only(self.all.parameters.iter().filter(same)).and_then(|q| self.plant.table().parameter(&q.name))
    }

    /// An output in SI with its derivatives by the states.
    fn output(&self, name: Option<&str>, what: &str) -> Result<(usize, PortKind, &'a [f64]), String> {
        let name = name.ok_or_else(|| format!("there is no output that is its {what}"))?;
        let at = self.all.output(name).zip(self.plant.table().output(name));
        let (at, index) = at.ok_or_else(|| format!("`{name}` is no output"))?;
        let q = &self.all.outputs[at];
        if q.factor != 1.0 {
            return Err(format!("`{name}` is in {}; SI units are required", q.unit));
        }
        Ok((index, q.kind, &self.outputs[at]))
    }

    /// The parameter that this output has as its value at the start. Others may move it as well, those that it follows while it is not set:
    /// they move more states.
    fn start(&self, output: usize, kind: PortKind, row: &[f64]) -> Result<usize, String> {
        let moved = |column: &[f64]| row.iter().zip(column).map(|(r, x)| r * x).sum::<f64>();
        let states = |column: &[f64]| column.iter().filter(|x| x.abs() > SAME).count();
        let is =
            |(_, k, column): &&(usize, PortKind, Vec<f64>)| *k == kind && (moved(column) - 1.0).abs() <= SAME;
        let all: Vec<_> = self.starts.iter().filter(is).collect();
        let least = all.iter().map(|s| states(&s.2)).min();
        only(all.iter().filter(|s| Some(states(&s.2)) == least)).map(|s| s.0).ok_or_else(|| {
            format!("no parameter is the value of `{}` at the start", self.plant.table().outputs[output].name)
        })
    }

    fn motion_start(&self, c: &PortCoordinate) -> Result<MotionStart, String> {
        let (rate_output, kind, row) = self.output(c.rate, "velocity")?;
        let (position_output, of, own) = self.output(c.position, "position")?;
        Ok(MotionStart {
            initial_position: self.start(position_output, of, own)?,
            initial_rate: self.start(rate_output, kind, row)?,
            position_output,
            rate_output,
        })
    }

    fn coordinate(&self, c: &PortCoordinate) -> Result<(Coordinate, ForceInput), String> {
        let (role, input) = c.effort.ok_or("no input acts on it")?;
        let force = self.force(c.place, role, input)?;
        let (rate_output, kind, row) = self.output(c.rate, "velocity")?;
        let shown = |row: &[f64]| {
            let largest = row.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let acting = row.iter().enumerate().filter(|(_, v)| v.abs() > SAME * largest);
            only(acting).filter(|(_, v)| (**v - 1.0).abs() <= SAME).map(|(i, _)| i)
        };
        let name = |at: usize| &self.plant.table().outputs[at].name;
        let rate = shown(row).ok_or_else(|| format!("`{}` is no state of the FMU", name(rate_output)))?;
        let (_, _, own) = self.output(c.position, "position")?;
        let MotionStart { initial_position, initial_rate, position_output, rate_output } =
            self.motion_start(c)?;
        Ok((
            Coordinate {
                name: c.name.clone(),
                kind: c.kind,
                force_unit: if kind == PortKind::Velocity { "N" } else { "N.m" },
                position: shown(own),
                rate,
                initial_position,
                initial_rate,
                position_output,
                rate_output,
                friction_mode: None,
                dry_friction: None,
                follows: None,
            },
            force,
        ))
    }

    fn force(&self, place: &PortPlace, role: PortRole, input: &str) -> Result<ForceInput, String> {
        let at = self.all.input(input).zip(self.plant.table().input(input));
        let (at, index) = at.ok_or_else(|| format!("`{input}` is no input"))?;
        let factor = self.all.inputs[at].factor;
        if role != PortRole::Current {
            return Ok(ForceInput { input: index, per_force: 1.0 / factor, divisor: None });
        }
        let constant = self.ports.figure(place, "torqueConstant").ok_or_else(|| {
            format!("a torque enters as a current only with `torqueConstant` of [{}]", place.table())
        })?;
        let divisor = self.figure(place, "torqueConstant", PortKind::TorqueConstant);
        let by = match divisor {
            Some(k) => {
                let own = &self.plant.table().parameters[k].name;
                self.all.parameter(own).map_or(1.0, |q| q.factor)
            }
            None => constant.value,
        };
        Ok(ForceInput { input: index, per_force: 1.0 / (factor * by), divisor })
    }
}

/// The one item that there is.
fn only<T>(mut all: impl Iterator<Item = T>) -> Option<T> {
    let first = all.next();
    if all.next().is_none() { first } else { None }
}
