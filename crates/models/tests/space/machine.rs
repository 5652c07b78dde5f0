//! A robot with appendages as numbers, its state as one vector, over any scalar.

use trueup_models::space::appendage::{Beam, Shapes, TableMode};
use trueup_models::space::articulated::{JointDrive, Moves, Rotor, SweepResult, accelerations};
use trueup_models::space::attitude::{rate, rotation};
use trueup_models::space::bent::DeformedAppendages;
use trueup_models::space::composite::momentum;
use trueup_models::space::flexible::Appendages;
use trueup_models::space::snapshot::RobotSnapshot;
use trueup_models::space::spatial::{Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use trueup_models::space::tree::{PerBody, Tree, TreeBody};
use trueup_models::space::vector::{Vector3, add, cross, times};
use trueup_numerics::Scalar;

/// Joint and rotor of a drive: inertia, share, whether the rotor moves by itself.
pub(super) type Gear = (f64, f64, bool);

#[derive(Clone)]
pub(super) struct Machine {
    pub(super) tree: Tree,
    pub(super) base: Rigid<f64>,
    /// The first is not used.
    pub(super) bodies: Vec<TreeBody<f64>>,
    pub(super) gears: Vec<Gear>,
    pub(super) beams: Vec<(usize, Shapes, Beam<f64>)>,
    pub(super) tables: Vec<(usize, SpatialFrame<f64>, Rigid<f64>, Vec<TableMode<f64>>)>,
    /// On whose ends hangs what the bodies carry.
    pub(super) links: Vec<(usize, Shapes, Beam<f64>)>,
    /// Bending shortens links.
    pub(super) stiffening: bool,
    /// The same by tables of modes; each has its end.
    pub(super) link_tables: Vec<(usize, SpatialFrame<f64>, Rigid<f64>, LinkModes, Vector3<f64>)>,
}

/// Modes of a link and how they move its end.
pub(super) type LinkModes = Vec<(TableMode<f64>, SpatialMotion<f64>)>;

fn mode<T: Scalar>(m: &TableMode<f64>) -> TableMode<T> {
    let SpatialWrench { torque, force } = m.participation;
    TableMode {
        frequency: T::constant(m.frequency),
        damping_ratio: T::constant(m.damping_ratio),
        participation: SpatialWrench { torque: lift(torque), force: lift(force) },
    }
}

fn lift<T: Scalar>(v: Vector3<f64>) -> Vector3<T> {
    v.map(T::constant)
}
fn rigid<T: Scalar>(r: &Rigid<f64>) -> Rigid<T> {
    Rigid { mass: T::constant(r.mass), first: lift(r.first), inertia: r.inertia.map(lift) }
}
fn frame<T: Scalar>(f: &SpatialFrame<f64>) -> SpatialFrame<T> {
    SpatialFrame { rotation: f.rotation.map(lift), origin: lift(f.origin) }
}
pub(super) fn body<T: Scalar>(b: &TreeBody<f64>) -> TreeBody<T> {
    TreeBody { rigid: rigid(&b.rigid), mount: frame(&b.mount), axis: lift(b.axis) }
}

/// Where the parts of a state begin: position, quaternion, joints, modes; velocity, rate, joints, rotors, modes.
pub(super) struct Layout {
    pub(super) n: usize,
    pub(super) modes: usize,
}
impl Layout {
    pub(super) fn eta(&self) -> usize {
        7 + self.n
    }
    pub(super) fn velocity(&self) -> usize {
        7 + self.n + self.modes
    }
    pub(super) fn rates(&self) -> usize {
        self.velocity() + 6
    }
    pub(super) fn rotors(&self) -> usize {
        self.rates() + self.n
    }
    pub(super) fn eta_rates(&self) -> usize {
        self.rotors() + self.n
    }
    pub(super) fn size(&self) -> usize {
        self.eta_rates() + self.modes
    }
}

impl Machine {
    pub(super) fn layout(&self) -> Layout {
        let beams: usize = self.beams.iter().chain(&self.links).map(|b| b.1.modes()).sum();
        let tables = self.tables.iter().map(|t| t.3.len()).chain(self.link_tables.iter().map(|t| t.3.len()));
        Layout { n: self.tree.bodies(), modes: beams + tables.sum::<usize>() }
    }

    pub(super) fn appendages<T: Scalar>(&self) -> Appendages<T> {
        let mut all = Appendages::new();
        let c = T::constant;
        let lifted = |b: &Beam<f64>| Beam {
            frame: frame(&b.frame),
            length: c(b.length),
            mass_per_length: c(b.mass_per_length),
            bending_stiffness: b.bending_stiffness.map(c),
            torsion_stiffness: c(b.torsion_stiffness),
            polar_inertia_per_length: c(b.polar_inertia_per_length),
            damping_ratio: c(b.damping_ratio),
        };
        self.beams.iter().for_each(|(on, shapes, b)| all.add_beam(*on, *shapes, &lifted(b)).unwrap());
        for (on, place, whole, modes) in &self.tables {
            let modes: Vec<_> = modes.iter().map(mode).collect();
            all.add_table(*on, &frame(place), &rigid(whole), &modes).unwrap();
        }
        self.links
            .iter()
            .for_each(|(on, shapes, b)| all.add_link(*on, *shapes, &lifted(b), self.stiffening).unwrap());
        for (on, place, whole, modes, end) in &self.link_tables {
            let reach =
                |m: &SpatialMotion<f64>| SpatialMotion { angular: lift(m.angular), linear: lift(m.linear) };
            let modes: Vec<_> = modes.iter().map(|(m, moved)| (mode(m), reach(moved))).collect();
            all.add_link_table(*on, &frame(place), &rigid(whole), &modes, lift(*end)).unwrap();
        }
        all
    }

    /// Shows the robot at a state, driven by these torques on joints (and by the same on rotors that move by themselves).
    pub(super) fn at<T: Scalar, R>(
        &self,
        x: &[T],
        torques: &[T],
        look: impl FnOnce(&RobotSnapshot<'_, T>, &Appendages<T>) -> R,
    ) -> R {
        let l = self.layout();
        assert_eq!(x.len(), l.size());
        let appendages = self.appendages::<T>();
        let bodies: Vec<TreeBody<T>> = self.bodies.iter().map(body).collect();
        let drives: Vec<JointDrive<T>> = (0..l.n)
            .map(|i| {
                let (inertia, share, own) = self.gears[i];
                JointDrive {
                    moves: Moves::Driven(torques[i]),
                    rotor: if own { Rotor::Driven(torques[i]) } else { Rotor::Geared },
                    inertia: T::constant(inertia),
                    share: T::constant(share),
                    rate: if own { x[l.rotors() + i] } else { x[l.rates() + i] },
                }
            })
            .collect();
        let part = |from: usize| [x[from], x[from + 1], x[from + 2]];
        let base = SpatialFrame { rotation: rotation([x[3], x[4], x[5], x[6]]), origin: part(0) };
        let velocity = SpatialMotion { linear: part(l.velocity()), angular: part(l.velocity() + 3) };
        let mut bent = DeformedAppendages::new();
        let (eta, rates) = (&x[l.eta()..], &x[l.eta_rates()..]);
        bent.ends.set(&appendages, eta, rates);
        let mut placed = PerBody::new();
        let joints = (&x[7..], &x[l.rates()..]);
        self.tree.place_into(&bodies, (base, velocity), joints, Some(&bent.ends), &mut placed);
        appendages.bend(&placed, eta, rates, &mut bent);
        let now = RobotSnapshot {
            tree: &self.tree,
            base: &rigid(&self.base),
            bodies: &bodies,
            placed: &placed,
            drives: &drives,
            flexing: bent.of(&appendages),
        };
        look(&now, &appendages)
    }

    /// d(x)/dt without wrenches from outside.
    pub(super) fn rates<T: Scalar>(&self, x: &[T], torques: &[T]) -> Vec<T> {
        let l = self.layout();
        let none = vec![SpatialWrench::zero(); l.n + 1];
        self.at(x, torques, |now, _| {
            let mut dx = vec![T::zero(); l.size()];
            let base = now.placed[0];
            dx[..3].copy_from_slice(&times(&base.frame.rotation, base.velocity.linear));
            dx[3..7].copy_from_slice(&rate([x[3], x[4], x[5], x[6]], base.velocity.angular));
            dx[7..7 + l.n].copy_from_slice(&x[l.rates()..][..l.n]);
            dx[l.eta()..][..l.modes].copy_from_slice(&x[l.eta_rates()..]);
            let (joint, rest) = dx[l.rates()..].split_at_mut(l.n);
            let (rotor, modal) = rest.split_at_mut(l.n);
            let a = accelerations(now, &none, None, SweepResult { joint, rotor, modal });
            dx[l.velocity()..][..3].copy_from_slice(&a.linear);
            dx[l.velocity() + 3..][..3].copy_from_slice(&a.angular);
            dx
        })
    }

    /// P, L about the inertial origin, energy of motion and of the modes' springs, what their dampers take.
    pub(super) fn books<T: Scalar>(&self, x: &[T]) -> ([T; 6], T, T) {
        let l = self.layout();
        self.at(x, &vec![T::zero(); l.n], |now, appendages| {
            let (h, kinetic) = momentum(now);
            let at = now.placed[0].frame;
            let p = times(&at.rotation, h.force);
            let about = add(times(&at.rotation, h.torque), cross(at.origin, p));
            let all = [p[0], p[1], p[2], about[0], about[1], about[2]];
            let (eta, rates) = (&x[l.eta()..], &x[l.eta_rates()..]);
            (all, kinetic + appendages.potential(eta), appendages.dissipation(rates))
        })
    }
}
