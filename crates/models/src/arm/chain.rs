//! Satellite and links as one chain of rigid bodies: M, C and the bias C v in closed form (S0 eq. 4, 5).
//!
//! Written in the absolute angles phi_0 = q_0, phi_k = phi_(k-1) + q_k, then brought to q_0, q_1 .. q_n by
//! sums from the tip inwards (ARM-3).

use super::layout::parameter;
use super::solve::Symmetric;
use super::{MAX_BODIES, MAX_LINKS};
use trueup_numerics::Scalar;

/// A vector in the plane.
pub type PlanarVector<T> = [T; 2];

pub(super) fn add<T: Scalar>(a: PlanarVector<T>, b: PlanarVector<T>) -> PlanarVector<T> {
    [a[0] + b[0], a[1] + b[1]]
}
pub(super) fn times<T: Scalar>(a: PlanarVector<T>, s: T) -> PlanarVector<T> {
    [a[0] * s, a[1] * s]
}
pub(super) fn dot<T: Scalar>(a: PlanarVector<T>, b: PlanarVector<T>) -> T {
    a[0] * b[0] + a[1] * b[1]
}
/// S a: turned by a quarter.
pub(super) fn quarter<T: Scalar>(a: PlanarVector<T>) -> PlanarVector<T> {
    [-a[1], a[0]]
}
/// R a for the angle with that sine and cosine (eq. 22).
pub(super) fn rotate<T: Scalar>((s, c): (T, T), a: PlanarVector<T>) -> PlanarVector<T> {
    [c * a[0] - s * a[1], s * a[0] + c * a[1]]
}

/// The chain's constants in the bodies' own axes.
#[derive(Clone, Copy, Debug)]
pub struct Chain<T> {
    /// Number of links, n.
    pub links: usize,
    /// Total mass, kg.
    pub mass: T,
    /// a_k: from joint to joint of body k (a_0: from the satellite's centre of mass to joint 1), m.
    pub arm: [PlanarVector<T>; MAX_BODIES],
    /// gamma_k: sum of mass times lever of all that body k carries, kg.m (ARM-1).
    pub gamma: [PlanarVector<T>; MAX_BODIES],
    /// alpha_kk + I_k: inertia of body k with what it carries taken as point mass, kg.m2 (ARM-1).
    pub inertia: [T; MAX_BODIES],
}

/// The chain in one position and motion; inertial frame.
#[derive(Clone, Copy, Debug)]
pub struct LinkDirections<T> {
    /// Number of links, n.
    pub links: usize,
    /// phi_k, rad.
    pub angle: [T; MAX_BODIES],
    /// Its rate, rad/s.
    pub rate: [T; MAX_BODIES],
    /// A_k = R(phi_k) a_k, m.
    pub arm: [PlanarVector<T>; MAX_BODIES],
    /// G_k = R(phi_k) gamma_k, kg.m.
    pub gamma: [PlanarVector<T>; MAX_BODIES],
}

impl<T: Scalar> Chain<T> {
    /// From the manipulator's parameters (ARM-1).
    pub fn new(links: usize, p: &[T]) -> Self {
        let n = links;
        let pair = |begin: usize, k: usize| [p[begin + 2 * k], p[begin + 2 * k + 1]];
        let none = [T::zero(); 2];
        let (mut arm, mut gamma) = ([none; MAX_BODIES], [none; MAX_BODIES]);
        let mut inertia = [T::zero(); MAX_BODIES];
        // From the tip inwards: `beyond` is the mass of all bodies after k.
        let mut beyond = T::zero();
        for k in (1..=n).rev() {
            let (m, com) =
                (p[parameter::link_mass(n) + k - 1], pair(parameter::link_center_of_mass(n), k - 1));
            arm[k] = [p[parameter::link_length(n) + k - 1], T::zero()];
            gamma[k] = add(times(com, m), times(arm[k], beyond));
            inertia[k] =
                p[parameter::link_inertia(n) + k - 1] + m * dot(com, com) + beyond * dot(arm[k], arm[k]);
            beyond += m;
        }
        arm[0] = pair(parameter::mount_position(n), 0);
        gamma[0] = times(arm[0], beyond);
        inertia[0] = p[parameter::base_inertia(n)] + beyond * dot(arm[0], arm[0]);
        Self { links, mass: p[parameter::base_mass(n)] + beyond, arm, gamma, inertia }
    }

    /// A body more, fixed to link `link` (from 1): its mass, where its centre is in the link's axes, its inertia about that
    /// (ARM-16).
    pub fn carry(&mut self, link: usize, mass: T, center: PlanarVector<T>, inertia: T) {
        self.gamma[link] = add(self.gamma[link], times(center, mass));
        self.inertia[link] += inertia + mass * dot(center, center);
        for k in 0..link {
            self.gamma[k] = add(self.gamma[k], times(self.arm[k], mass));
            self.inertia[k] += mass * dot(self.arm[k], self.arm[k]);
        }
        self.mass += mass;
    }

