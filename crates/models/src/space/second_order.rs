//! What a link's bending and twist displace to second order (LNK-4, LNK-11), and so how its load and its spin stiffen it and how
//! bending moments couple with twist.
//!
//! Modal coordinates are curvatures about the section's own axes, so strains are linear in them and places are not: matter at z
//! is displaced by d beyond what shapes do, and the end is turned by p beyond theta, both sums over pairs of modes. The kinetic
//! energy keeps what is of first order in d, so that all forces come from one energy and nothing is lost; products of d with the
//! deflection are of third order and left out.

use super::MAX_MODES_OF_LINK;
use super::appendage::Shapes;
use super::flexible::spread;
use super::ritz::{Pairs, Quadratic, quadratic};
use super::spatial::{Motion, Rigid, Wrench};
use super::vector::{Matrix, Vector, add, cross, dot, scale, times, transposed, zero};
use trueup_numerics::Scalar;

/// A link whose displacements of second order are counted, as parameters have it; axes and origin of the body that carries it.
#[derive(Clone, Copy, Debug)]
pub struct SecondOrder<T> {
    /// Its axes as columns.
    pub axes: Matrix<T>,
    /// m.
    pub root: Vector<T>,
    /// kg.
    pub mass: T,
    /// m.
    pub length: T,
    /// Of bending along x and along y (the same number, or none), of torsion; its modes come in this order.
    pub shapes: Shapes,
    /// The first of its modes.
    pub first: usize,
}

/// Integrals of a displacement d over the mass and over the mass times z / L, per kg; carrier's axes.
#[derive(Clone, Copy)]
struct Matter<T> {
    area: Vector<T>,
    moment: Vector<T>,
}

impl<T: Scalar> Matter<T> {
    fn zero() -> Self {
        Self { area: zero(), moment: zero() }
    }
    fn plus(self, by: T, other: Self) -> Self {
        let area = add(self.area, scale(by, other.area));
        Self { area, moment: add(self.moment, scale(by, other.moment)) }
    }
}

