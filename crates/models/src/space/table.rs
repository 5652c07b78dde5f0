//! Appendages and links by tables of modes, as a file has them and as parameters have them.

use super::appendage::{AppendageError, TableMode, participation};
use super::attitude::{Quaternion, four, rotation};
use super::body_check::{inertia_fault, off_unit};
use super::model::SpatialFreeFlyer;
use super::spatial::{Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use super::vector::{Matrix3, Vector3, matrix, three};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

/// What bends on the base, or the link of a body, known by its modes, clamped at its root, as tools for structures give them.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeTable {
    /// Its name.
    pub name: String,
    /// Its root, axes of what carries it, m.
    pub position: Vector3<f64>,
    /// Own axes to those: w, x, y, z.
    pub orientation: Quaternion<f64>,
    /// Of the whole, kg.
    pub mass: f64,
    /// From the root, own axes, m.
    pub center_of_mass: Vector3<f64>,
    /// About the centre of mass, own axes, kg.m2.
    pub inertia: Matrix3<f64>,
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
        let participation = SpatialWrench { force: [a, b, c], torque: [d, e, f] };
        TableMode { frequency: self.frequency, damping_ratio: self.damping_ratio, participation }
    }
}

impl ModeTable {
    /// The whole of it unbent, about its root, own axes.
    pub fn rigid(&self) -> Rigid<f64> {
        Rigid::new(self.mass, self.center_of_mass, &self.inertia)
    }
    /// Its axes in those of what carries it.
    pub fn frame(&self) -> SpatialFrame<f64> {
        SpatialFrame { rotation: rotation(self.orientation), origin: self.position }
    }
    /// Its modes as the kernels have them.
    pub fn rows(&self) -> Vec<TableMode<f64>> {
        self.modes.iter().map(TabledMode::row).collect()
    }
}

impl ModeTable {
    /// Whether this can be.
    ///
    /// # Errors
    /// What cannot, with the remedy.
    pub fn check(&self) -> Result<(), String> {
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        if !(self.mass > 0.0 && self.mass.is_finite()) {
            return Err(format!("mass = {}: give it a mass above 0", self.mass));
        }
        if let Some(why) = inertia_fault(&self.inertia) {
            return Err(why);
        }
        if off_unit(self.orientation) || !finite(&self.position) || !finite(&self.center_of_mass) {
            return Err(
                "give finite position and center-of-mass, and a unit quaternion as orientation".to_owned()
            );
        }
        for (m, mode) in self.modes.iter().enumerate() {
            let all = finite(&[mode.frequency, mode.damping_ratio]) && finite(&mode.participation);
            if !all || mode.frequency <= 0.0 || mode.damping_ratio < 0.0 {
                return Err(format!(
                    "mode {}: give a frequency above 0, a damping ratio of 0 or above, and six finite numbers",
                    m + 1
                ));
            }
        }
        participation(&self.rigid(), &self.rows()).map_err(|why| why.to_string())
    }
}

/// The link of a body by a table of modes (LNK-5): what the body carries hangs on its end. The body's own mass and inertia are
/// what sits at its joint, without the link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkTable {
    /// The body, from 1.
    pub body: usize,
    /// The link without anything on its end; its name is the body's.
    pub table: ModeTable,
    /// Its end unbent, from its root, own axes, m.
    pub end: Vector3<f64>,
    /// Per mode how it shifts the end (S, kg^-0.5) and turns it (Theta, kg^-0.5/m) per unit of its coordinate, own axes.
    pub reach: Vec<ModeReach>,
}

/// How a mass-normalised mode moves the end of a link, own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeReach {
    /// S, kg^-0.5.
    pub shift: Vector3<f64>,
    /// Theta, kg^-0.5/m.
    pub turn: Vector3<f64>,
}

impl LinkTable {
    /// Its modes with what they do to the end, as the kernels have them.
    pub fn rows(&self) -> Vec<(TableMode<f64>, SpatialMotion<f64>)> {
        let reach = self.reach.iter().map(|r| SpatialMotion { angular: r.turn, linear: r.shift });
        self.table.rows().into_iter().zip(reach).collect()
    }

