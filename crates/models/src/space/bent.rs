//! Appendages at one instant: how modes move them, what they take and what acts on them (SFF-5).

use super::MAX_APPENDAGES;
use super::end::{Ends, LinkEndMotion};
use super::flexible::{Appendages, FlexibleAppendage, Function, Modal, ModalCoordinate};
use super::spatial::{Rigid, SpatialMotion, SpatialWrench};
use super::tree::PlacedBody;
use super::vector::{add, cross, dot, scale, spread, times, zero};
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;

impl<T: Scalar> Appendages<T> {
    /// How all appendages are bent and move: at these coordinates and rates, `placed` being the bodies' places. What acts on
    /// modes is then what springs and dampers do.
    pub fn bend(&self, placed: &[PlacedBody<T>], eta: &[T], rates: &[T], bent: &mut DeformedAppendages<T>) {
        bent.clear();
        bent.coupling.extend(self.modes.iter().map(|_| SpatialWrench::zero()));
        bent.bias.extend(self.modes.iter().map(|_| T::zero()));
        bent.rates.extend(self.modes.iter().zip(rates).map(|(_, r)| *r));
        let states = eta.iter().zip(rates);
        bent.force
            .extend(self.modes.iter().zip(states).map(|(m, (e, r))| -(m.stiffness * *e + m.damping * *r))); // (SFF-5)
        self.parts.iter().for_each(|part| self.bend_one(part, placed, (eta, rates), bent));
    }

    fn bend_one(
        &self,
        part: &FlexibleAppendage<T>,
        placed: &[PlacedBody<T>],
        (eta, rates): (&[T], &[T]),
        bent: &mut DeformedAppendages<T>,
    ) {
        let velocity = placed[part.on].velocity;
        let (omega, v) = (velocity.angular, velocity.linear);
        let (first, last) = part.modes;
        let mut now = part.rigid;
        // Its momentum by the modes' rates, and how its inertia changes.
        let (mut own, mut change) = (SpatialWrench::zero(), [zero(); 3]);
        let mut fixed = first;
        for g in part.functions.0..part.functions.1 {
            let Function { square, area, moment, modes } = self.functions[g];
            let mine = || modes.into_iter().flatten();
            let (mut u, mut rate) = (zero(), zero());
            for j in mine() {
                u = add(u, scale(eta[j], self.modes[j].along));
                rate = add(rate, scale(rates[j], self.modes[j].along));
            }
            let bowed = scale(square, u);
            let arm = add(moment, bowed);
            now.first = add(now.first, scale(area, u));
            // 2 b . u + F u . u = (b + arm) . u and so on: the halves of what is symmetric in both.
            spread(&mut now.inertia, add(moment, scale(T::constant(0.5), bowed)), u);
            spread(&mut change, arm, rate);
            own.force = add(own.force, scale(area, rate));
            own.torque = add(own.torque, cross(arm, rate));
            // Coriolis, centrifugal, and what a velocity of the origin that turns leaves.
            let turned = scale(square * 2.0, cross(omega, rate));
            let pull = add(add(turned, cross(omega, cross(omega, arm))), scale(area, cross(omega, v)));
            for j in mine() {
                let along = self.modes[j].along;
                bent.coupling[j] = SpatialWrench { torque: cross(arm, along), force: scale(area, along) }; // (SFF-5)
                bent.bias[j] = dot(along, pull); // (SFF-5)
                fixed += 1;
            }
        }
        for j in fixed..last {
            let coupling = self.modes[j].fixed;
            // The centre of mass moves as the momentum has it; what bending changes of the inertia is left out.
            now.first = add(now.first, scale(eta[j], coupling.force));
            own = own.plus(coupling.times(rates[j]));
            bent.coupling[j] = coupling; // (SFF-5)
            bent.bias[j] = dot(coupling.force, cross(omega, v)); // (SFF-5)
        }
        let pairs = part.second_order.map(|s| {
            let modal = (&mut bent.coupling[..], &mut bent.bias[..]);
            let of_body = (&mut now, &mut change, &mut own);
            self.second_order[s].bend((eta, rates), (omega, v), modal, of_body)
        });
        // Momentum along a line is how the first moment changes.
        let mut bias = SpatialWrench {
            torque: add(times(&change, omega), cross(own.force, v)),
            force: cross(omega, own.force),
        };
        if let Some(wrench) = pairs {
            bias = bias.plus(wrench);
        }
        let momentum = now.times(velocity).plus(own);
        bent.parts.push(BentPart {
            rigid: now,
            bias: velocity.cross_wrench(momentum).plus(bias), // (SFF-5)
            momentum,
        });
    }
}

/// One appendage at an instant, axes and origin of the body that carries it.
#[derive(Clone, Copy, Debug)]
pub struct BentPart<T> {
    /// Its inertia, modes held.
    pub rigid: Rigid<T>,
    /// The wrench that it takes when neither carrier nor modes accelerate.
    pub bias: SpatialWrench<T>,
    /// Its momentum.
    pub momentum: SpatialWrench<T>,
}

