//! Appendages by tables of modes, as a file has them and as parameters have them.

use super::appendage::{AppendageError, TableMode, participation};
use super::attitude::{Quaternion, rotation};
use super::instant::{four, matrix, three};
use super::model::SpatialFreeFlyer;
use super::spatial::{Frame, Rigid, Wrench};
use super::vector::{Matrix, Vector};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

/// An appendage of the base that is known by its modes, clamped at its root, as tools for structures tell them.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Its name.
    pub name: String,
    /// Its root, base axes, m.
    pub position: Vector<f64>,
    /// Own axes to the base's: w, x, y, z.
    pub orientation: Quaternion<f64>,
    /// Of the whole, kg.
    pub mass: f64,
    /// From the root, own axes, m.
    pub center_of_mass: Vector<f64>,
    /// About the centre of mass, own axes, kg.m2.
    pub inertia: Matrix<f64>,
    /// Its modes.
    pub modes: Vec<TabledMode>,
}

/// A mode, mass-normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TabledMode {
    /// rad/s.
    pub frequency: f64,
    /// Of critical.
    pub damping_ratio: f64,
    /// Momentum (kg^0.5) and angular momentum about the root (kg^0.5 m) per unit of its rate, own axes.
    pub participation: [f64; 6],
}

impl TabledMode {
    fn row(&self) -> TableMode<f64> {
        let [a, b, c, d, e, f] = self.participation;
        let participation = Wrench { force: [a, b, c], torque: [d, e, f] };
        TableMode { frequency: self.frequency, damping_ratio: self.damping_ratio, participation }
    }
}

impl Table {
    /// The whole of it unbent, about its root, own axes.
    pub fn rigid(&self) -> Rigid<f64> {
        Rigid::new(self.mass, self.center_of_mass, &self.inertia)
    }
    /// Its axes in those of the base.
    pub fn frame(&self) -> Frame<f64> {
        Frame { rotation: rotation(self.orientation), origin: self.position }
    }
    /// Its modes as the kernels have them.
    pub fn rows(&self) -> Vec<TableMode<f64>> {
        self.modes.iter().map(TabledMode::row).collect()
    }
}

impl SpatialFreeFlyer {
    /// Axes and whole of table `k` (from 0).
    pub(super) fn table<T: Scalar>(&self, p: &[T], k: usize) -> (Frame<T>, Rigid<T>) {
        let (at, part) = (&self.parameter, self.structure().appendages.len() + k);
        let frame = Frame {
            rotation: rotation(four(p, at.appendage_orientation + 4 * part)),
            origin: three(p, at.appendage_position + 3 * part),
        };
        let center = three(p, at.table_center + 3 * k);
        (frame, Rigid::new(p[at.table_mass + k], center, &matrix(p, at.table_inertia + 9 * k)))
    }

    /// `count` modes of tables, the first of which is `first`.
    pub(super) fn table_modes<'a, T: Scalar>(
        &self,
        p: &'a [T],
        first: usize,
        count: usize,
    ) -> impl ExactSizeIterator<Item = TableMode<T>> + 'a {
        let at = self.parameter;
        (first..first + count).map(move |m| TableMode {
            frequency: p[at.mode_frequency + m],
            damping_ratio: p[at.mode_damping + m],
            participation: Wrench {
                force: three(p, at.mode_participation + 6 * m),
                torque: three(p, at.mode_participation + 6 * m + 3),
            },
        })
    }

    /// Whether the modes of each table move no more than there is: else the table (from 0), its first mode, and why not.
    pub(super) fn table_fault(&self, p: &[f64]) -> Option<(usize, usize, AppendageError)> {
        let mut first = 0;
        for (k, count) in self.structure().tables.iter().enumerate() {
            let rows: Vec<_> = self.table_modes(p, first, *count).collect();
            if let Err(why) = participation(&self.table(p, k).1, &rows) {
                return Some((k, first, why));
            }
            first += count;
        }
        None
    }

    /// The lowest frequency of an appendage's modes, clamped, rad/s: beams first, then tables; infinite without modes.
    pub(super) fn first_frequency(&self, at: &At<'_, f64>, part: usize) -> f64 {
        let s = self.structure();
        if let Some(shapes) = s.appendages.get(part) {
            return self.beam(at, part).first_frequency(*shapes);
        }
        let k = part - s.appendages.len();
        let first: usize = s.tables[..k].iter().sum();
        self.table_modes(at.p, first, s.tables[k]).map(|m| m.frequency).fold(f64::INFINITY, f64::min)
    }

    /// Says so where the base spins faster than a fifth of an appendage's first frequency: nothing stiffens what bends here, so
    /// the model is wrong there.
    pub fn too_fast(&self, at: &At<'_, f64>) -> Option<String> {
        let s = self.structure();
        if s.held {
            return None;
        }
        let [a, b, c] = three(at.x, self.state.base_angular_velocity);
        let spin = (a * a + b * b + c * c).sqrt();
        let (part, first) = (0..s.appendages.len() + s.tables.len())
            .map(|part| (part, self.first_frequency(at, part)))
            .reduce(|a, b| if b.1 < a.1 { b } else { a })?;
        (spin > SLOW_SPIN * first).then(|| {
            format!(
                "the base spins at {spin:.4} rad/s at time {:?} s, above a fifth of the first frequency of appendage {} ({first:.4} rad/s clamped): nothing stiffens an appendage that spins in this model, so it bends too far; spin below {:.4} rad/s, or give it the frequencies that it has when it spins",
                at.t,
                part + 1,
                SLOW_SPIN * first
            )
        })
    }
}

/// Share of the first frequency up to which spin may be left out of the stiffness.
const SLOW_SPIN: f64 = 0.2;
