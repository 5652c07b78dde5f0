//! The end of a link that bends, and how what it carries moves with it (LNK-1, LNK-2).
//!
//! The section at the end is shifted by u and turned by the rotation of Gibbs' vector theta / 2, u and theta being sums over
//! modes of their columns S, Theta at the end times their coordinates (and over pairs of them, LNK-4, LNK-11): to second order the
//! rotation vector theta, and exactly a
//! rotation. All rates come from that rotation by differentiation, so energy and momentum are exact whatever the shapes.
//!
//! Everything is in the axes of the body whose link it is, motions about that body's origin.

use super::flexible::{Appendages, LinkEnd, Modal};
use super::spatial::{SpatialFrame, SpatialMotion};
use super::vector::{Matrix3, Vector3, add, cross, dot, identity, scale, sub, times, zero};
use super::{MAX_APPENDAGES, MAX_BODIES};
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;

/// A link's end at an instant.
#[derive(Clone, Copy, Debug)]
pub struct LinkEndMotion<T> {
    /// The first of its modes and the one after the last.
    pub modes: (usize, usize),
    /// Axes that move with the end, and are the body's own while it is unbent.
    pub frame: SpatialFrame<T>,
    /// Gibbs' vector of its rotation.
    pub gibbs: Vector3<T>,
    /// Its motion against the body.
    pub velocity: SpatialMotion<T>,
    /// What its acceleration against the body has beyond the columns times the modes' accelerations.
    pub bias: SpatialMotion<T>,
}

/// The ends of all links at an instant.
#[derive(Clone, Debug)]
pub struct Ends<T> {
    all: ArrayVec<LinkEndMotion<T>, MAX_APPENDAGES>,
    /// Motion of the end per unit of each mode's rate; 0 of modes that carry nothing.
    columns: Modal<SpatialMotion<T>>,
    /// Per body which of the ends is its own.
    of: [Option<usize>; MAX_BODIES + 1],
}

impl<T: Scalar> Default for Ends<T> {
    fn default() -> Self {
        Self { all: ArrayVec::new(), columns: ArrayVec::new(), of: [None; MAX_BODIES + 1] }
    }
}

impl<T: Scalar> Ends<T> {
    /// Where all links' ends are, at these modal coordinates and rates.
    pub fn set(&mut self, appendages: &Appendages<T>, eta: &[T], rates: &[T]) {
        self.all.clear();
        self.columns.clear();
        self.of = [None; MAX_BODIES + 1];
        self.columns.extend(appendages.modes().iter().map(|_| SpatialMotion::zero()));
        for link in &appendages.links {
            self.of[link.on] = Some(self.all.len());
            let end = LinkEndMotion::new(link, appendages, (eta, rates), &mut self.columns);
            self.all.push(end);
        }
    }
    /// A point that is fixed to what this body carries, from its unbent position to its present one, body axes.
    pub fn displaced(&self, body: usize, place: Vector3<T>) -> Vector3<T> {
        self.of(body).map_or(place, |(_, e)| add(e.frame.origin, times(&e.frame.rotation, place)))
    }
    /// Of this body, if its link bends: its number and its model.
    #[inline]
    pub fn of(&self, body: usize) -> Option<(usize, &LinkEndMotion<T>)> {
        self.of[body].map(|e| (e, &self.all[e]))
    }
    /// How many there are.
    pub fn count(&self) -> usize {
        self.all.len()
    }
    /// Motion of the end per unit of the rate of mode `j`.
    #[inline]
    pub fn column(&self, j: usize) -> SpatialMotion<T> {
        self.columns[j]
    }
    /// Motion of the end by these rates (or accelerations) of the modes.
    pub fn moved(&self, end: &LinkEndMotion<T>, modal: &[T]) -> SpatialMotion<T> {
        let (first, last) = end.modes;
        (first..last).fold(SpatialMotion::zero(), |sum, j| sum.plus(self.columns[j].times(modal[j])))
    }
}

impl<T: Scalar> LinkEndMotion<T> {
    fn new(
        link: &LinkEnd<T>,
        appendages: &Appendages<T>,
        (eta, rates): (&[T], &[T]),
        columns: &mut [SpatialMotion<T>],
    ) -> Self {
        let (first, last) = link.modes;
        let reach = &appendages.reach[first..last];
        let columns = &mut columns[first..last];
        let (all_eta, all_rates) = (eta, rates);
        let (eta, rates) = (&eta[first..last], &rates[first..last]);
        columns.copy_from_slice(reach);
        let (mut shift, mut theta) = (zero(), zero());
        for (unit, eta) in reach.iter().zip(eta) {
            shift = add(shift, scale(*eta, unit.linear)); // (LNK-2)
            theta = add(theta, scale(*eta, unit.angular)); // (LNK-2)
        }
        // What accelerations of shift and theta have of rates in pairs.
        let mut pairs = SpatialMotion::zero();
        if let Some(second_order) = link.second_order.map(|s| &appendages.second_order[s]) {
            second_order.end(all_eta, |j, by| {
                let eta = eta[j - first] * 0.5;
                shift = add(shift, scale(eta, by.linear)); // (LNK-4)
                theta = add(theta, scale(eta, by.angular)); // (LNK-11)
                columns[j - first] = columns[j - first].plus(by);
            });
            second_order.end(all_rates, |j, by| pairs = pairs.plus(by.times(rates[j - first])));
        }
        let moving =
            columns.iter().zip(rates).fold(SpatialMotion::zero(), |sum, (c, r)| sum.plus(c.times(*r)));
        let (shifting, turning) = (moving.linear, moving.angular);
        let half = T::constant(0.5);
        let gibbs = scale(half, theta);
        let share = T::one() / (dot(gibbs, gibbs) + 1.0);
        let place = add(link.place, shift);
        // The rate of a rotation by that of its Gibbs vector, linear in it.
        let rate = |turning: Vector3<T>| scale(share, add(turning, cross(gibbs, turning))); // (LNK-2)
        for column in columns.iter_mut() {
            let angular = rate(column.angular);
            *column = SpatialMotion { angular, linear: add(column.linear, cross(place, angular)) };
        }
        let omega = rate(turning);
        let slower = sub(rate(pairs.angular), scale(share * dot(gibbs, turning), omega));
        let rotation = turned(gibbs, share);
        Self {
            modes: link.modes,
            frame: SpatialFrame { rotation, origin: sub(place, times(&rotation, link.place)) },
            gibbs,
            velocity: SpatialMotion { angular: omega, linear: add(shifting, cross(place, omega)) },
            bias: SpatialMotion {
                angular: slower,
                linear: add(pairs.linear, add(cross(place, slower), cross(shifting, omega))),
            },
        }
    }
}

/// The rotation of Gibbs' vector g, `share` being 1 / (1 + g^2): 1 + 2 share ([g x] + [g x]^2).
fn turned<T: Scalar>(g: Vector3<T>, share: T) -> Matrix3<T> {
    let mut m = identity();
    let two = share * 2.0;
    let square = dot(g, g);
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        for l in 0..3 {
            m[i][l] += two * g[i] * g[l];
        }
        m[i][i] -= two * square;
        m[i][j] -= two * g[k];
        m[i][k] += two * g[j];
    }
    m
}
