//! What bends on a body, as parameters have it: uniform beams, and tables of modes as tools for structures export them.

use super::flexible::{Appendages, FlexibleAppendage, Function, LinkEnd, ModalCoordinate};
use super::ritz;
use super::second_order::SecondOrder;
pub use super::shapes::Shapes;
use super::shapes::{BeamShape, MAX_SHAPES, bending, bending_at, torsion};
use super::spatial::{Articulated, Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use super::vector::{Matrix3, Vector3, add, cross, scale, times, transposed, zero};
use super::{MAX_APPENDAGES, MAX_MODES_OF_ALL, MAX_MODES_OF_LINK};
use trueup_numerics::Scalar;
use trueup_numerics::linear::ldl_factor;

/// A uniform beam, clamped to a body at its root, z along it (SFF-5; S1 3b, 4). It has no rotary inertia but about z.
#[derive(Clone, Copy, Debug)]
pub struct Beam<T> {
    /// Its axes in those of the body; the origin is the root.
    pub frame: SpatialFrame<T>,
    /// m.
    pub length: T,
    /// kg/m.
    pub mass_per_length: T,
    /// E I of bending along x and along y, N.m2 (S1's I_x is about x).
    pub bending_stiffness: [T; 2],
    /// G J, N.m2.
    pub torsion_stiffness: T,
    /// rho I_p, kg.m.
    pub polar_inertia_per_length: T,
    /// Of every mode.
    pub damping_ratio: T,
}

/// A mode of a table, mass-normalised: its coordinate's mass is 1, and its unit that of a mass-normalised coordinate.
#[derive(Clone, Copy, Debug)]
pub struct TableMode<T> {
    /// Clamped, rad/s.
    pub frequency: T,
    /// Of critical.
    pub damping_ratio: T,
    /// Momentum and angular momentum about the root per unit of its rate, appendage's axes.
    pub participation: SpatialWrench<T>,
}

/// An appendage that does not fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AppendageError {
    /// More of them than [`MAX_APPENDAGES`].
    Appendages,
    /// More modes than there is room for, or more shapes in a direction than [`MAX_SHAPES`].
    Modes,
    /// A mode without mass: its number in the appendage, from 0.
    Massless(usize),
    /// A link bends by another number of shapes along x than along y.
    Unlike,
    /// Modes that move more mass than the appendage has: along x, y, z (0 to 2, kg) or about x, y, z through the root (3 to 5,
    /// kg.m2) what they move and what there is; `None`: not along an axis, but together.
    Participation(Option<(usize, f64, f64)>),
}

impl std::fmt::Display for AppendageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Appendages => write!(f, "there are more than {MAX_APPENDAGES} appendages; give fewer"),
            Self::Modes => write!(
                f,
                "there are more modes than there is room for ({MAX_SHAPES} shapes in a direction, {MAX_MODES_OF_ALL} modes of all appendages); give fewer"
            ),
            Self::Massless(j) => write!(
                f,
                "mode {} has no mass above 0; give length, mass and polar inertia per length above 0, or no shapes of this kind",
                j + 1
            ),
            Self::Unlike => write!(
                f,
                "it has another number of shapes along x than along y, and would lose energy; give the same, or 0 in one of them"
            ),
            Self::Participation(direction) => {
                match direction {
                    Some((k, moved, there)) => {
                        let axis = ["x", "y", "z"][k % 3];
                        let (way, unit) =
                            if *k < 3 { ("along", "kg") } else { ("about", "kg.m2 through its root") };
                        write!(f, "its modes move {moved:.4} {unit} {way} {axis}, and it has {there:.4}")?;
                    }
                    None => write!(f, "its modes together move more than its mass and inertia")?,
                }
                write!(
                    f,
                    "; give mass-normalised participation (kg^0.5, about the root kg^0.5.m), or all of its mass and inertia"
                )
            }
        }
    }
}
impl std::error::Error for AppendageError {}

/// A slender beam about its root, unbent, along the unit vector `z`; it has no rotary inertia but `polar`, about z.
pub(super) fn rod<T: Scalar>(mass: T, length: T, polar: T, z: Vector3<T>) -> Rigid<T> {
    let across = mass * length * length / 3.0;
    let mut inertia = [zero(); 3];
    for i in 0..3 {
        inertia[i] = scale((polar - across) * z[i], z);
        inertia[i][i] += across;
    }
    Rigid { mass, first: scale(mass * length * 0.5, z), inertia }
}

