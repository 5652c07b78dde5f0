//! The manipulator as a plant: forces on its coordinates, its tangent with motors held, forces that have the effect of its
//! parameters. Cases are drawn; the seed is printed.

use crate::draws::Draws;
use trueup_models::arm::{FIXED_BASE, PlanarManipulator, input, parameter};
use trueup_models::compiled::Compiled;
use trueup_numerics::hybrid::At;
use trueup_plant::{CoordinateKind, Plant, force_sensitivity, tangent};

struct Case {
    plant: Box<dyn Plant>,
    arm: PlanarManipulator,
    p: Vec<f64>,
    x: Vec<f64>,
    u: Vec<f64>,
    modes: Vec<i32>,
}

impl Case {
    /// An arm of one to four links, some of its joints flexible, its base free or fixed, with or without motor friction; its
    /// motors slide.
    fn drawn(draws: &mut Draws) -> Self {
        let links = draws.between(1.0, 5.0) as usize;
        let flexible: Vec<bool> = (0..links).map(|_| draws.between(0.0, 1.0) < 0.5).collect();
        let effects: &[&str] = if draws.between(0.0, 1.0) < 0.5 { &[] } else { &["motor-friction"] };
        let arm = PlanarManipulator::on_base(draws.between(0.0, 1.0) < 0.5, &flexible, effects).unwrap();
        let plant: Box<dyn Plant> = Box::new(Compiled::new(arm.clone()));
        let sizes = plant.sizes();
        let coupling = parameter::motor_coupling(links);
        let p: Vec<f64> = (plant.table().parameters.iter().enumerate())
            .map(|(i, q)| if i == coupling { q.start } else { q.start * draws.between(0.7, 1.4) })
            .collect();
        let mut x: Vec<f64> = (0..sizes.states).map(|_| draws.between(-1.0, 1.0)).collect();
        if arm.has_fixed_base() {
            x[..3].fill(0.0);
            x[arm.dofs()..][..3].fill(0.0);
        }
        let u = (0..sizes.inputs).map(|_| draws.between(-0.5, 0.5)).collect();
        let modes = (0..sizes.modes).map(|_| if draws.between(0.0, 1.0) < 0.5 { -1 } else { 1 }).collect();
        Self { plant, arm, p, x, u, modes }
    }
    fn at(&self) -> At<'_, f64> {
        At { t: 0.0, x: &self.x, u: &self.u, p: &self.p, modes: &self.modes }
    }
    fn rates(&self, at: At<'_, f64>, force: &[f64]) -> Vec<f64> {
        let mut dx = vec![0.0; self.x.len()];
        self.plant.rates(at, force, &mut dx);
        dx
    }
}

#[test]
fn forces_are_what_inputs_do() {
    assert_eq!(FIXED_BASE, 2);
    let mut draws = Draws::new(0x5a31);
    for _ in 0..60 {
        let case = Case::drawn(&mut draws);
        let n = case.arm.links();
        let (mut force, mut u, mut joint, mut base) = (Vec::new(), case.u.clone(), 0, 0);
        for c in case.plant.coordinates() {
            let own = draws.between(-1.0, 1.0);
            let at = match c.kind {
                CoordinateKind::Base => {
                    base += 1;
                    // baseForce, then baseTorque.
                    Some(input::base_force(n) + base - 1)
                }
                CoordinateKind::Motor => {
                    let place = |j: &usize| case.arm.motor(*j) + case.arm.dofs() == c.rate;
                    Some(input::joint_torque(n) + (0..n).find(place).unwrap())
                }
                CoordinateKind::Link => None,
            };
            joint += usize::from(c.kind == CoordinateKind::Motor);
            force.push(if at.is_some() { own } else { 0.0 });
            if let Some(at) = at {
                u[at] += own;
            }
        }
        assert_eq!((joint, base), (n, if case.arm.has_fixed_base() { 0 } else { 3 }));
        let (forced, driven) = (case.rates(case.at(), &force), case.rates(At { u: &u, ..case.at() }, &[]));
        for (a, b) in forced.iter().zip(&driven) {
            assert!((a - b).abs() <= 1e-10 * (1.0 + a.abs()), "{draws}: {forced:?} {driven:?}");
        }
    }
}

