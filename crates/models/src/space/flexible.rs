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

use super::second_order::SecondOrder;
use super::spatial::{Rigid, SpatialMotion, SpatialWrench};
use super::vector::Vector3;
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
    pub moment: Vector3<T>,
    /// The modes that shift matter by it, each along a direction of its own.
    pub modes: [Option<usize>; 2],
}

/// A mode: mass, spring and damper of its coordinate (m; rad where it turns), and what it moves.
#[derive(Clone, Copy, Debug)]
pub struct ModalCoordinate<T> {
    /// Where a function has it: along this, carrier's axes.
    pub along: Vector3<T>,
    /// Where none has it (torsion, tables of modes): momentum per unit of its rate, whatever the coordinate is.
    pub fixed: SpatialWrench<T>,
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
pub struct FlexibleAppendage<T> {
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

/// A link's end as parameters have it.
#[derive(Clone, Copy, Debug)]
pub struct LinkEnd<T> {
    /// The body whose link it is.
    pub on: usize,
    /// Its place unbent, m.
    pub place: Vector3<T>,
    /// The first of its modes and the one after the last.
    pub modes: (usize, usize),
    /// What bending and twist displace to second order, where that is counted.
    pub second_order: Option<usize>,
}

/// All appendages of a robot.
#[derive(Clone, Debug, Default)]
pub struct Appendages<T> {
    pub(super) parts: ArrayVec<FlexibleAppendage<T>, MAX_APPENDAGES>,
    pub(super) functions: Modal<Function<T>>,
    pub(super) modes: Modal<ModalCoordinate<T>>,
    /// Those that carry other bodies.
    pub(super) links: ArrayVec<LinkEnd<T>, MAX_APPENDAGES>,
    /// How each mode shifts and turns the end of its link, per unit of its coordinate; 0 of those that carry nothing.
    pub(super) reach: Modal<SpatialMotion<T>>,
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
    pub fn parts(&self) -> &[FlexibleAppendage<T>] {
        &self.parts
    }
    /// Their modes, one appendage's after the other's.
    pub fn modes(&self) -> &[ModalCoordinate<T>] {
        &self.modes
    }
    /// The lowest frequency of a mode, carriers held, rad/s; `None` without modes. A body that carries appendages should turn
    /// no faster than a fifth of it.
    pub fn lowest_frequency(&self) -> Option<T> {
        let frequency = |m: &ModalCoordinate<T>| (m.stiffness / m.mass).sqrt();
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
}