impl<T: Scalar> ModalCoordinate<T> {
    /// Of a beam of this mass (polar inertia), of 1 over it, of this stiffness, and of this damping where critical damping is 1.
    fn of(shape: &BeamShape, mass: T, inverse: T, stiffness: T, damping: T) -> Self {
        Self {
            along: zero(),
            fixed: SpatialWrench::zero(),
            mass: mass * shape.square,
            inverse: inverse / shape.square,
            stiffness: stiffness * shape.stiffness,
            damping: damping * shape.critical,
        }
    }
    fn along(self, direction: Vector3<T>) -> Self {
        Self { along: direction, ..self }
    }
}

impl<T: Scalar> Appendages<T> {
    /// Adds a beam on body `on` (0: the base), which the tree must have. Modes come in the order of [`Shapes`].
    ///
    /// # Errors
    /// No room, or a mode that has no mass.
    pub fn add_beam(&mut self, on: usize, shapes: Shapes, beam: &Beam<T>) -> Result<(), AppendageError> {
        self.whole(|all| all.put_beam(on, shapes, beam, None))
    }

    /// Adds a beam that is the link of body `on` (from 1; LNK-5): what the body carries hangs on its end. A body has one.
    /// `stiffening`: bending shortens it (LNK-4).
    ///
    /// # Errors
    /// No room, a mode that has no mass, another number of shapes along x than along y.
    pub fn add_link(
        &mut self,
        on: usize,
        shapes: Shapes,
        beam: &Beam<T>,
        stiffening: bool,
    ) -> Result<(), AppendageError> {
        if shapes.x != shapes.y && shapes.x.min(shapes.y) > 0 {
            return Err(AppendageError::Unlike);
        }
        let [_, _, ez] = transposed(&beam.frame.rotation);
        let place = add(beam.frame.origin, scale(beam.length, ez));
        self.whole(|all| all.put_beam(on, shapes, beam, Some((place, stiffening))))
    }

    /// `end`: the place of its end, if it carries what the body carries, and whether bending shortens it.
    fn put_beam(
        &mut self,
        on: usize,
        shapes: Shapes,
        beam: &Beam<T>,
        end: Option<(Vector3<T>, bool)>,
    ) -> Result<(), AppendageError> {
        let Beam { frame, length, mass_per_length, polar_inertia_per_length, .. } = *beam;
        let [ex, ey, ez] = transposed(&frame.rotation);
        let (mass, polar) = (mass_per_length * length, polar_inertia_per_length * length);
        let mut part = self.open(on, rod(mass, length, polar, ez).shifted(frame.origin), shapes.modes())?;
        // Integrals, and the slope at the end, of which an appendage makes no use.
        let bent = |j: usize| {
            let of_link = || ritz::bending(shapes.x.max(shapes.y), j).map(|l| (l.shape, l.slope));
            let own = if end.is_some() { of_link() } else { bending(j).map(|s| (s, 0.0)) };
            own.ok_or(AppendageError::Modes)
        };
        let twisted = |j: usize| {
            let own =
                if end.is_some() { ritz::torsion(shapes.torsion, j).map(|l| l.shape) } else { torsion(j) };
            own.ok_or(AppendageError::Modes)
        };
        let from = self.functions.len();
        for j in 0..shapes.x.max(shapes.y) {
            let (s, _) = bent(j)?;
            let area = mass * s.area;
            // Over the place: root + z along the beam.
            let moment = add(scale(area, frame.origin), scale(mass * length * s.moment, ez));
            self.functions.push(Function { square: mass * s.square, area, moment, modes: [None; 2] });
        }
        let cube = length * length * length;
        let inverse = [T::one() / mass, T::one() / polar];
        for (side, (direction, count)) in [(ex, shapes.x), (ey, shapes.y)].into_iter().enumerate() {
            let stiffness = beam.bending_stiffness[side] / cube;
            let damping = beam.damping_ratio * (mass * stiffness).sqrt();
            for j in 0..count {
                let (s, slope) = bent(j)?;
                self.functions[from + j].modes[side] = Some(self.modes.len());
                let turn = scale(T::constant(slope) / length, cross(ez, direction)); // (LNK-1)
                let reach = SpatialMotion { angular: turn, linear: direction };
                let own = ModalCoordinate::of(&s, mass, inverse[0], stiffness, damping).along(direction);
                self.put(&part, own, reach)?;
            }
        }
        let stiffness = beam.torsion_stiffness / length;
        let damping = beam.damping_ratio * (polar * stiffness).sqrt();
        for j in 0..shapes.torsion {
            let s = twisted(j)?;
            let turning = SpatialWrench { torque: scale(polar * s.area, ez), force: zero() };
            let own = ModalCoordinate {
                fixed: turning,
                ..ModalCoordinate::of(&s, polar, inverse[1], stiffness, damping)
            };
            self.put(&part, own, SpatialMotion { angular: ez, linear: zero() })?;
        }
        part.functions.1 = self.functions.len();
        part.modes.1 = self.modes.len();
        if let Some((place, stiffening)) = end {
            part.carries = true;
            part.second_order = (stiffening && shapes.x.max(shapes.y) > 0).then_some(self.second_order.len());
            if part.second_order.is_some() {
                let (axes, root, first) = (frame.rotation, frame.origin, part.modes.0);
                self.second_order.push(SecondOrder { axes, root, mass, length, shapes, first });
            }
            self.links.push(LinkEnd { on, place, modes: part.modes, second_order: part.second_order });
        }
        self.parts.push(part);
        Ok(())
    }

