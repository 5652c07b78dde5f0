//! Bodies that bend, by assumed modes: a body is rigid + modes (SFF-5). The kernel treats matter that modes move, in the
//! axes of the body that carries it; [`super::appendage`] makes such matter of beams and of tables of modes.
//!
//! The point that is at r unbent is at r + sum over functions g of f_g(r) u_g, u_g = sum over the modes of g of d_j eta_j:
//! mode j moves matter along the direction d_j by the function that it shares with others. Functions are orthogonal under the
//! mass, so the modes' mass is constant and diagonal. The kinetic energy
//! T = 1/2 V . M(eta) V + V . C(eta) d(eta) + 1/2 sum m_j d(eta_j)^2 has all terms in eta, also those of second order:
//! it depends on nothing but the body's own view of its motion, so momentum is conserved exactly.
//!
//! S1 (2)-(8). There (2) lacks A, the second term of (3b) lacks rho, the third term of (4) must have J_z and d(theta_z)/dz.
//!
//! What it gets wrong: the shapes of an appendage do not shorten it when it bends, so nothing stiffens it when it spins (no
//! geometric stiffness). Above about a fifth of the first frequency the spin softens it falsely: bending in the plane of the
//! spin by the square of the spin's rate. Of links it may be counted ([`super::second_order`]).

use super::end::{End, Ends, LinkEnd};
use super::second_order::SecondOrder;
use super::spatial::{Motion, Rigid, Wrench};
use super::tree::Placed;
use super::vector::{Matrix, Vector, add, cross, dot, scale, times, zero};
use super::{MAX_APPENDAGES, MAX_MODES_OF_ALL};
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;

/// What a function of the place, f, integrates to over the mass.
#[derive(Clone, Copy, Debug)]
pub struct Function<T> {
    /// f^2, kg.
    pub square: T,
    /// f, kg.
    pub area: T,
    /// f times the place, carrier's axes, kg.m.
    pub moment: Vector<T>,
    /// The modes that shift matter by it, each along a direction of its own.
    pub modes: [Option<usize>; 2],
}

/// A mode: mass, spring and damper of its coordinate (m; rad where it turns), and what it moves.
#[derive(Clone, Copy, Debug)]
pub struct Mode<T> {
    /// Where a function has it: along this, carrier's axes.
    pub along: Vector<T>,
    /// Where none has it (torsion, tables of modes): momentum per unit of its rate, whatever the coordinate is.
    pub fixed: Wrench<T>,
    /// kg (kg.m2).
    pub mass: T,
    /// 1 / mass.
    pub inverse: T,
    /// N/m (N.m/rad).
    pub stiffness: T,
    /// N.s/m (N.m.s/rad).
    pub damping: T,
}

/// One appendage: matter on a body, some of it moved by modes.
#[derive(Clone, Copy, Debug)]
pub struct Part<T> {
    /// The body that carries it; 0 is the base. The tree must have it.
    pub on: usize,
    /// Unbent, carrier's axes.
    pub rigid: Rigid<T>,
    /// The first of its functions and the one after the last.
    pub functions: (usize, usize),
    /// The first of its modes and the one after the last; those of functions come first.
    pub modes: (usize, usize),
    /// It is the link of its body: what the body carries hangs on its end.
    pub carries: bool,
    /// What bending and twist displace of it to second order, where that is counted.
    pub second_order: Option<usize>,
}

/// All appendages of a robot.
#[derive(Clone, Debug, Default)]
pub struct Appendages<T> {
    pub(super) parts: ArrayVec<Part<T>, MAX_APPENDAGES>,
    pub(super) functions: Modal<Function<T>>,
    pub(super) modes: Modal<Mode<T>>,
    /// Those that carry other bodies.
    pub(super) links: ArrayVec<LinkEnd<T>, MAX_APPENDAGES>,
    /// How each mode shifts and turns the end of its link, per unit of its coordinate; 0 of those that carry nothing.
    pub(super) reach: Modal<Motion<T>>,
    pub(super) second_order: ArrayVec<SecondOrder<T>, MAX_APPENDAGES>,
}

/// Of all modes.
pub type Modal<V> = ArrayVec<V, MAX_MODES_OF_ALL>;

impl<T: Scalar> Appendages<T> {
    /// None yet.
    #[inline]
    pub fn new() -> Self {
        let (parts, links) = (ArrayVec::new(), ArrayVec::new());
        Self {
            parts,
            functions: ArrayVec::new(),
            modes: ArrayVec::new(),
            links,
            reach: ArrayVec::new(),
            second_order: ArrayVec::new(),
        }
    }
    /// The appendages.
    pub fn parts(&self) -> &[Part<T>] {
        &self.parts
    }
    /// Their modes, one appendage's after the other's.
    pub fn modes(&self) -> &[Mode<T>] {
        &self.modes
    }
    /// The lowest frequency of a mode, carriers held, rad/s; `None` without modes. A body that carries appendages should turn
    /// no faster than a fifth of it.
    pub fn lowest_frequency(&self) -> Option<T> {
        let frequency = |m: &Mode<T>| (m.stiffness / m.mass).sqrt();
        self.modes().iter().map(frequency).reduce(T::min)
    }
    /// Energy in the springs of the modes, J.
    pub fn potential(&self, eta: &[T]) -> T {
        self.modes().iter().zip(eta).fold(T::zero(), |sum, (m, e)| sum + m.stiffness * *e * *e * 0.5)
    }
    /// What their dampers turn into heat, W.
    pub fn dissipation(&self, rates: &[T]) -> T {
        self.modes().iter().zip(rates).fold(T::zero(), |sum, (m, r)| sum + m.damping * *r * *r)
    }

