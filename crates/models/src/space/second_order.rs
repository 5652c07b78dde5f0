//! What a link's bending and twist displace to second order (LNK-4, LNK-11), and so how its load and its spin stiffen it and how
//! bending moments couple with twist.
//!
//! Modal coordinates are curvatures about the section's own axes, so strains are linear in them and places are not: matter at z
//! comes nearer to the root by sigma(z), and the end is displaced by d and turned by p beyond what shapes do, all sums over pairs
//! of modes. The kinetic energy keeps what is of first order in sigma, so that all forces come from one energy and nothing is
//! lost; products of sigma with the deflection are of third order and left out. Of the link's own matter d counts along the
//! link alone: across it modes move matter, too, and a kinetic energy of first order in d were not positive.

use super::MAX_MODES_OF_LINK;
use super::ritz::{Pairs, ShapeQuadratics, quadratic};
use super::shapes::Shapes;
use super::spatial::{Rigid, SpatialMotion, SpatialWrench};
use super::vector::{Matrix3, Vector3, add, cross, dot, scale, spread, times, transposed, zero};
use trueup_numerics::Scalar;

/// A link whose displacements of second order are counted, as parameters have it; axes and origin of the body that carries it.
#[derive(Clone, Copy, Debug)]
pub struct SecondOrder<T> {
    /// Its axes as columns.
    pub axes: Matrix3<T>,
    /// m.
    pub root: Vector3<T>,
    /// kg.
    pub mass: T,
    /// m.
    pub length: T,
    /// Of bending along x and along y (the same number, or none), of torsion; its modes come in this order.
    pub shapes: Shapes,
    /// The first of its modes.
    pub first: usize,
}

/// Integrals of sigma over the mass and over the mass times z / L, per kg.
#[derive(Clone, Copy)]
struct Nearer<T> {
    area: T,
    moment: T,
}

impl<T: Scalar> Nearer<T> {
    fn zero() -> Self {
        Self { area: T::zero(), moment: T::zero() }
    }
    fn plus(self, by: T, other: Self) -> Self {
        Self { area: self.area + by * other.area, moment: self.moment + by * other.moment }
    }
}

impl<T: Scalar> SecondOrder<T> {
    fn integrals(&self) -> Option<&'static ShapeQuadratics> {
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

    /// What each mode's coordinate changes of the end's d: link's axes.
    fn shifted(&self, q: &ShapeQuadratics, eta: &[T], mut take: impl FnMut(usize, Vector3<T>)) {
        let [u, v, phi] = self.split(eta);
        let (n, over) = (T::zero(), T::constant(-1.0) / self.length);
        for j in 0..u.len() {
            let back = over * Self::row(&q.slopes.end, j, u);
            take(j, [n, Self::row(&q.shift_twist, j, phi), back]); // (LNK-11)
        }
        for j in 0..v.len() {
            let back = over * Self::row(&q.slopes.end, j, v);
            take(u.len() + j, [-Self::row(&q.shift_twist, j, phi), n, back]); // (LNK-11)
        }
        for k in 0..phi.len() {
            let [x, y] = [v, u].map(|bent| Self::column(&q.shift_twist, k, bent));
            take(u.len() + v.len() + k, [-x, y, n]); // (LNK-11)
        }
    }
    /// What each mode's coordinate changes of p: link's axes.
    fn turned(&self, q: &ShapeQuadratics, eta: &[T], mut take: impl FnMut(usize, Vector3<T>)) {
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

    /// What each mode's coordinate changes of sigma at these coordinates (or rates), by the number of the mode.
    fn nearer(&self, q: &ShapeQuadratics, eta: &[T], mut take: impl FnMut(usize, Nearer<T>)) {
        let (mut first, over) = (self.first, T::one() / self.length);
        let [u, v, _] = self.split(eta);
        for bent in [u, v] {
            for j in 0..bent.len() {
                let [area, moment] =
                    [&q.slopes.area, &q.slopes.moment].map(|pairs| over * Self::row(pairs, j, bent));
                take(first + j, Nearer { area, moment }); // (LNK-4)
            }
            first += bent.len();
        }
    }
    fn along(&self) -> Vector3<T> {
        let [_, _, along] = transposed(&self.axes);
        along
    }
    /// Integral over the mass of the place times sigma.
    fn place(&self, s: Nearer<T>) -> Vector3<T> {
        scale(self.mass, add(scale(s.area, self.root), scale(self.length * s.moment, self.along())))
    }
    /// Momentum of matter that comes nearer to the root at this rate.
    fn momentum(&self, s: Nearer<T>) -> SpatialWrench<T> {
        let back = scale(T::constant(-1.0), self.along());
        SpatialWrench { torque: cross(self.place(s), back), force: scale(self.mass * s.area, back) }
    }

    /// What it changes of the link at these coordinates and rates, the body moving so: adds to what each mode meets of the body's
    /// acceleration and to its bias, to inertia, to how that changes, to the momentum by the rates; gives the wrench of rates in
    /// pairs.
    pub(super) fn bend(
        &self,
        (eta, rates): (&[T], &[T]),
        (omega, v): (Vector3<T>, Vector3<T>),
        (coupling, bias): (&mut [SpatialWrench<T>], &mut [T]),
        (now, change, own): (&mut Rigid<T>, &mut Matrix3<T>, &mut SpatialWrench<T>),
    ) -> SpatialWrench<T> {
        let Some(q) = self.integrals() else { return SpatialWrench::zero() };
        let back = scale(T::constant(-1.0), self.along());
        let (mut sigma, mut rate) = (Nearer::zero(), Nearer::zero());
        self.nearer(q, eta, |j, by| {
            coupling[j] = coupling[j].plus(self.momentum(by));
            let turned = cross(omega, cross(omega, self.place(by)));
            bias[j] += dot(back, add(turned, scale(self.mass * by.area, cross(omega, v)))); // (LNK-4)
            sigma = sigma.plus(eta[j] * 0.5, by);
            rate = rate.plus(rates[j], by);
        });
        now.first = add(now.first, scale(self.mass * sigma.area, back)); // (LNK-4)
        spread(&mut now.inertia, self.place(sigma), back);
        spread(change, self.place(rate), back);
        *own = own.plus(self.momentum(rate));
        let mut pairs = Nearer::zero();
        self.nearer(q, rates, |j, by| pairs = pairs.plus(rates[j], by));
        self.momentum(pairs) // (LNK-4)
    }

    /// What each mode's coordinate changes of the end's d and p at these coordinates (or rates); carrier's axes, by the number of
    /// the mode.
    pub(super) fn end(&self, eta: &[T], mut take: impl FnMut(usize, SpatialMotion<T>)) {
        let Some(q) = self.integrals() else { return };
        let mut shifts = [zero(); MAX_MODES_OF_LINK];
        self.shifted(q, eta, |j, by| shifts[j] = by);
        self.turned(q, eta, |j, by| {
            let [linear, angular] = [shifts[j], by].map(|v| times(&self.axes, v));
            take(self.first + j, SpatialMotion { angular, linear });
        });
    }
}