    /// Adds an appendage by a table of modes: `rigid` is the whole of it unbent, about its root, own axes. Its centre of mass
    /// moves as its momentum has it; what bending changes of its inertia is not in such a table and is left out, which keeps
    /// momentum and energy all the same.
    ///
    /// # Errors
    /// No room, or modes that move more than there is.
    pub fn add_table(
        &mut self,
        on: usize,
        frame: &SpatialFrame<T>,
        rigid: &Rigid<T>,
        table: &[TableMode<T>],
    ) -> Result<(), AppendageError> {
        participation(rigid, table)?;
        self.put_table(on, frame, rigid, table.iter().map(|m| (*m, SpatialMotion::zero())), None)
    }

    /// Adds a table of modes that is the link of body `on` (from 1; LNK-5): what the body carries hangs on its end, which is
    /// at `end` unbent. Each mode comes with how it shifts and turns the end per unit of its coordinate (S, kg^-0.5; Theta,
    /// kg^-0.5/m). All is in the link's axes. A body has one link.
    ///
    /// # Errors
    /// No room, or modes that move more than there is.
    pub fn add_link_table(
        &mut self,
        on: usize,
        frame: &SpatialFrame<T>,
        rigid: &Rigid<T>,
        table: &[(TableMode<T>, SpatialMotion<T>)],
        end: Vector3<T>,
    ) -> Result<(), AppendageError> {
        let modes: Vec<_> = table.iter().map(|m| m.0).collect();
        participation(rigid, &modes)?;
        self.put_table(on, frame, rigid, table.iter().copied(), Some(end))
    }

    /// As [`Self::add_table`] or, with an end, [`Self::add_link_table`], of modes that are known not to move more than there is.
    ///
    /// # Errors
    /// No room.
    pub(super) fn put_table(
        &mut self,
        on: usize,
        frame: &SpatialFrame<T>,
        rigid: &Rigid<T>,
        table: impl ExactSizeIterator<Item = (TableMode<T>, SpatialMotion<T>)>,
        end: Option<Vector3<T>>,
    ) -> Result<(), AppendageError> {
        if end.is_some() && table.len() > MAX_MODES_OF_LINK {
            return Err(AppendageError::Modes);
        }
        self.whole(|all| {
            let mut part = all.open(on, rigid.outwards(frame), table.len())?;
            for (mode, moved) in table {
                let own = ModalCoordinate {
                    along: zero(),
                    fixed: frame.outwards(mode.participation),
                    mass: T::one(),
                    inverse: T::one(),
                    stiffness: mode.frequency * mode.frequency,
                    damping: mode.damping_ratio * mode.frequency * 2.0,
                };
                let turned = |v: Vector3<T>| times(&frame.rotation, v);
                let reach = SpatialMotion { angular: turned(moved.angular), linear: turned(moved.linear) };
                all.put(&part, own, reach)?;
            }
            part.modes.1 = all.modes.len();
            if let Some(end) = end {
                part.carries = true;
                let place = add(frame.origin, times(&frame.rotation, end));
                all.links.push(LinkEnd { on, place, modes: part.modes, second_order: None });
            }
            all.parts.push(part);
            Ok(())
        })
    }

    /// Adds an appendage, or nothing of it.
    fn whole(
        &mut self,
        add: impl FnOnce(&mut Self) -> Result<(), AppendageError>,
    ) -> Result<(), AppendageError> {
        let before = (self.functions.len(), self.modes.len());
        add(self).inspect_err(|_| {
            self.functions.truncate(before.0);
            self.modes.truncate(before.1);
            self.reach.truncate(before.1);
        })
    }