/// All appendages at an instant.
#[derive(Clone, Debug)]
pub struct DeformedAppendages<T> {
    parts: ArrayVec<BentPart<T>, MAX_APPENDAGES>,
    /// Momentum per unit of each mode's rate, carrier's axes and origin.
    coupling: Modal<SpatialWrench<T>>,
    bias: Modal<T>,
    rates: Modal<T>,
    /// What acts on each mode, N (N.m).
    pub force: Modal<T>,
    /// Where the ends of links are. Bodies are placed on them, so they are set first.
    pub ends: Ends<T>,
}

impl<T: Scalar> Default for DeformedAppendages<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> DeformedAppendages<T> {
    /// Memory for [`Appendages::bend`].
    #[inline]
    pub fn new() -> Self {
        let none = ArrayVec::new;
        let ends = Ends::default();
        Self {
            parts: ArrayVec::new(),
            coupling: ArrayVec::new(),
            bias: none(),
            rates: none(),
            force: none(),
            ends,
        }
    }
    /// A wrench on what body `on` carries (body axes about its origin) does work on the modes of its link.
    pub(super) fn push(&mut self, on: usize, wrench: SpatialWrench<T>) {
        let Some((_, end)) = self.ends.of(on) else { return };
        (end.modes.0..end.modes.1).for_each(|j| self.force[j] += self.ends.column(j).power(wrench)); // (LNK-3)
    }
    fn clear(&mut self) {
        self.parts.clear();
        self.coupling.clear();
        [&mut self.bias, &mut self.rates, &mut self.force].into_iter().for_each(ArrayVec::clear);
    }
    /// With the appendages that it is of, as the sweeps over bodies read it.
    pub fn of<'a>(&'a self, appendages: &'a Appendages<T>) -> DeformationView<'a, T> {
        DeformationView {
            parts: appendages.parts(),
            modes: appendages.modes(),
            now: &self.parts,
            coupling: &self.coupling,
            bias: &self.bias,
            rates: &self.rates,
            force: &self.force,
            ends: Some(&self.ends),
        }
    }
}

/// Appendages and how they are bent, as the sweeps over bodies read them.
#[derive(Clone, Copy, Debug)]
pub struct DeformationView<'a, T> {
    /// The appendages.
    pub parts: &'a [FlexibleAppendage<T>],
    /// Their modes.
    pub modes: &'a [ModalCoordinate<T>],
    /// The state of each appendage at this instant.
    pub now: &'a [BentPart<T>],
    /// Per mode momentum of the appendage per unit of its rate, carrier's axes and origin.
    pub coupling: &'a [SpatialWrench<T>],
    /// Per mode the force that it takes when neither it nor the carrier accelerates, N (N.m).
    pub bias: &'a [T],
    /// Per mode its rate, m/s (rad/s).
    pub rates: &'a [T],
    /// Per mode what acts on it, N (N.m).
    pub force: &'a [T],
    /// The ends of links.
    pub ends: Option<&'a Ends<T>>,
}

/// The end of a link, which carries other bodies.
#[derive(Clone, Copy)]
pub(super) struct CarryingLinkEnd<'a, T> {
    pub(super) number: usize,
    pub(super) end: &'a LinkEndMotion<T>,
    ends: &'a Ends<T>,
}

impl<T: Scalar> CarryingLinkEnd<'_, T> {
    /// Its modes with its motion per unit of their rates.
    pub(super) fn columns(&self) -> impl Iterator<Item = (usize, SpatialMotion<T>)> + '_ {
        (self.end.modes.0..self.end.modes.1).map(|j| (j, self.ends.column(j)))
    }
    /// What its acceleration has beyond that of the body, which moves so, and that of the modes.
    pub(super) fn bias(&self, velocity: SpatialMotion<T>) -> SpatialMotion<T> {
        velocity.cross(self.end.velocity).plus(self.end.bias) // (LNK-3)
    }
    /// Its acceleration, of a body with this acceleration and velocity, and with these of the modes.
    pub(super) fn acceleration(
        &self,
        body: SpatialMotion<T>,
        velocity: SpatialMotion<T>,
        modal: &[T],
    ) -> SpatialMotion<T> {
        body.plus(self.bias(velocity)).plus(self.ends.moved(self.end, modal))
    }
}

impl<'a, T: Scalar> DeformationView<'a, T> {
    /// None.
    pub fn none() -> Self {
        DeformationView {
            parts: &[],
            modes: &[],
            now: &[],
            coupling: &[],
            bias: &[],
            rates: &[],
            force: &[],
            ends: None,
        }
    }
    /// Each mode with the body that carries it.
    pub(super) fn carried(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.parts.iter().flat_map(|p| (p.modes.0..p.modes.1).map(|j| (j, p.on)))
    }
    /// Those that carry nothing themselves.
    pub(super) fn loose(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let parts = self.parts.iter().filter(|p| !p.carries);
        parts.flat_map(|p| (p.modes.0..p.modes.1).map(|j| (j, p.on)))
    }
    /// The end of this body's link, if it bends.
    #[inline]
    pub(super) fn end(&self, body: usize) -> Option<CarryingLinkEnd<'a, T>> {
        let ends = self.ends?;
        ends.of(body).map(|(number, end)| CarryingLinkEnd { number, end, ends })
    }
}