impl<T: Scalar> SecondOrder<T> {
    fn integrals(&self) -> Option<&'static Quadratic> {
        quadratic(self.shapes.x.max(self.shapes.y), self.shapes.torsion)
    }
    /// Bending along x, along y, and torsion of these coordinates (or rates) of all modes.
    fn split<'a>(&self, eta: &'a [T]) -> [&'a [T]; 3] {
        let Shapes { x, y, torsion } = self.shapes;
        let (bent, twisted) = eta[self.first..][..x + y + torsion].split_at(x + y);
        [&bent[..x], &bent[x..], twisted]
    }
    /// Sum over k of pairs j, k.
    fn row(pairs: &Pairs, j: usize, of: &[T]) -> T {
        of.iter().zip(&pairs[j]).fold(T::zero(), |sum, (e, p)| sum + *e * *p)
    }
    /// Sum over j of pairs j, k.
    fn column(pairs: &Pairs, k: usize, of: &[T]) -> T {
        of.iter().zip(pairs).fold(T::zero(), |sum, (e, p)| sum + *e * p[k])
    }

    /// What each mode's coordinate changes of d, by these integrals: link's axes.
    fn displaced(&self, slopes: &Pairs, twist: &Pairs, eta: &[T], mut take: impl FnMut(usize, Vector<T>)) {
        let [u, v, phi] = self.split(eta);
        let (n, over) = (T::zero(), T::constant(-1.0) / self.length);
        for j in 0..u.len() {
            take(j, [n, Self::row(twist, j, phi), over * Self::row(slopes, j, u)]); // (LNK-4)
        }
        for j in 0..v.len() {
            let back = over * Self::row(slopes, j, v);
            take(u.len() + j, [-Self::row(twist, j, phi), n, back]); // (LNK-4)
        }
        for k in 0..phi.len() {
            let across = [-Self::column(twist, k, v), Self::column(twist, k, u), n]; // (LNK-4)
            take(u.len() + v.len() + k, across);
        }
    }
    /// What each mode's coordinate changes of p: link's axes.
    fn turned(&self, q: &Quadratic, eta: &[T], mut take: impl FnMut(usize, Vector<T>)) {
        let [u, v, phi] = self.split(eta);
        let (n, over) = (T::zero(), T::one() / self.length);
        for j in 0..u.len() {
            let about = over * over * Self::row(&q.turn_bending, j, v);
            take(j, [over * Self::row(&q.turn_twist, j, phi), n, about]); // (LNK-11)
        }
        for j in 0..v.len() {
            let about = over * over * Self::column(&q.turn_bending, j, u);
            take(u.len() + j, [n, over * Self::row(&q.turn_twist, j, phi), about]); // (LNK-11)
        }
        for k in 0..phi.len() {
            let [x, y] = [u, v].map(|bent| over * Self::column(&q.turn_twist, k, bent));
            take(u.len() + v.len() + k, [x, y, n]); // (LNK-11)
        }
    }

    /// What each mode's coordinate changes of the matter at these coordinates (or rates), by the number of the mode.
    fn matter(&self, q: &Quadratic, eta: &[T], mut each: impl FnMut(usize, Matter<T>)) {
        let mut areas = [zero(); MAX_MODES_OF_LINK];
        self.displaced(&q.slopes.area, &q.twist.area, eta, |j, by| areas[j] = times(&self.axes, by));
        self.displaced(&q.slopes.moment, &q.twist.moment, eta, |j, by| {
            each(self.first + j, Matter { area: areas[j], moment: times(&self.axes, by) });
        });
    }
    fn along(&self) -> Vector<T> {
        let [_, _, along] = transposed(&self.axes);
        along
    }
    /// Momentum of matter that is displaced at this rate.
    fn momentum(&self, d: &Matter<T>) -> Wrench<T> {
        let torque = add(cross(self.root, d.area), scale(self.length, cross(self.along(), d.moment)));
        Wrench { torque: scale(self.mass, torque), force: scale(self.mass, d.area) }
    }
    /// What an inertia gets by matter that is displaced so.
    fn spread(&self, inertia: &mut Matrix<T>, d: &Matter<T>) {
        spread(inertia, scale(self.mass, self.root), d.area);
        spread(inertia, scale(self.mass * self.length, self.along()), d.moment);
    }

    /// What it changes of the link at these coordinates and rates, the body moving so: adds to what each mode meets of the body's
    /// acceleration and to its bias, to inertia, to how that changes, to the momentum by the rates; gives the wrench of rates in
    /// pairs.
    pub(super) fn bend(
        &self,
        (eta, rates): (&[T], &[T]),
        (omega, v): (Vector<T>, Vector<T>),
        (coupling, bias): (&mut [Wrench<T>], &mut [T]),
        (now, change, own): (&mut Rigid<T>, &mut Matrix<T>, &mut Wrench<T>),
    ) -> Wrench<T> {
        let Some(q) = self.integrals() else { return Wrench::zero() };
        // Accelerations of the matter at the root and, per unit of z / L, beyond it.
        let root = add(cross(omega, cross(omega, self.root)), cross(omega, v));
        let beyond = scale(self.length, cross(omega, cross(omega, self.along())));
        let (mut displaced, mut moving) = (Matter::zero(), Matter::zero());
        self.matter(q, eta, |j, by| {
            coupling[j] = coupling[j].plus(self.momentum(&by));
            bias[j] += self.mass * (dot(by.area, root) + dot(by.moment, beyond)); // (LNK-4)
            displaced = displaced.plus(eta[j] * 0.5, by);
            moving = moving.plus(rates[j], by);
        });
        now.first = add(now.first, scale(self.mass, displaced.area)); // (LNK-4)
        self.spread(&mut now.inertia, &displaced);
        self.spread(change, &moving);
        *own = own.plus(self.momentum(&moving));
        let mut pairs = Matter::zero();
        self.matter(q, rates, |j, by| pairs = pairs.plus(rates[j], by));
        self.momentum(&pairs) // (LNK-4)
    }

    /// What each mode's coordinate changes of the end's d and p at these coordinates (or rates); carrier's axes, by the number of
    /// the mode.
    pub(super) fn end(&self, eta: &[T], mut take: impl FnMut(usize, Motion<T>)) {
        let Some(q) = self.integrals() else { return };
        let mut shifts = [zero(); MAX_MODES_OF_LINK];
        self.displaced(&q.slopes.end, &q.twist.end, eta, |j, by| shifts[j] = by);
        self.turned(q, eta, |j, by| {
            let [linear, angular] = [shifts[j], by].map(|v| times(&self.axes, v));
            take(self.first + j, Motion { angular, linear });
        });
    }
}
