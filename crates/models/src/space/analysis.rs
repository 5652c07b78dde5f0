//! What the papers read off a pose: how an arm's motion pulls at its base (S1 eq. 15, 17-19), and the matrices of the
//! momentum form (S2 eq. 1-14).

use super::composite::{BASE, forces, mass_matrix, rotor_rows};
use super::joint_drive::{JointDrive, Moves, Rotor};
use super::snapshot::RobotSnapshot;
use super::spatial::{Rigid, SpatialMotion, SpatialWrench};
use super::tree::{JointType, PerBody, Tree, TreeBody};
use super::vector::{Vector3, cross, dot, sub, times, zero};
use super::{MAX_BODIES, MAX_DOFS, spatial::SpatialFrame};
use trueup_numerics::Scalar;
use trueup_numerics::linear::{ldl_factor, ldl_solve};

/// A robot with its values, joints rigid or locked to their motors.
#[derive(Clone, Debug)]
pub struct RigidRobot<T> {
    /// Which body hangs on which.
    pub tree: Tree,
    /// The base.
    pub base: Rigid<T>,
    /// The bodies; element 0 is not used.
    pub bodies: PerBody<TreeBody<T>>,
}

/// One column of six: force (N) and torque (N.m) per unit of what moves.
pub type SpatialColumn<T> = SpatialWrench<T>;

/// What the arms' motion puts on the base at rest, base axes, torque about a point of the base: the wrench that the base
/// has to give is B q'' + N_R (rates in pairs) + N_C (rates squared) (SFF-3).
#[derive(Clone, Debug)]
pub struct Reaction<T> {
    /// B: per joint.
    pub inertial: Vec<SpatialColumn<T>>,
    /// N_C: per joint, of its rate squared.
    pub centrifugal: Vec<SpatialColumn<T>>,
    /// N_R: per pair of joints (first, second), of the product of their rates.
    pub coriolis: Vec<(usize, usize, SpatialColumn<T>)>,
}

impl<T: Scalar> RigidRobot<T> {
    fn drives(&self, rates: &[T]) -> Vec<JointDrive<T>> {
        let drive = |rate: &T| JointDrive {
            moves: Moves::Driven(T::zero()),
            rotor: Rotor::Geared,
            inertia: T::zero(),
            share: T::zero(),
            rate: *rate,
        };
        rates.iter().map(drive).collect()
    }

    /// Wrench on the base about `point` at these rates and accelerations of the joints, the base at rest at the inertial
    /// origin.
    fn wrench(&self, q: &[T], rates: &[T], accelerations: &[T], point: Vector3<T>) -> SpatialWrench<T> {
        let here = SpatialFrame { rotation: super::vector::identity(), origin: zero() };
        let placed = self.tree.place(&self.bodies, (here, SpatialMotion::zero()), q, rates);
        let mut out = [T::zero(); MAX_DOFS];
        let given = (SpatialMotion::zero(), accelerations, accelerations);
        let drives = self.drives(rates);
        let now = RobotSnapshot::rigid(&self.tree, &self.base, &self.bodies, &placed, &drives);
        forces(&now, given, &[], &mut out);
        let (force, torque) = ([out[0], out[1], out[2]], [out[3], out[4], out[5]]);
        SpatialWrench { force, torque: sub(torque, cross(point, force)) }
    }

    /// How joints at angles `q` pull at the base, torques about `point` (base axes, m).
    pub fn reaction(&self, q: &[T], point: Vector3<T>) -> Reaction<T> {
        let n = self.tree.bodies();
        let none = [T::zero(); MAX_BODIES];
        let unit = |joints: &[usize]| {
            let mut e = none;
            joints.iter().for_each(|j| e[*j] = T::one());
            e
        };
        let at = |rates: &[T], accelerations: &[T]| self.wrench(q, &rates[..n], &accelerations[..n], point);
        let inertial = (0..n).map(|j| at(&none, &unit(&[j]))).collect(); // (SFF-3)
        // The wrench is a form of second degree in the rates: its coefficients are values of it, no differences.
        let centrifugal: Vec<SpatialColumn<T>> = (0..n).map(|j| at(&unit(&[j]), &none)).collect();
        let mut coriolis = Vec::new();
        for j in 0..n {
            for k in j + 1..n {
                let both = at(&unit(&[j, k]), &none);
                coriolis.push((j, k, both.minus(centrifugal[j]).minus(centrifugal[k])));
            }
        }
        Reaction { inertial, centrifugal, coriolis }
    }
}

/// The momentum form at a pose, inertial axes; base coordinates are the velocity of its centre of mass and its rate.
#[derive(Clone, Debug)]
pub struct MomentumForm {
    /// Joints.
    pub joints: usize,
    /// M of (18): (6 + n) x (6 + n), row by row.
    pub mass: Vec<f64>,
    /// H2 of (10), 6 x 6, row by row: momentum and angular momentum about the inertial origin by the base's twist.
    pub h2: Vec<f64>,
    /// H3 of (11), 6 x n.
    pub h3: Vec<f64>,
    /// J_s of (5), 6 x 6: the tip's twist by the base's.
    pub j_s: Vec<f64>,
    /// J_M of (6), 6 x n.
    pub j_m: Vec<f64>,
    /// Position of the tip, m.
    pub tip: Vector3<f64>,
}

