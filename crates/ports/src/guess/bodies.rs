//! Forces and torques on base and tip.

use super::PortsDraft;
use crate::kind::PortKind;
use crate::roles::{PortPlace, PortRole};
use crate::words::{self, NamedSite};

impl PortsDraft<'_> {
    /// Drafts base and tip; returns their inputs.
    pub(super) fn bodies(&mut self) -> Vec<usize> {
        let moving: Vec<usize> = self.pairs.iter().map(|p| p.input).collect();
        let force = |d: &Self, j: usize| d.all.inputs[j].kind == PortKind::Force;
        let at = |d: &Self, j: usize, site| d.site(j) == Some(site);
        let on =
            |d: &Self, site| -> Vec<usize> { moving.iter().copied().filter(|j| at(d, *j, site)).collect() };
        let (mut base, tip) = (on(self, NamedSite::Base), on(self, NamedSite::Tip));
        // Not named: from outside, so on some body.
        let unnamed: Vec<usize> = moving
            .iter()
            .copied()
            .filter(|j| !base.contains(j) && !tip.contains(j))
            .filter(|j| force(self, *j) && !self.of_a_joint(*j) || self.is_from_outside(*j))
            .collect();
        let alone = moving.iter().all(|j| unnamed.contains(j));
        if alone && self.one_body(&unnamed) {
            base.clone_from(&unnamed);
        } else {
            for j in &unnamed {
                let what = format!(
                    "input `{}` acts from outside on the body that `{}` belongs to: whether that is the base or the tip cannot be known",
                    self.input(*j),
                    self.pair(*j).map_or("", |p| self.output(p.output))
                );
                self.ports.open.push(what);
            }
        }
        self.body(&PortPlace::Base, &base);
        self.body(&PortPlace::Tip, &tip);
        [base, tip, unnamed].concat()
    }

    /// A force of a joint that slides.
    fn of_a_joint(&self, input: usize) -> bool {
        matches!(self.site(input), Some(NamedSite::Motor | NamedSite::Link))
    }

    /// In the plane two forces and a torque, in space three and three: more are of several bodies.
    fn one_body(&self, inputs: &[usize]) -> bool {
        let torques = inputs.iter().filter(|j| self.all.inputs[**j].kind == PortKind::Torque).count();
        matches!((inputs.len() - torques, torques), (0..=2, 0..=1) | (3, 0..=3) | (0, 3))
    }

    fn body(&mut self, place: &PortPlace, inputs: &[usize]) {
        let mut inputs = inputs.to_vec();
        inputs.sort_unstable();
        for (kind, effort, position, velocity) in [
            (PortKind::Force, PortRole::BodyForce, PortRole::BodyPosition, PortRole::BodyVelocity),
            (PortKind::Torque, PortRole::BodyTorque, PortRole::BodyAttitude, PortRole::BodyRate),
        ] {
            let mine: Vec<usize> =
                inputs.iter().copied().filter(|j| self.all.inputs[*j].kind == kind).collect();
            for j in &mine {
                let q = &self.all.inputs[*j];
                let named = if self.site(*j).is_some() { "its name" } else { "the only body" };
                let reason = format!("{}, {named}", self.by(&q.unit, q.by_name));
                self.put(place, effort, q.name.clone(), reason);
            }
            let pairs: Vec<_> = mine.iter().filter_map(|j| self.pair(*j).cloned()).collect();
            for pair in &pairs {
                self.put(place, velocity, self.output(pair.output).to_owned(), self.conjugate_reason(pair));
            }
            // All of them, or none.
            let angles: Option<Vec<_>> =
                pairs.iter().map(|p| Some((p.output, self.angle_of(p.output)?))).collect();
            for (v, (q, error)) in angles.unwrap_or_default() {
                let what = format!("its derivative is {} ({})", self.output(v), super::short(error));
                self.put(place, position, self.output(q).to_owned(), what);
            }
        }
        let attitude = self.ports.has(place, PortRole::BodyAttitude);
        if inputs.is_empty() || attitude {
            return;
        }
        let site = if *place == PortPlace::Base { NamedSite::Base } else { NamedSite::Tip };
        let quaternion = |name: &str| words::quaternion(name) && words::site(name) == Some(site);
        let four: Vec<String> = (self.all.outputs.iter())
            .filter(|q| q.kind == PortKind::Number && quaternion(&q.name))
            .map(|q| q.name.clone())
            .collect();
        if four.len() == 4 {
            for name in four {
                self.put(place, PortRole::BodyAttitude, name, "by name, four numbers".into());
            }
        }
    }
}