    /// Whether this can be.
    ///
    /// # Errors
    /// What cannot, with the remedy.
    pub fn check(&self) -> Result<(), String> {
        let (modes, ends) = (self.table.modes.len(), self.reach.len());
        if modes == 0 || modes != ends {
            return Err(format!(
                "it has {modes} modes and {ends} shifts and turns of its end; give one mode or more, and one of each per mode"
            ));
        }
        let numbers = self.reach.iter().flat_map(|r| r.shift.into_iter().chain(r.turn)).chain(self.end);
        if numbers.into_iter().any(|v| !v.is_finite()) {
            return Err("give its end, and the end's shifts and turns, by finite numbers".to_owned());
        }
        self.table.check()
    }
}

impl SpatialFreeFlyer {
    /// Axes, whole and end of link table `k` (from 0).
    pub(super) fn link_table<T: Scalar>(&self, p: &[T], k: usize) -> (SpatialFrame<T>, Rigid<T>, Vector3<T>) {
        let (at, link) = (&self.parameter, self.structure().beams().count() + k);
        let (center, inertia) =
            (three(p, at.link_table_center + 3 * k), matrix(p, at.link_table_inertia + 9 * k));
        let rigid = Rigid::new(p[at.link_table_mass + k], center, &inertia);
        (self.link_frame(p, link), rigid, three(p, at.link_end + 3 * k))
    }

    /// `count` modes of link tables, the first of which is `first`, with what they do to the end.
    pub(super) fn link_table_modes<'a, T: Scalar>(
        &self,
        p: &'a [T],
        first: usize,
        count: usize,
    ) -> impl ExactSizeIterator<Item = (TableMode<T>, SpatialMotion<T>)> + 'a {
        let at = self.parameter;
        (first..first + count).map(move |m| {
            let mode = TableMode {
                frequency: p[at.link_mode_frequency + m],
                damping_ratio: p[at.link_mode_damping + m],
                participation: SpatialWrench {
                    force: three(p, at.link_mode_participation + 6 * m),
                    torque: three(p, at.link_mode_participation + 6 * m + 3),
                },
            };
            let reach = SpatialMotion {
                angular: three(p, at.link_mode_turn + 3 * m),
                linear: three(p, at.link_mode_shift + 3 * m),
            };
            (mode, reach)
        })
    }

    /// Axes and whole of table `k` (from 0).
    pub(super) fn table<T: Scalar>(&self, p: &[T], k: usize) -> (SpatialFrame<T>, Rigid<T>) {
        let (at, part) = (&self.parameter, self.structure().appendages.len() + k);
        let frame = SpatialFrame {
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
            participation: SpatialWrench {
                force: three(p, at.mode_participation + 6 * m),
                torque: three(p, at.mode_participation + 6 * m + 3),
            },
        })
    }

    /// Whether the modes of each table move no more than there is: else the table (from 0), its first mode, and why not.
    pub(super) fn table_fault(&self, p: &[f64]) -> Option<(usize, usize, AppendageError)> {
        let counts = self.structure().tables.iter().copied();
        moves_more(counts, |k, first, count| {
            (self.table(p, k).1, self.table_modes(p, first, count).collect())
        })
    }

    /// The same of link tables.
    pub(super) fn link_table_fault(&self, p: &[f64]) -> Option<(usize, usize, AppendageError)> {
        moves_more(self.structure().link_tables().map(|t| t.1), |k, first, count| {
            let modes = self.link_table_modes(p, first, count).map(|m| m.0);
            (self.link_table(p, k).1, modes.collect())
        })
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

    /// Warns where the base spins faster than a fifth of an appendage's first frequency: nothing stiffens what bends here, so
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

/// The first of tables with so many modes each, identified by their number, first mode and count, whose modes move more than there is.
fn moves_more(
    counts: impl Iterator<Item = usize>,
    table: impl Fn(usize, usize, usize) -> (Rigid<f64>, Vec<TableMode<f64>>),
) -> Option<(usize, usize, AppendageError)> {
    let mut first = 0;
    for (k, count) in counts.enumerate() {
        let (rigid, rows) = table(k, first, count);
        if let Err(why) = participation(&rigid, &rows) {
            return Some((k, first, why));
        }
        first += count;
    }
    None
}

/// Share of the first frequency up to which spin may be left out of the stiffness.
const SLOW_SPIN: f64 = 0.2;