/// With a motor's row held by whatever force that takes, the others are those of the model with that motor stuck.
#[test]
fn a_held_motor_is_one_that_sticks() {
    let mut draws = Draws::new(0x91);
    let mut met = 0;
    for _ in 0..80 {
        let mut case = Case::drawn(&mut draws);
        let coordinates = case.plant.coordinates().to_vec();
        let Some(k) = coordinates.iter().position(|c| c.friction_mode.is_some()) else { continue };
        met += 1;
        let c = &coordinates[k];
        case.x[c.rate] = 0.0;
        let stuck: Vec<bool> = (0..coordinates.len()).map(|i| i == k).collect();
        let held = tangent(&*case.plant, case.at(), &[], &stuck).unwrap();
        case.modes[c.friction_mode.unwrap()] = 0;
        let sticking = tangent(&*case.plant, case.at(), &[], &[]).unwrap();
        let n = case.x.len();
        for row in (0..n).filter(|row| Some(*row) != c.position) {
            for column in (0..n).filter(|column| *column != c.rate) {
                let (a, b) = (held.by_state[row * n + column], sticking.by_state[row * n + column]);
                assert!((a - b).abs() < 1e-8 * (1.0 + a.abs() + b.abs()), "{draws} {row} {column}: {a} {b}");
            }
        }
        for (a, b) in held.by_force.iter().zip(&sticking.by_force) {
            assert!((a - b).abs() < 1e-8 * (1.0 + a.abs() + b.abs()), "{draws}: {a} {b}");
        }
    }
    assert!(met > 20, "{met}");
}

/// Each force has the effect of a relative change of its parameter.
#[test]
fn forces_of_parameters_have_their_effect() {
    let mut draws = Draws::new(0x2719);
    for _ in 0..40 {
        let case = Case::drawn(&mut draws);
        let n = case.arm.links();
        let own = [
            parameter::link_mass(n),
            parameter::link_inertia(n) + n - 1,
            parameter::link_center_of_mass(n),
            parameter::motor_inertia(n),
            parameter::joint_stiffness(n) + n - 1,
            parameter::joint_damping(n),
        ];
        let all = force_sensitivity(&*case.plant, case.at(), &[], &own).unwrap();
        let c = case.plant.coordinates().len();
        let base = case.rates(case.at(), &[]);
        for (k, force) in own.iter().zip(all.chunks(c)) {
            let h: f64 = 1e-4;
            let along = |h: f64| {
                let mut p = case.p.clone();
                p[*k] *= h.exp();
                case.rates(At { p: &p, ..case.at() }, &[])
            };
            let (up, down, pushed) = (along(h), along(-h), case.rates(case.at(), force));
            for row in 0..base.len() {
                let (slope, moved) = ((up[row] - down[row]) / (2.0 * h), pushed[row] - base[row]);
                let size = base[row].abs() + moved.abs() + 1.0;
                assert!((slope - moved).abs() < 1e-6 * size, "{draws} parameter {k}: {slope} {moved}");
            }
        }
    }
}

/// Every effect with bristles, on either plant: its states are those that follow. A step that does not know it takes them as slow.
#[test]
fn strained_bristles_follow() {
    use trueup_models::effect::{EffectChoice, EffectSet, PlantKind as Kind};
    use trueup_models::joint::TwoMassJoint;
    let states = |effects: &EffectSet| -> Vec<usize> {
        let own = effects.iter().filter(|e| e.spec().bristles);
        own.flat_map(|e| e.begin.states..e.begin.states + e.spec().states.len() * e.sites).collect()
    };
    let mut met = 0;
    for kind in [Kind::Joint, Kind::Arm] {
        for choice in EffectChoice::all(kind).filter(|c| c.spec().bristles) {
            let ids = [choice.id()];
            let (found, wanted) = if kind == Kind::Joint {
                let joint = TwoMassJoint::new(true, &ids).unwrap();
                let wanted = states(joint.effects());
                (Compiled::new(joint).followers().to_vec(), wanted)
            } else {
                let arm = PlanarManipulator::on_base(true, &[true, false, true], &ids).unwrap();
                let wanted = states(arm.effects());
                (Compiled::new(arm).followers().to_vec(), wanted)
            };
            assert!(!wanted.is_empty());
            assert_eq!(found, wanted, "{}", ids[0]);
            met += 1;
        }
    }
    assert!(met >= 4, "{met}");
}
