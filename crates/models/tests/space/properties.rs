//! Random trees: two algorithms and one answer, momentum and energy, derivatives.

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use trueup_models::space::MAX_BODIES;
use trueup_models::space::articulated::{JointDrive, Moves, Rotor, SweepResult, accelerations};
use trueup_models::space::attitude::{rate, rotation, square, unit};
use trueup_models::space::composite::{BASE, forces, mass_matrix, momentum, rotor_rows};
use trueup_models::space::snapshot::RobotSnapshot;
use trueup_models::space::spatial::{Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use trueup_models::space::tree::{JointType, PerBody, PlacedBody, Tree, TreeBody, subspace};
use trueup_models::space::vector::{Matrix3, Vector3, dot};

/// A random robot in a random state.
struct Case {
    tree: Tree,
    base: Rigid<f64>,
    bodies: PerBody<TreeBody<f64>>,
    placed: PerBody<PlacedBody<f64>>,
    velocity: SpatialMotion<f64>,
    drives: Vec<JointDrive<f64>>,
    applied: PerBody<SpatialWrench<f64>>,
}

pub(super) fn vector(rng: &mut StdRng) -> Vector3<f64> {
    [0; 3].map(|_| rng.random_range(-1.0..1.0))
}

/// Of a cloud of points, so that it is one.
pub(super) fn inertia(rng: &mut StdRng) -> Matrix3<f64> {
    let mut i = [[0.0; 3]; 3];
    for _ in 0..6 {
        let p = vector(rng);
        for a in 0..3 {
            (0..3).for_each(|b| i[a][b] -= 0.2 * p[a] * p[b]);
            i[a][a] += 0.2 * dot(p, p);
        }
    }
    i
}

pub(super) fn turned(rng: &mut StdRng) -> Matrix3<f64> {
    rotation([0; 4].map(|_| rng.random_range(-1.0..1.0)))
}

fn case(rng: &mut StdRng, share: f64) -> Case {
    let n = rng.random_range(1..=24);
    let tree = Tree {
        parent: (0..n).map(|i| rng.random_range(0..=i)).collect(),
        joint: (0..n)
            .map(|_| if rng.random_bool(0.3) { JointType::Prismatic } else { JointType::Revolute })
            .collect(),
    };
    let body = |rng: &mut StdRng| TreeBody {
        rigid: Rigid::new(rng.random_range(0.5..1.5), vector(rng), &inertia(rng)),
        mount: SpatialFrame { rotation: turned(rng), origin: vector(rng) },
        axis: unit(vector(rng)),
    };
    let bodies: PerBody<_> = (0..=n).map(|_| body(rng)).collect();
    let base = Rigid::new(3.0, [0.0; 3], &inertia(rng));
    let [q, rates] =
        [3.0, 1.0].map(|size| (0..n).map(|_| rng.random_range(-size..size)).collect::<Vec<f64>>());
    let velocity = SpatialMotion { angular: vector(rng), linear: vector(rng) };
    let frame = SpatialFrame { rotation: turned(rng), origin: vector(rng) };
    let placed = tree.place(&bodies, (frame, velocity), &q, &rates);
    let applied = (0..=n).map(|_| SpatialWrench { torque: vector(rng), force: vector(rng) }).collect();
    let mut drive = |i: usize| {
        let torque = rng.random_range(-1.0..1.0);
        let own = rng.random_bool(0.4);
        JointDrive {
            moves: Moves::Driven(rng.random_range(-1.0..1.0)),
            rotor: if own { Rotor::Driven(torque) } else { Rotor::Geared },
            inertia: rng.random_range(0.05..0.3),
            share: if tree.joint[i] == JointType::Revolute { share } else { 0.0 },
            rate: if own { rng.random_range(-1.0..1.0) } else { rates[i] },
        }
    };
    let drives = (0..n).map(&mut drive).collect();
    Case { tree, base, bodies, placed, velocity, drives, applied }
}

impl Case {
    fn now<'a>(&'a self, drives: &'a [JointDrive<f64>]) -> RobotSnapshot<'a, f64> {
        RobotSnapshot::rigid(&self.tree, &self.base, &self.bodies, &self.placed, drives)
    }
    /// Of the base, the joints, the rotors.
    fn accelerations(&self, drives: &[JointDrive<f64>]) -> (SpatialMotion<f64>, Vec<f64>, Vec<f64>) {
        let (mut joint, mut rotor) = (vec![0.0; MAX_BODIES], vec![0.0; MAX_BODIES]);
        let out = SweepResult { joint: &mut joint, rotor: &mut rotor, modal: &mut [] };
        let base = accelerations(&self.now(drives), &self.applied, None, out);
        (base, joint, rotor)
    }
    /// Generalized forces: what acts on the bodies, the joints' and the rotors' torques.
    fn given(&self, size: usize, rows: &[Option<usize>]) -> Vec<f64> {
        let (mut w, mut given) = (self.applied.clone(), vec![0.0; size]);
        for i in (1..=self.tree.bodies()).rev() {
            let drive = &self.drives[i - 1];
            let Moves::Driven(torque) = drive.moves else { panic!("driven") };
            given[BASE + i - 1] = subspace(self.tree.joint[i - 1], self.bodies[i].axis).power(w[i]) + torque;
            if let (Some(row), Rotor::Driven(torque)) = (rows[i - 1], drive.rotor) {
                given[row] = torque;
            }
            let parent = self.tree.parent[i - 1];
            w[parent] = w[parent].plus(self.placed[i].frame.outwards(w[i]));
        }
        given[..3].copy_from_slice(&w[0].force);
        given[3..6].copy_from_slice(&w[0].torque);
        given
    }
    /// In the order of the coordinates.
    fn stack(
        &self,
        size: usize,
        rows: &[Option<usize>],
        base: SpatialMotion<f64>,
        joints: &[f64],
        rotors: &[f64],
    ) -> Vec<f64> {
        let mut all = vec![0.0; size];
        all[..3].copy_from_slice(&base.linear);
        all[3..6].copy_from_slice(&base.angular);
        for i in 0..self.tree.bodies() {
            all[BASE + i] = joints[i];
            if let Some(row) = rows[i] {
                all[row] = rotors[i];
            }
        }
        all
    }
}

/// Checks SFF-2, SFF-8, SFF-11 and SFF-12.
#[test]
fn articulated_and_composite_bodies_agree() {
    let mut rng = StdRng::seed_from_u64(32);
    let mut worst: f64 = 0.0;
    for k in 0..300 {
        let c = case(&mut rng, [1.0, 0.01, 0.2][k % 3]);
        let n = c.tree.bodies();
        let (rows, size) = rotor_rows(&c.tree, &c.drives);
        let (base, joint, rotor) = c.accelerations(&c.drives);
        let given = c.given(size, &rows);
        let mut needed = vec![0.0; size];
        forces(&c.now(&c.drives), (base, &joint, &rotor), &[], &mut needed);
        let largest = needed.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        let mut bias = vec![0.0; size];
        let still = (SpatialMotion::zero(), &[0.0; MAX_BODIES][..], &[0.0; MAX_BODIES][..]);
        forces(&c.now(&c.drives), still, &[], &mut bias);
        let mut mass = vec![0.0; size * size];
        mass_matrix(&c.now(&c.drives), &mut mass);
        let row = |i: usize, v: &[f64]| (0..size).map(|j| mass[i * size + j] * v[j]).sum::<f64>();
        let a = c.stack(size, &rows, base, &joint, &rotor);
        for i in 0..size {
            worst = worst.max((needed[i] - given[i]).abs() / largest);
            worst = worst.max((row(i, &a) + bias[i] - given[i]).abs() / largest);
        }
        // The same accelerations, given instead of found, are the same motion.
        let mut led = c.drives.clone();
        for i in 0..n {
            if rng.random_bool(0.5) {
                led[i].moves = Moves::Prescribed(joint[i]);
            }
            if rng.random_bool(0.5) && led[i].rotor != Rotor::Geared {
                led[i].rotor = Rotor::Prescribed(rotor[i]);
            }
        }
        let (base, joint, mut rotor) = c.accelerations(&led);
        for i in 0..n {
            if let (Rotor::Prescribed(acceleration), Rotor::Driven(torque)) =
                (led[i].rotor, c.drives[i].rotor)
            {
                // Of a prescribed rotor the torque is found: the one that drove it.
                worst = worst.max((rotor[i] - torque).abs() / largest);
                rotor[i] = acceleration;
            }
        }
        let size_of = |v: &[f64]| v.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        let b = c.stack(size, &rows, base, &joint, &rotor);
        let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size_of(&a);
        assert!(off < 1e-9, "case {k}: prescribed motion is off by {off:e}");
    }
    println!("worst {worst:.1e}");
    assert!(worst < 1e-11, "{worst:e}");
}

/// Checks SFF-9: M v is the momentum, v M v / 2 the energy, of bodies and rotors.
#[test]
fn momentum_and_energy_are_those_of_the_mass_matrix() {
    let mut rng = StdRng::seed_from_u64(33);
    for k in 0..100 {
        let c = case(&mut rng, [1.0, 0.01][k % 2]);
        let (rows, size) = rotor_rows(&c.tree, &c.drives);
        let mut mass = vec![0.0; size * size];
        mass_matrix(&c.now(&c.drives), &mut mass);
        let rates: Vec<f64> = (1..=c.tree.bodies())
            .map(|i| {
                // The rate of a joint is what its velocity has beyond its carrier's.
                let own = c.placed[i].velocity;
                let carried = c.placed[i].frame.inwards(c.placed[c.tree.parent[i - 1]].velocity);
                let s = subspace(c.tree.joint[i - 1], c.bodies[i].axis);
                dot(s.angular, own.angular) - dot(s.angular, carried.angular) + dot(s.linear, own.linear)
                    - dot(s.linear, carried.linear)
            })
            .collect();
        let turning: Vec<f64> = c.drives.iter().map(|d| d.rate).collect();
        let v = c.stack(size, &rows, c.velocity, &rates, &turning);
        let p: Vec<f64> = (0..size).map(|i| (0..size).map(|j| mass[i * size + j] * v[j]).sum()).collect();
        let twice: f64 = p.iter().zip(&v).map(|(p, v)| p * v).sum();
        let (h, energy) = momentum(&c.now(&c.drives));
        assert!((0.5 * twice - energy).abs() < 1e-12 * twice, "{energy}, not {}", 0.5 * twice);
        for i in 0..3 {
            assert!((p[i] - h.force[i]).abs() + (p[3 + i] - h.torque[i]).abs() < 1e-12 * twice.max(1.0));
        }
    }
}

/// Checks SFF-1: a quaternion of another length comes back to 1 and turns as the one of length 1 does.
#[test]
fn the_length_of_a_quaternion_comes_back() {
    let (mut q, omega) = ([0.98, 0.1, -0.3, 0.2], [0.4, -0.2, 0.3]);
    let length = square(q).sqrt();
    let mut exact = q.map(|v| v / length);
    let step = |q: [f64; 4], h: f64| {
        let k1 = rate(q, omega);
        let k2 = rate([0, 1, 2, 3].map(|i| q[i] + 0.5 * h * k1[i]), omega);
        let k3 = rate([0, 1, 2, 3].map(|i| q[i] + 0.5 * h * k2[i]), omega);
        let k4 = rate([0, 1, 2, 3].map(|i| q[i] + h * k3[i]), omega);
        [0, 1, 2, 3].map(|i| q[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    };
    let off = (square(q) - 1.0).abs();
    for _ in 0..1000 {
        (q, exact) = (step(q, 1e-2), step(exact, 1e-2));
    }
    // |Q|^2 - 1 falls as e^(-t) near 1.
    let left = (square(q) - 1.0).abs() / off;
    assert!((left / (-10.0_f64).exp() - 1.0).abs() < 0.2, "{left:e}");
    let (a, b) = (rotation(q), rotation(exact));
    for i in 0..3 {
        (0..3).for_each(|j| assert!((a[i][j] - b[i][j]).abs() < 1e-9));
    }
}