    /// How all appendages are bent and move: at these coordinates and rates, `placed` being the bodies' places. What acts on
    /// modes is then what springs and dampers do.
    pub fn bend(&self, placed: &[Placed<T>], eta: &[T], rates: &[T], bent: &mut Bent<T>) {
        bent.clear();
        bent.coupling.extend(self.modes.iter().map(|_| Wrench::zero()));
        bent.bias.extend(self.modes.iter().map(|_| T::zero()));
        bent.rates.extend(self.modes.iter().zip(rates).map(|(_, r)| *r));
        let states = eta.iter().zip(rates);
        bent.force
            .extend(self.modes.iter().zip(states).map(|(m, (e, r))| -(m.stiffness * *e + m.damping * *r))); // (SFF-5)
        self.parts.iter().for_each(|part| self.bend_one(part, placed, (eta, rates), bent));
    }

    fn bend_one(&self, part: &Part<T>, placed: &[Placed<T>], (eta, rates): (&[T], &[T]), bent: &mut Bent<T>) {
        let velocity = placed[part.on].velocity;
        let (omega, v) = (velocity.angular, velocity.linear);
        let (first, last) = part.modes;
        let mut now = part.rigid;
        // Its momentum by the modes' rates, and how its inertia changes.
        let (mut own, mut change) = (Wrench::zero(), [zero(); 3]);
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
                bent.coupling[j] = Wrench { torque: cross(arm, along), force: scale(area, along) }; // (SFF-5)
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
        let mut bias = Wrench {
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

/// Adds 2 b . u 1 - b u^T - u b^T: what an inertia gets when matter with the moment b is shifted by u.
#[inline]
pub(super) fn spread<T: Scalar>(inertia: &mut Matrix<T>, b: Vector<T>, u: Vector<T>) {
    let twice = dot(b, u) * 2.0;
    for i in 0..3 {
        for j in 0..3 {
            inertia[i][j] -= b[i] * u[j] + u[i] * b[j];
        }
        inertia[i][i] += twice;
    }
}

/// One appendage at an instant, axes and origin of the body that carries it.
#[derive(Clone, Copy, Debug)]
pub struct BentPart<T> {
    /// Its inertia, modes held.
    pub rigid: Rigid<T>,
    /// The wrench that it takes when neither carrier nor modes accelerate.
    pub bias: Wrench<T>,
    /// Its momentum.
    pub momentum: Wrench<T>,
}

/// All appendages at an instant.
#[derive(Clone, Debug)]
pub struct Bent<T> {
    parts: ArrayVec<BentPart<T>, MAX_APPENDAGES>,
    /// Momentum per unit of each mode's rate, carrier's axes and origin.
    coupling: Modal<Wrench<T>>,
    bias: Modal<T>,
    rates: Modal<T>,
    /// What acts on each mode, N (N.m).
    pub force: Modal<T>,
    /// Where the ends of links are. Bodies are placed on them, so they are set first.
    pub ends: Ends<T>,
}

impl<T: Scalar> Default for Bent<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> Bent<T> {
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
    pub(super) fn push(&mut self, on: usize, wrench: Wrench<T>) {
        let Some((_, end)) = self.ends.of(on) else { return };
        (end.modes.0..end.modes.1).for_each(|j| self.force[j] += self.ends.column(j).power(wrench)); // (LNK-3)
    }
    fn clear(&mut self) {
        self.parts.clear();
        self.coupling.clear();
        [&mut self.bias, &mut self.rates, &mut self.force].into_iter().for_each(ArrayVec::clear);
    }
    /// With the appendages that it is of, as the sweeps over bodies read it.
    pub fn of<'a>(&'a self, appendages: &'a Appendages<T>) -> Flexing<'a, T> {
        Flexing {
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
pub struct Flexing<'a, T> {
    /// The appendages.
    pub parts: &'a [Part<T>],
    /// Their modes.
    pub modes: &'a [Mode<T>],
    /// The state of each appendage at this instant.
    pub now: &'a [BentPart<T>],
    /// Per mode momentum of the appendage per unit of its rate, carrier's axes and origin.
    pub coupling: &'a [Wrench<T>],
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
pub(super) struct Carrying<'a, T> {
    pub(super) number: usize,
    pub(super) end: &'a End<T>,
    ends: &'a Ends<T>,
}

impl<T: Scalar> Carrying<'_, T> {
    /// Its modes with its motion per unit of their rates.
    pub(super) fn columns(&self) -> impl Iterator<Item = (usize, Motion<T>)> + '_ {
        (self.end.modes.0..self.end.modes.1).map(|j| (j, self.ends.column(j)))
    }
    /// What its acceleration has beyond that of the body, which moves so, and that of the modes.
    pub(super) fn bias(&self, velocity: Motion<T>) -> Motion<T> {
        velocity.cross(self.end.velocity).plus(self.end.bias) // (LNK-3)
    }
    /// Its acceleration, of a body with this acceleration and velocity, and with these of the modes.
    pub(super) fn acceleration(&self, body: Motion<T>, velocity: Motion<T>, modal: &[T]) -> Motion<T> {
        body.plus(self.bias(velocity)).plus(self.ends.moved(self.end, modal))
    }
}

impl<'a, T: Scalar> Flexing<'a, T> {
    /// None.
    pub fn none() -> Self {
        Flexing {
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
    pub(super) fn end(&self, body: usize) -> Option<Carrying<'a, T>> {
        let ends = self.ends?;
        ends.of(body).map(|(number, end)| Carrying { number, end, ends })
    }
}