    /// Begins an appendage, for which there is room.
    fn open(&self, on: usize, rigid: Rigid<T>, modes: usize) -> Result<FlexibleAppendage<T>, AppendageError> {
        if modes > self.modes.remaining_capacity() {
            return Err(AppendageError::Modes);
        }
        if self.parts.is_full() {
            return Err(AppendageError::Appendages);
        }
        let (functions, first) = (self.functions.len(), self.modes.len());
        Ok(FlexibleAppendage {
            on,
            rigid,
            functions: (functions, functions),
            modes: (first, first),
            carries: false,
            second_order: None,
        })
    }
    /// A mode and how it moves the end.
    fn put(
        &mut self,
        part: &FlexibleAppendage<T>,
        mode: ModalCoordinate<T>,
        reach: SpatialMotion<T>,
    ) -> Result<(), AppendageError> {
        if mode.mass.value() <= 0.0 || !mode.mass.value().is_finite() {
            return Err(AppendageError::Massless(self.modes.len() - part.modes.0));
        }
        self.modes.push(mode);
        self.reach.push(reach);
        Ok(())
    }
}

/// Whether the inertia that is left when the modes move freely is that of a body, or 0 within rounding.
///
/// # Errors
/// It is not.
pub fn participation<T: Scalar>(rigid: &Rigid<T>, table: &[TableMode<T>]) -> Result<(), AppendageError> {
    let mut left = Articulated::rigid(rigid);
    let diagonal = |m: &Matrix3<T>| (m[0][0] + m[1][1] + m[2][2]).value();
    // A complete set leaves nothing, and a rod nothing about its axis.
    let little = [diagonal(&left.angular), diagonal(&left.linear)].map(|d| 1e-9 * d);
    table.iter().for_each(|m| left.take(&m.participation, T::one()));
    let mut m = [0.0; 36];
    for i in 0..3 {
        for j in 0..3 {
            m[6 * i + j] = left.angular[i][j].value();
            m[6 * (i + 3) + j] = left.mixed[j][i].value();
            m[6 * (i + 3) + j + 3] = left.linear[i][j].value();
        }
        m[7 * i] += little[0];
        m[7 * (i + 3)] += little[1];
    }
    if ldl_factor(&mut m, 6).is_ok() {
        return Ok(());
    }
    let direction = (0..6).find_map(|k| {
        let there = if k < 3 { rigid.mass } else { rigid.inertia[k - 3][k - 3] }.value();
        let part = |w: &SpatialWrench<T>| if k < 3 { w.force[k] } else { w.torque[k - 3] }.value();
        let moved: f64 = table.iter().map(|m| part(&m.participation).powi(2)).sum();
        (moved > there).then_some((k, moved, there))
    });
    Err(AppendageError::Participation(direction))
}

impl Beam<f64> {
    /// The lowest of its frequencies, clamped, rad/s; infinite without shapes.
    pub fn first_frequency(&self, shapes: Shapes) -> f64 {
        let root = bending(0).map_or(0.0, |s| s.root);
        let bent =
            |stiffness: f64| root * root * (stiffness / self.mass_per_length).sqrt() / self.length.powi(2);
        let turned = (self.torsion_stiffness / self.polar_inertia_per_length).sqrt() / self.length;
        let all = [
            (shapes.x, bent(self.bending_stiffness[0])),
            (shapes.y, bent(self.bending_stiffness[1])),
            (shapes.torsion, torsion(0).map_or(0.0, |s| s.root) * turned),
        ];
        all.iter().filter(|(shapes, _)| *shapes > 0).map(|(_, f)| *f).fold(f64::INFINITY, f64::min)
    }
}

impl<T: Scalar> Beam<T> {
    /// The tip at these modal coordinates of this beam, axes of the body that carries it, m.
    pub fn tip(&self, shapes: Shapes, eta: &[T]) -> Vector3<T> {
        self.point(shapes, eta, 1.0)
    }
    /// The point at the share `z` (0 .. 1) of the length.
    pub fn point(&self, shapes: Shapes, eta: &[T], z: f64) -> Vector3<T> {
        let along = |from: usize, count: usize| {
            (0..count).fold(T::zero(), |sum, j| sum + eta[from + j] * bending_at(j, z))
        };
        let place = [along(0, shapes.x), along(shapes.x, shapes.y), self.length * z];
        add(self.frame.origin, times(&self.frame.rotation, place))
    }
}
