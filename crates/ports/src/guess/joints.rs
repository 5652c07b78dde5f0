//! Joints: what drives them, motor and link, what couples both.

use super::{PortsDraft, short};
use crate::experiment::GearFit;
use crate::kind::PortKind;
use crate::quantity::FmuQuantity;
use crate::roles::{PortPlace, PortRole};
use crate::words::{self, NamedSite, affinity};

/// One side of a joint: its velocity, and the output whose derivative that is, with the difference.
#[derive(Clone, Copy)]
struct DraftSide {
    velocity: usize,
    angle: Option<(usize, f64)>,
}

/// One joint while it is drafted.
struct DraftJoint {
    drive: usize,
    motor: DraftSide,
    link: Option<(DraftSide, GearFit)>,
    external: Option<usize>,
}

/// From this ratio on, the faster of two is the motor.
const FASTER: f64 = 1.05;
/// A ratio by a run is as good as this only where a parameter has it.
const COARSE: f64 = 0.02;

impl PortsDraft<'_> {
    /// Drafts joints of all inputs that are not of a body.
    pub(super) fn joints(&mut self, bodies: &[usize]) {
        let drives: Vec<usize> = self.pairs.iter().map(|p| p.input).filter(|j| !bodies.contains(j)).collect();
        let mut drives: Vec<usize> = drives.into_iter().filter(|j| self.turns_a_joint(*j)).collect();
        drives.sort_unstable();
        let mut joints: Vec<DraftJoint> = Vec::new();
        let mut links: Vec<usize> = Vec::new();
        for j in &drives {
            if links.contains(j) {
                continue;
            }
            let Some(pair) = self.pair(*j) else { continue };
            let motor = self.side(pair.output);
            // The torque on the link is conjugate to a velocity that a spring couples to the motor's.
            let partner =
                drives.iter().filter(|x| *x != j && self.may_be_both_sides(*j, **x)).find_map(|x| {
                    let other = self.pair(*x)?;
                    let gear = self.coupled(motor, self.side(other.output), *j)?;
                    (!self.e.same(motor.velocity, other.output)).then_some((*x, gear))
                });
            let Some((x, gear)) = partner else {
                joints.push(self.alone(*j, motor));
                continue;
            };
            let (drive, external) = self.motor_of(*j, x, gear);
            links.push(external);
            joints.retain(|joint| joint.drive != external);
            let of = |input: usize| self.pair(input).map_or(motor, |p| self.side(p.output));
            let (motor, link) = (of(drive), of(external));
            let link = self.coupled(motor, link, drive).map(|gear| (link, gear));
            if !joints.iter().any(|joint| joint.drive == drive) {
                joints.push(DraftJoint { drive, motor, link, external: Some(external) });
            }
        }
        joints.sort_by_key(|joint| joint.drive);
        let names = self.names(&joints);
        for (joint, name) in joints.iter().zip(names) {
            self.joint(joint, &PortPlace::Joint(name));
        }
    }

    /// An input with one velocity, and an angle to it or a name that places it at a joint; else it is left open.
    fn turns_a_joint(&mut self, input: usize) -> bool {
        let Some(pair) = self.pair(input).cloned() else { return false };
        let named = matches!(self.site(input), Some(NamedSite::Motor | NamedSite::Link));
        let force = self.all.inputs[input].kind == PortKind::Force;
        let what = if !pair.others.is_empty() {
            let names: Vec<String> = (std::iter::once(&pair.output).chain(&pair.others))
                .map(|k| format!("`{}`", self.output(*k)))
                .collect();
            let names = names.join(", ");
            format!("input `{}`: which of {names} is its velocity cannot be known", self.input(input))
        } else if !named && (force || self.angle_of(pair.output).is_none()) {
            format!(
                "input `{}`, conjugate to `{}`, is of a joint or of a body: which cannot be known",
                self.input(input),
                self.output(pair.output)
            )
        } else {
            return true;
        };
        self.ports.open.push(what);
        false
    }

    /// A run alone does not separate a joint's spring from what joints of one arm do to each other: there kind or name has to
    /// suggest it.
    fn may_be_both_sides(&self, j: usize, x: usize) -> bool {
        let current = |i: usize| self.all.inputs[i].kind == PortKind::Current;
        let outside = |i: usize| words::external(self.input(i));
        let suggested = current(j) != current(x) || outside(j) != outside(x);
        self.e.rest.is_some() || suggested && affinity(self.input(j), self.input(x)) >= 0.0
    }

    fn side(&self, velocity: usize) -> DraftSide {
        DraftSide { velocity, angle: self.angle_of(velocity) }
    }

    fn coupled(&self, motor: DraftSide, link: DraftSide, drive: usize) -> Option<GearFit> {
        self.e.gear([motor.angle?.0, motor.velocity], [link.angle?.0, link.velocity], drive)
    }

    /// Which of two inputs turns the motor, then the other.
    fn motor_of(&mut self, j: usize, x: usize, gear: GearFit) -> (usize, usize) {
        let current = |i: usize| self.all.inputs[i].kind == PortKind::Current;
        let outside = |i: usize| words::external(self.input(i));
        let motor = |i: usize| self.site(i) == Some(NamedSite::Motor);
        if current(j) != current(x) {
            return if current(j) { (j, x) } else { (x, j) };
        }
        if gear.ratio > FASTER {
            return (j, x);
        }
        if gear.ratio < 1.0 / FASTER {
            return (x, j);
        }
        if outside(j) != outside(x) {
            return if outside(x) { (j, x) } else { (x, j) };
        }
        if motor(j) != motor(x) {
            return if motor(j) { (j, x) } else { (x, j) };
        }
        let what = format!(
            "inputs `{}` and `{}` act on both sides of one spring with ratio 1: which of them is the motor cannot be known",
            self.input(j),
            self.input(x)
        );
        self.ports.open.push(what);
        (j, x)
    }

    /// A joint with one input: its link is a velocity that is coupled to the motor's, or the same.
    fn alone(&mut self, drive: usize, motor: DraftSide) -> DraftJoint {
        let kind = self.all.outputs[motor.velocity].kind;
        let twins: Vec<usize> = (0..self.all.outputs.len())
            .filter(|k| self.all.outputs[*k].kind == kind && self.e.same(motor.velocity, *k))
            .collect();
        let at = |site| {
            twins.iter().copied().filter(|k| words::site(self.output(*k)) == Some(site)).max_by(|a, b| {
                let name = |k: usize| affinity(self.input(drive), self.output(k));
                name(*a).total_cmp(&name(*b))
            })
        };
        if twins.len() > 1 {
            let motor = at(NamedSite::Motor).map_or(motor, |v| self.side(v));
            let link = at(NamedSite::Link)
                .filter(|v| *v != motor.velocity)
                .or_else(|| twins.iter().copied().find(|v| *v != motor.velocity));
            let link = link.map(|v| (self.side(v), GearFit { ratio: 1.0, error: 0.0, rigid: true }));
            return DraftJoint { drive, motor, link, external: None };
        }
        let taken = |k: &usize| self.pairs.iter().any(|p| self.e.same(p.output, *k));
        let mut partners: Vec<(DraftSide, GearFit)> = (0..self.all.outputs.len())
            .filter(|k| *k != motor.velocity && self.all.outputs[*k].kind == kind && !taken(k))
            .filter_map(|k| Some((self.side(k), self.coupled(motor, self.side(k), drive)?)))
            .collect();
        let name = |k: usize| affinity(self.output(motor.velocity), self.output(k));
        let name = |side: DraftSide| name(side.velocity);
        partners.sort_by(|a, b| name(b.0).total_cmp(&name(a.0)).then(a.1.error.total_cmp(&b.1.error)));
        if let [first, second, ..] = partners[..]
            && name(first.0) == name(second.0)
        {
            let names: Vec<String> =
                partners.iter().map(|p| format!("`{}`", self.output(p.0.velocity))).collect();
            let what = format!(
                "which of {} is the link behind `{}` cannot be known",
                names.join(", "),
                self.output(motor.velocity)
            );
            self.ports.open.push(what);
            return DraftJoint { drive, motor, link: None, external: None };
        }
        DraftJoint { drive, motor, link: partners.into_iter().next(), external: None }
    }

    /// The numbers in the inputs' names where they are different, else the order.
    fn names(&self, joints: &[DraftJoint]) -> Vec<String> {
        let number = |joint: &DraftJoint| match words::numbers(self.input(joint.drive))[..] {
            [n] => Some(n.to_string()),
            _ => None,
        };
        let numbers: Option<Vec<String>> = joints.iter().map(number).collect();
        let different = |n: &Vec<String>| n.iter().enumerate().all(|(i, a)| !n[..i].contains(a));
        numbers.filter(different).unwrap_or_else(|| (1..=joints.len()).map(|n| n.to_string()).collect())
    }

    fn joint(&mut self, joint: &DraftJoint, place: &PortPlace) {
        let q = &self.all.inputs[joint.drive];
        let role = if q.kind == PortKind::Current { PortRole::Current } else { PortRole::Torque };
        let moves = format!(
            "{}, accelerates {} at once",
            self.by(&q.unit, q.by_name),
            self.output(joint.motor.velocity)
        );
        self.put(place, role, q.name.clone(), moves);
        let pair = self.pair(joint.drive).cloned();
        if let Some((angle, error)) = joint.motor.angle {
            let what = format!("its derivative is {} ({})", self.output(joint.motor.velocity), short(error));
            self.put(place, PortRole::MotorAngle, self.output(angle).to_owned(), what);
        }
        let what = pair.map_or_else(String::new, |p| self.conjugate_reason(&p));
        self.put(place, PortRole::MotorVelocity, self.output(joint.motor.velocity).to_owned(), what);
        if let Some((side, gear)) = joint.link {
            self.link(place, joint, side, gear);
        }
        if let Some(x) = joint.external {
            let q = &self.all.inputs[x];
            let what = format!(
                "{}, accelerates the link at once, the motor only through the spring",
                self.by(&q.unit, q.by_name)
            );
            self.put(place, PortRole::ExternalTorque, q.name.clone(), what);
        }
        if role == PortRole::Current {
            self.torque_constant(place, joint.drive);
        }
        if joint.link.is_some_and(|l| !l.1.rigid) {
            self.transmission(place, joint.drive);
        }
    }

    fn link(
        &mut self,
        place: &PortPlace,
        joint: &DraftJoint,
        DraftSide { velocity, angle }: DraftSide,
        gear: GearFit,
    ) {
        let coupled = match gear.rigid {
            true => format!("moves with {} as one", self.output(joint.motor.velocity)),
            false => format!("a spring couples it to {}", self.output(joint.motor.velocity)),
        };
        if let Some((angle, error)) = angle {
            let what = format!("its derivative is {} ({})", self.output(velocity), short(error));
            self.put(place, PortRole::LinkAngle, self.output(angle).to_owned(), what);
        }
        self.put(place, PortRole::LinkVelocity, self.output(velocity).to_owned(), coupled);
        let bound = COARSE.max(2.0 * gear.error);
        let near = |q: &&FmuQuantity| {
            q.kind == PortKind::Number && q.start != 1.0 && (q.start / gear.ratio - 1.0).abs() < bound
        };
        let named =
            self.all.parameters.iter().filter(near).min_by(|a, b| {
                (a.start / gear.ratio - 1.0).abs().total_cmp(&(b.start / gear.ratio - 1.0).abs())
            });
        let (ratio, error) = (short(gear.ratio), short(gear.error));
        if (gear.ratio - 1.0).abs() < bound {
            self.figure(
                place,
                "gearRatio",
                1.0,
                format!("measured {ratio}, difference of two determinations {error}"),
            );
        } else if let Some(q) = named {
            let (value, what) = (
                q.start,
                format!("parameter {}; measured {ratio}, difference of two determinations {error}", q.name),
            );
            self.figure(place, "gearRatio", value, what);
        } else if gear.error < COARSE {
            let value = format!("{:.5e}", gear.ratio).parse().unwrap_or(gear.ratio);
            self.figure(place, "gearRatio", value, format!("difference of two determinations {error}"));
        } else {
            let what = format!(
                "gearRatio of {}: about {ratio}, by a run that is too short to determine it",
                place.title()
            );
            self.ports.open.push(what);
        }
    }

    /// A torque that is an output, moves at once with the current, and with no other input.
    fn torque_constant(&mut self, place: &PortPlace, drive: usize) {
        let direct = &self.e.direct;
        let alone = |k: &usize| {
            let row = &direct[*k];
            self.all.outputs[*k].kind == PortKind::Torque
                && row[drive] > 0.0
                && row.iter().enumerate().all(|(j, v)| j == drive || v.abs() < 1e-6 * row[drive])
        };
        let candidates: Vec<usize> = (0..self.all.outputs.len()).filter(alone).collect();
        let best = candidates.iter().copied().max_by(|a, b| {
            let name = |k: usize| affinity(self.input(drive), self.output(k));
            name(*a).total_cmp(&name(*b))
        });
        match best {
            Some(k) => {
                let value = direct[k][drive];
                let value = format!("{value:.8e}").parse().unwrap_or(value);
                let what = format!("{} moves by it at once", self.output(k));
                self.figure(place, "torqueConstant", value, what);
            }
            None => {
                let what = format!("torqueConstant of {}: no output shows the motor's torque", place.title());
                self.ports.open.push(what);
            }
        }
    }

    /// By name: no experiment shows it from outside.
    fn transmission(&mut self, place: &PortPlace, drive: usize) {
        let has = |name: &str, list: &[&str]| words::tokens(name).iter().any(|t| list.contains(&t.as_str()));
        let numbers = words::numbers(self.input(drive));
        let same = |name: &str| words::numbers(name) == numbers;
        let torque = self.all.outputs.iter().find(|q| {
            q.kind == PortKind::Torque
                && has(&q.name, &["transmission", "spring", "elastic"])
                && same(&q.name)
        });
        if let Some(name) = torque.map(|q| q.name.clone()) {
            self.put(place, PortRole::TransmissionTorque, name, "by name".into());
        }
        for (role, word) in [(PortRole::Stiffness, "stiffness"), (PortRole::Damping, "damping")] {
            let fits =
                |q: &&FmuQuantity| role.kinds().contains(&q.kind) && has(&q.name, &[word]) && same(&q.name);
            if let Some(name) = self.all.parameters.iter().find(fits).map(|q| q.name.clone()) {
                self.put(place, role, name, "by name and unit".into());
            }
        }
    }
}