impl RigidRobot<f64> {
    /// The matrices of S2 for the tip at `offset` (own axes) of body `tip`, the base at this frame.
    pub fn momentum_form(
        &self,
        base: SpatialFrame<f64>,
        q: &[f64],
        tip: (usize, Vector3<f64>),
    ) -> MomentumForm {
        let n = self.tree.bodies();
        let rates = vec![0.0; n];
        let placed = self.tree.place(&self.bodies, (base, SpatialMotion::zero()), q, &rates);
        let frames = self.tree.inertial(&placed);
        let drives = self.drives(&rates);
        let (_, size) = rotor_rows(&self.tree, &drives);
        let mut own = vec![0.0; size * size];
        mass_matrix(&RobotSnapshot::rigid(&self.tree, &self.base, &self.bodies, &placed, &drives), &mut own);
        // Base rows and columns from base axes to inertial ones.
        let turn = |rows: &mut dyn FnMut(usize) -> Vector3<f64>| {
            [rows(0), rows(1)].map(|v| times(&base.rotation, v))
        };
        let mut half = own.clone();
        for j in 0..size {
            let turned = turn(&mut |b| [0, 1, 2].map(|i| own[(3 * b + i) * size + j]));
            (0..BASE).for_each(|i| half[i * size + j] = turned[i / 3][i % 3]);
        }
        let mut mass = half.clone();
        for i in 0..size {
            let turned = turn(&mut |b| [0, 1, 2].map(|j| half[i * size + 3 * b + j]));
            (0..BASE).for_each(|j| mass[i * size + j] = turned[j / 3][j % 3]);
        }
        // About the inertial origin: L = L_s + r_s x P.
        let column = |j: usize| {
            let p = [0, 1, 2].map(|i| mass[i * size + j]);
            let l = [3, 4, 5].map(|i| mass[i * size + j]);
            let about = cross(base.origin, p);
            [p[0], p[1], p[2], l[0] + about[0], l[1] + about[1], l[2] + about[2]]
        };
        let by_rows = |from: usize, count: usize| {
            let columns: Vec<[f64; 6]> = (from..from + count).map(column).collect();
            (0..BASE)
                .flat_map(|i| columns.iter().map(move |c| c[i]).collect::<Vec<_>>())
                .collect::<Vec<f64>>()
        };
        let (h2, h3) = (by_rows(0, BASE), by_rows(BASE, n));
        let at = frames[tip.0];
        let point = super::vector::add(at.origin, times(&at.rotation, tip.1));
        let mut j_s = vec![0.0; 36];
        let arm = sub(point, base.origin);
        for k in 0..3 {
            let mut e = [0.0; 3];
            e[k] = 1.0;
            let carried = cross(e, arm);
            for i in 0..3 {
                j_s[6 * i + k] = e[i];
                j_s[6 * i + 3 + k] = carried[i];
                j_s[6 * (i + 3) + 3 + k] = e[i];
            }
        }
        let mut j_m = vec![0.0; 6 * n];
        let mut body = tip.0;
        while body > 0 {
            let axis = times(&frames[body].rotation, self.bodies[body].axis);
            let (linear, angular) = match self.tree.joint[body - 1] {
                JointType::Revolute => (cross(axis, sub(point, frames[body].origin)), axis), // (SFF-7)
                JointType::Prismatic => (axis, zero()),
            };
            for i in 0..3 {
                j_m[i * n + body - 1] = linear[i];
                j_m[(i + 3) * n + body - 1] = angular[i];
            }
            body = self.tree.parent[body - 1];
        }
        MomentumForm { joints: n, mass, h2, h3, j_s, j_m, tip: point }
    }
}

impl MomentumForm {
    /// J_g = J_M - J_s H2^-1 H3, 6 x n, row by row (SFF-10): the tip's twist by the joints of a base that floats with no
    /// momentum.
    ///
    /// # Errors
    /// The row that shows the mass of the base not to be positive definite.
    pub fn generalized_jacobian(&self) -> Result<Vec<f64>, usize> {
        let (n, size) = (self.joints, BASE + self.joints);
        // H2 and H3 are M_bb and M_bq about another point: what H2^-1 H3 does not see.
        let mut factors = [0.0; BASE * BASE];
        for i in 0..BASE {
            factors[i * BASE..][..BASE].copy_from_slice(&self.mass[i * size..][..BASE]);
        }
        ldl_factor(&mut factors, BASE).map_err(|e| e.index)?;
        let mut j_g = self.j_m.clone();
        for joint in 0..n {
            let mut base: Vec<f64> = (0..BASE).map(|i| self.mass[i * size + BASE + joint]).collect();
            ldl_solve(&factors, BASE, &mut base);
            for i in 0..BASE {
                let carried: f64 = (0..BASE).map(|k| self.j_s[i * BASE + k] * base[k]).sum();
                j_g[i * n + joint] -= carried; // (SFF-10)
            }
        }
        Ok(j_g)
    }
}

/// Frobenius norm of columns.
pub fn norm<T: Scalar>(columns: &[Vector3<T>]) -> f64 {
    columns.iter().map(|c| dot(*c, *c).value()).sum::<f64>().sqrt()
}
