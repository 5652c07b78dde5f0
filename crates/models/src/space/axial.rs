//! How bending shortens a link, and so how a load along it, its weight or its spin stiffen it (LNK-4).
//!
//! What lies at z comes nearer to the root by sigma(z) = 1/2 integral of (du/dz)^2 from 0 to z. The kinetic energy keeps what is of
//! first order in sigma, so that all forces come from one energy and nothing is lost; products of sigma with the deflection are
//! of third order and left out.

use super::flexible::spread;
use super::ritz::{Shortening, shortening};
use super::spatial::{Rigid, Wrench};
use super::vector::{Matrix, Vector, add, cross, dot, scale};
use trueup_numerics::Scalar;

/// A link that is shortened by bending, as parameters have it; axes and origin of the body that carries it.
#[derive(Clone, Copy, Debug)]
pub struct Axial<T> {
    /// Along it.
    pub along: Vector<T>,
    /// m.
    pub root: Vector<T>,
    /// kg.
    pub mass: T,
    /// m.
    pub length: T,
    /// Shapes of each direction of bending; integrals are those of so many.
    pub shapes: usize,
    /// The first mode of bending along x and along y, where there are any.
    pub first: [Option<usize>; 2],
}

/// A sum over pairs of modes: of the end, of all matter, of all matter times z / L.
#[derive(Clone, Copy)]
struct Sums<T> {
    end: T,
    area: T,
    moment: T,
}

impl<T: Scalar> Axial<T> {
    fn pairs(&self) -> impl Iterator<Item = (usize, usize, usize, usize)> + '_ {
        let n = self.shapes;
        let starts = self.first.into_iter().flatten();
        starts.flat_map(move |first| {
            (0..n).flat_map(move |j| (0..n).map(move |k| (first + j, first + k, j, k)))
        })
    }
    /// 1 / L times the sum of a_j b_k and the integrals.
    fn sums(&self, a: &[T], b: &[T]) -> Sums<T> {
        let Some(s) = shortening(self.shapes) else {
            return Sums { end: T::zero(), area: T::zero(), moment: T::zero() };
        };
        let (mut end, mut area, mut moment) = (T::zero(), T::zero(), T::zero());
        for (p, q, j, k) in self.pairs() {
            let product = a[p] * b[q];
            end += product * s.end[j][k];
            area += product * s.area[j][k];
            moment += product * s.moment[j][k];
        }
        let over = T::one() / self.length;
        Sums { end: end * over, area: area * over, moment: moment * over }
    }
    /// The same by one of the coordinates: what mode `mode` changes of it.
    fn row(&self, s: &Shortening, eta: &[T], first: usize, j: usize) -> Sums<T> {
        let (mut end, mut area, mut moment) = (T::zero(), T::zero(), T::zero());
        for k in 0..self.shapes {
            let eta = eta[first + k];
            end += eta * s.end[j][k];
            area += eta * s.area[j][k];
            moment += eta * s.moment[j][k];
        }
        let over = T::one() / self.length;
        Sums { end: end * over, area: area * over, moment: moment * over }
    }
    /// Integral over the mass of the place times sigma, of sums.
    fn place(&self, s: &Sums<T>) -> Vector<T> {
        scale(self.mass, add(scale(s.area, self.root), scale(self.length * s.moment, self.along)))
    }
    /// Momentum of matter that comes nearer to the root by these sums.
    fn momentum(&self, s: &Sums<T>) -> Wrench<T> {
        let back = scale(T::constant(-1.0), self.along);
        Wrench { torque: cross(self.place(s), back), force: scale(self.mass * s.area, back) }
    }

    /// What it changes of the link at these coordinates and rates: adds to inertia, to how that changes, to the momentum by the
    /// rates; gives the wrench of rates in pairs.
    pub(super) fn shorten(
        &self,
        (eta, rates): (&[T], &[T]),
        now: &mut Rigid<T>,
        change: &mut Matrix<T>,
        own: &mut Wrench<T>,
    ) -> Wrench<T> {
        let half = T::constant(0.5);
        let whole = self.sums(eta, eta);
        let sigma = Sums { end: whole.end * half, area: whole.area * half, moment: whole.moment * half };
        let back = scale(T::constant(-1.0), self.along);
        now.first = add(now.first, scale(self.mass * sigma.area, back)); // (LNK-4)
        spread(&mut now.inertia, self.place(&sigma), back);
        let rate = self.sums(eta, rates);
        spread(change, self.place(&rate), back);
        *own = own.plus(self.momentum(&rate));
        self.momentum(&self.sums(rates, rates)) // (LNK-4)
    }

    /// Adds to what each of its modes meets of the body's acceleration, and to its bias, the body moving so.
    pub(super) fn couple(
        &self,
        eta: &[T],
        (omega, v): (Vector<T>, Vector<T>),
        coupling: &mut [Wrench<T>],
        bias: &mut [T],
    ) {
        let Some(s) = shortening(self.shapes) else { return };
        for first in self.first.into_iter().flatten() {
            for j in 0..self.shapes {
                let row = self.row(s, eta, first, j);
                coupling[first + j] = coupling[first + j].plus(self.momentum(&row));
                let place = self.place(&row);
                let pull =
                    add(cross(omega, cross(omega, place)), scale(self.mass * row.area, cross(omega, v)));
                bias[first + j] -= dot(self.along, pull); // (LNK-4)
            }
        }
    }

    /// How far the end comes nearer, its rate, and what its acceleration has of rates in pairs; m, m/s, m/s2.
    pub(super) fn end(&self, eta: &[T], rates: &[T]) -> [T; 3] {
        [self.sums(eta, eta).end * 0.5, self.sums(eta, rates).end, self.sums(rates, rates).end]
    }
    /// The rate at which the end comes nearer per unit of the rate of each mode.
    pub(super) fn end_by(&self, eta: &[T], mut take: impl FnMut(usize, T)) {
        let Some(s) = shortening(self.shapes) else { return };
        for first in self.first.into_iter().flatten() {
            (0..self.shapes).for_each(|j| take(first + j, self.row(s, eta, first, j).end));
        }
    }
}