    /// At coordinates q and velocities v (x_0, y_0, q_0, q_1 .. q_n).
    pub fn turned(&self, q: &[T], v: &[T]) -> LinkDirections<T> {
        let none = [T::zero(); 2];
        let mut t = LinkDirections {
            links: self.links,
            angle: [T::zero(); MAX_BODIES],
            rate: [T::zero(); MAX_BODIES],
            arm: [none; MAX_BODIES],
            gamma: [none; MAX_BODIES],
        };
        let (mut angle, mut rate) = (T::zero(), T::zero());
        for k in 0..=self.links {
            angle += q[2 + k];
            rate += v[2 + k];
            (t.angle[k], t.rate[k]) = (angle, rate);
            let turn = angle.sin_cos();
            t.arm[k] = rotate(turn, self.arm[k]);
            t.gamma[k] = rotate(turn, self.gamma[k]);
        }
        t
    }

    /// Adds M(q) to `m`, rows x_0, y_0, q_0, q_1 .. q_n (ARM-2, ARM-3).
    pub fn add_mass(&self, t: &LinkDirections<T>, m: &mut Symmetric<T>) {
        let n = self.links;
        m.add(0, 0, self.mass);
        m.add(1, 1, self.mass);
        let mut lever = [T::zero(); 2];
        // Row j of the matrix in absolute angles, summed over the columns k .. n, then over the rows.
        let mut sums = [T::zero(); MAX_BODIES];
        for j in (0..=n).rev() {
            lever = add(lever, quarter(t.gamma[j]));
            m.add(2 + j, 0, lever[0]);
            m.add(2 + j, 1, lever[1]);
            let mut sum = T::zero();
            for k in (0..=n).rev() {
                sum += match k.cmp(&j) {
                    core::cmp::Ordering::Less => dot(t.arm[k], t.gamma[j]),
                    core::cmp::Ordering::Equal => self.inertia[j],
                    core::cmp::Ordering::Greater => dot(t.arm[j], t.gamma[k]),
                };
                sums[k] += sum;
                if k <= j {
                    m.add(2 + j, 2 + k, sums[k]);
                }
            }
        }
    }
}

impl<T: Scalar> LinkDirections<T> {
    /// C(q, v) v, rows x_0, y_0, q_0, q_1 .. q_n: Coriolis and centrifugal terms (ARM-4).
    pub fn bias(&self, out: &mut [T]) {
        let n = self.links;
        let none = [T::zero(); 2];
        // inner[j]: sum of S A_k rate_k^2 over the bodies before j.
        let mut inner = [none; MAX_BODIES];
        for k in 0..n {
            inner[k + 1] = add(inner[k], times(quarter(self.arm[k]), self.rate[k] * self.rate[k]));
        }
        let (mut outer, mut sum) = (none, T::zero());
        for j in (0..=n).rev() {
            sum += dot(self.arm[j], outer) + dot(self.gamma[j], inner[j]);
            out[2 + j] = sum;
            outer = add(outer, times(quarter(self.gamma[j]), self.rate[j] * self.rate[j]));
        }
        // M_xy,k = S G_k, so its change with phi_k is -G_k = S (S G_k).
        [out[0], out[1]] = quarter(outer);
    }

    /// C(q, v) itself, in the form that makes dM/dt - 2 C skew-symmetric (ARM-4).
    pub fn coriolis(&self) -> [[T; 3 + MAX_LINKS]; 3 + MAX_LINKS] {
        let n = self.links;
        let mut c = [[T::zero(); 3 + MAX_LINKS]; 3 + MAX_LINKS];
        for j in 0..=n {
            for k in (0..=n).filter(|k| *k != j) {
                let s = if k > j {
                    dot(self.arm[j], quarter(self.gamma[k]))
                } else {
                    dot(self.gamma[j], quarter(self.arm[k]))
                };
                c[2 + j][2 + k] = s * self.rate[k];
            }
            let g = times(self.gamma[j], -self.rate[j]);
            (c[0][2 + j], c[1][2 + j]) = (g[0], g[1]);
        }
        for j in (2..2 + n).rev() {
            for k in 2..=2 + n {
                let below = c[j + 1][k];
                c[j][k] += below;
            }
        }
        for row in &mut c {
            for k in (2..2 + n).rev() {
                let beyond = row[k + 1];
                row[k] += beyond;
            }
        }
        c
    }

    /// Adds generalized forces of absolute angles (element k: on phi_k) to those of q_0, q_1 .. q_n (ARM-3).
    pub fn add_absolute(&self, absolute: &[T; MAX_BODIES], out: &mut [T]) {
        let mut sum = T::zero();
        for k in (0..=self.links).rev() {
            sum += absolute[k];
            out[2 + k] += sum;
        }
    }
}
