//! Random trees with random appendages: two algorithms and one answer, momentum and energy.

use super::machine::{LinkModes, Machine};
use super::properties::{inertia, turned, vector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use trueup_models::space::MAX_APPENDAGES;
use trueup_models::space::appendage::{AppendageError, Beam, Shapes, TableMode};
use trueup_models::space::articulated::{Moves, Rotor, SweepResult, accelerations};
use trueup_models::space::composite::{BASE, forces, mass_matrix, rotor_rows};
use trueup_models::space::flexible::Appendages;
use trueup_models::space::spatial::{Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use trueup_models::space::tree::{JointType, Tree, TreeBody, subspace};
use trueup_models::space::vector::dot;
use trueup_numerics::Dual;

pub(super) fn beam(rng: &mut StdRng) -> Beam<f64> {
    let mut between = |a: f64, b: f64| rng.random_range(a..b);
    Beam {
        length: between(0.5, 2.0),
        mass_per_length: between(0.2, 1.0),
        bending_stiffness: [between(1.0, 10.0), between(1.0, 10.0)],
        torsion_stiffness: between(0.5, 2.0),
        polar_inertia_per_length: between(0.02, 0.1),
        damping_ratio: between(0.0, 0.1),
        frame: SpatialFrame { rotation: turned(rng), origin: vector(rng) },
    }
}

fn table(rng: &mut StdRng) -> Vec<TableMode<f64>> {
    (0..rng.random_range(0..3))
        .map(|_| TableMode {
            frequency: rng.random_range(1.0..10.0),
            damping_ratio: rng.random_range(0.0..0.1),
            participation: SpatialWrench {
                torque: vector(rng).map(|v| 0.1 * v),
                force: vector(rng).map(|v| 0.1 * v),
            },
        })
        .collect()
}

fn machine(rng: &mut StdRng) -> Machine {
    let n = rng.random_range(0..=32);
    let body = |rng: &mut StdRng| TreeBody {
        rigid: Rigid::new(rng.random_range(0.5..1.5), vector(rng), &inertia(rng)),
        mount: SpatialFrame { rotation: turned(rng), origin: vector(rng) },
        axis: trueup_models::space::attitude::unit(vector(rng)),
    };
    let on = |rng: &mut StdRng| if rng.random_bool(0.5) { 0 } else { rng.random_range(0..=n) };
    let tree = Tree {
        parent: (0..n).map(|i| rng.random_range(0..=i)).collect(),
        joint: (0..n)
            .map(|_| if rng.random_bool(0.3) { JointType::Prismatic } else { JointType::Revolute })
            .collect(),
    };
    let gears = (0..n).map(|i| {
        let share = if tree.joint[i] == JointType::Revolute { [1.0, 0.01, 0.2][i % 3] } else { 0.0 };
        (rng.random_range(0.05..0.3), share, rng.random_bool(0.4))
    });
    let gears = gears.collect();
    let mut all = Machine {
        gears,
        base: Rigid::new(3.0, [0.0; 3], &inertia(rng)),
        bodies: (0..=n).map(|_| body(rng)).collect(),
        beams: (0..rng.random_range(0..5))
            .map(|_| {
                let count = |rng: &mut StdRng| rng.random_range(0..=3);
                (on(rng), Shapes { x: count(rng), y: count(rng), torsion: count(rng) }, beam(rng))
            })
            .collect(),
        tables: (0..rng.random_range(0..3))
            .map(|_| {
                let frame = SpatialFrame { rotation: turned(rng), origin: vector(rng) };
                (on(rng), frame, Rigid::new(1.0, vector(rng), &inertia(rng)), table(rng))
            })
            .collect(),
        links: (0..rng.random_range(0..3).min(n))
            .map(|k| {
                let (bending, torsion) = (rng.random_range(1..=3), rng.random_range(0..=2));
                let shapes = [
                    Shapes { x: bending, y: bending, torsion },
                    Shapes { x: 0, y: bending, torsion },
                    Shapes { x: bending, y: 0, torsion: 0 },
                ][rng.random_range(0..3)];
                // Of different bodies.
                (1 + k + 2 * rng.random_range(0..=(n - 1 - k) / 2), shapes, beam(rng))
            })
            .collect(),
        tree,
        stiffening: rng.random_bool(0.5),
        link_tables: Vec::new(),
    };
    // As many as there is room for.
    let room = MAX_APPENDAGES - all.beams.len() - all.tables.len() - all.links.len();
    for _ in 0..rng.random_range(0..3).min(room).min(n) {
        let on = rng.random_range(1..=n);
        let taken = all.links.iter().map(|l| l.0).chain(all.link_tables.iter().map(|l| l.0));
        if taken.into_iter().all(|other| other != on) {
            let frame = SpatialFrame { rotation: turned(rng), origin: vector(rng) };
            let whole = Rigid::new(1.0, vector(rng), &inertia(rng));
            let modes = table(rng);
            let reach = |rng: &mut StdRng| SpatialMotion { angular: vector(rng), linear: vector(rng) };
            let modes: LinkModes = modes.into_iter().map(|m| (m, reach(rng))).collect();
            all.link_tables.push((on, frame, whole, modes, vector(rng)));
        }
    }
    all
}

fn state(rng: &mut StdRng, m: &Machine) -> Vec<f64> {
    let l = m.layout();
    let mut x: Vec<f64> = (0..l.size()).map(|_| rng.random_range(-1.0..1.0)).collect();
    x[l.eta()..][..l.modes].iter_mut().for_each(|e| *e *= 0.3);
    let length = x[3..7].iter().map(|q| q * q).sum::<f64>().sqrt();
    x[3..7].iter_mut().for_each(|q| *q /= length);
    x
}

/// Checks SFF-5, SFF-6, LNK-3, LNK-5: articulated bodies find what composite bodies require, with appendages and links, beams and
/// tables, on any body.
#[test]
fn articulated_and_composite_bodies_agree_with_appendages() {
    let mut rng = StdRng::seed_from_u64(56);
    let (mut worst, mut symmetric): (f64, f64) = (0.0, 0.0);
    for _ in 0..300 {
        let m = machine(&mut rng);
        let (x, l) = (state(&mut rng, &m), m.layout());
        let n = l.n;
        let torques: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let applied: Vec<SpatialWrench<f64>> =
            (0..=n).map(|_| SpatialWrench { torque: vector(&mut rng), force: vector(&mut rng) }).collect();
        m.at(&x, &torques, |now, _| {
            let (rows, modal) = rotor_rows(now.tree, now.drives);
            let size = modal + l.modes;
            let [mut joint, mut rotor, mut eta] = [vec![0.0; n], vec![0.0; n], vec![0.0; l.modes]];
            let out = SweepResult { joint: &mut joint, rotor: &mut rotor, modal: &mut eta };
            let base = accelerations(now, &applied, None, out);
            // What acts, in the order of the coordinates.
            let (mut w, mut given) = (applied.clone(), vec![0.0; size]);
            let mut a = given.clone();
            given[modal..].copy_from_slice(&now.flexing.force[..l.modes]);
            a[modal..].copy_from_slice(&eta);
            for i in (1..=n).rev() {
                let Moves::Driven(torque) = now.drives[i - 1].moves else { panic!("driven") };
                given[BASE + i - 1] =
                    subspace(now.tree.joint[i - 1], now.bodies[i].axis).power(w[i]) + torque;
                a[BASE + i - 1] = joint[i - 1];
                if let (Some(row), Rotor::Driven(torque)) = (rows[i - 1], now.drives[i - 1].rotor) {
                    (given[row], a[row]) = (torque, rotor[i - 1]);
                }
                let parent = now.tree.parent[i - 1];
                let carried = now.placed[i].frame.outwards(w[i]);
                let ends = now.flexing.ends.unwrap();
                if let Some((_, end)) = ends.of(parent) {
                    (end.modes.0..end.modes.1)
                        .for_each(|j| given[modal + j] += ends.column(j).power(carried));
                }
                w[parent] = w[parent].plus(carried);
            }
            given[..3].copy_from_slice(&w[0].force);
            given[3..6].copy_from_slice(&w[0].torque);
            a[..3].copy_from_slice(&base.linear);
            a[3..6].copy_from_slice(&base.angular);
            let [mut needed, mut bias] = [vec![0.0; size], vec![0.0; size]];
            forces(now, (base, &joint, &rotor), &eta, &mut needed);
            let none = vec![0.0; n.max(l.modes)];
            forces(now, (SpatialMotion::zero(), &none, &none), &none, &mut bias);
            let mut mass = vec![0.0; size * size];
            mass_matrix(now, &mut mass);
            let largest = needed.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            for i in 0..size {
                let by_mass: f64 = (0..size).map(|j| mass[i * size + j] * a[j]).sum();
                worst = worst.max((needed[i] - given[i]).abs() / largest);
                worst = worst.max((by_mass + bias[i] - given[i]).abs() / largest);
                (0..i).for_each(|j| {
                    symmetric = symmetric.max((mass[i * size + j] - mass[j * size + i]).abs());
                });
            }
        });
    }
    println!("worst {worst:.1e}, symmetry {symmetric:.1e}");
    assert!(worst < 1e-11 && symmetric == 0.0, "{worst:e} {symmetric:e}");
}

/// Checks SFF-5 and SFF-6: momentum stays whatever dampers and motors do; energy is what motors give less what dampers take.
/// Rates of momentum and energy by dual numbers along the motion.
#[test]
fn appendages_keep_momentum_and_the_balance_of_energy() {
    let mut rng = StdRng::seed_from_u64(57);
    let (mut momentum, mut balance): (f64, f64) = (0.0, 0.0);
    for _ in 0..200 {
        let m = machine(&mut rng);
        let (x, l) = (state(&mut rng, &m), m.layout());
        let torques: Vec<f64> = (0..l.n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let dx = m.rates(&x, &torques);
        let along: Vec<Dual<1>> = x.iter().zip(&dx).map(|(x, d)| Dual::new(*x, [*d])).collect();
        let (h, energy, heat) = m.books(&along);
        let size = dx.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        let power: f64 = (0..l.n)
            .map(|i| {
                let own = if m.gears[i].2 { x[l.rotors() + i] } else { 0.0 };
                torques[i] * (x[l.rates() + i] + own)
            })
            .sum();
        h.iter().for_each(|h| momentum = momentum.max(h.eps[0].abs() / size));
        balance = balance.max((energy.eps[0] - power + heat.re).abs() / size);
    }
    println!("rate of momentum {momentum:.1e}, of energy beyond power and heat {balance:.1e}");
    assert!(momentum < 1e-11 && balance < 1e-11, "{momentum:e} {balance:e}");
}

/// Checks SFF-5: a beam's modes as a table of its own, unbent, are the beam: the table holds what is linear.
#[test]
fn sff_5_a_table_of_modes_is_the_beam_that_it_was_made_of() {
    let mut rng = StdRng::seed_from_u64(58);
    let (frame, b) = (SpatialFrame { rotation: turned(&mut rng), origin: vector(&mut rng) }, beam(&mut rng));
    let shapes = Shapes { x: 2, y: 1, torsion: 2 };
    let here = SpatialFrame { rotation: trueup_models::space::vector::identity(), origin: [0.0; 3] };
    let mut own = Appendages::<f64>::new();
    own.add_beam(0, shapes, &Beam { frame: here, ..b }).unwrap();
    let at_rest = |a: &Appendages<f64>| {
        let base = trueup_models::space::tree::PlacedBody::base(here, SpatialMotion::zero());
        let mut bent = trueup_models::space::bent::DeformedAppendages::new();
        a.bend(&[base], &[0.0; 8], &[0.0; 8], &mut bent);
        (0..5).map(|j| bent.of(a).coupling[j]).collect::<Vec<_>>()
    };
    let coupling = at_rest(&own);
    let rows: Vec<TableMode<f64>> = (0..5)
        .map(|j| {
            let m = own.modes()[j];
            let frequency = (m.stiffness / m.mass).sqrt();
            TableMode {
                frequency,
                damping_ratio: b.damping_ratio,
                participation: coupling[j].times(1.0 / m.mass.sqrt()),
            }
        })
        .collect();
    let mut by_table = Appendages::<f64>::new();
    by_table.add_table(0, &frame, &own.parts()[0].rigid, &rows).unwrap();
    let mut by_beam = Appendages::<f64>::new();
    by_beam.add_beam(0, shapes, &Beam { frame, ..b }).unwrap();
    let (t, c) = (at_rest(&by_table), at_rest(&by_beam));
    for j in 0..5 {
        let (mode, of) = (by_beam.modes()[j], by_table.modes()[j]);
        let wanted = c[j].times(1.0 / mode.mass.sqrt());
        let off = t[j].minus(wanted);
        assert!(dot(off.force, off.force) + dot(off.torque, off.torque) < 1e-28);
        assert!((mode.damping / mode.mass - of.damping).abs() < 1e-13);
    }
    // Twice the participation is four times the mass.
    let too_much: Vec<_> =
        rows.iter().map(|r| TableMode { participation: r.participation.times(2.0), ..*r }).collect();
    let mut refused = Appendages::<f64>::new();
    let whole = own.parts()[0].rigid;
    let why = refused.add_table(0, &frame, &whole, &too_much).unwrap_err();
    let AppendageError::Participation(Some((0, moved, there))) = why else { panic!("{why}") };
    // Two shapes of a clamped beam move 0.613 and 0.188 of its mass.
    assert!(there == whole.mass && (moved / there / 4.0 - 0.8014).abs() < 1e-3, "{why}");
    assert_eq!(refused.add_beam(0, Shapes { x: 13, ..shapes }, &b), Err(AppendageError::Modes));
    let many = vec![TableMode { participation: SpatialWrench::zero(), ..rows[0] }; 49];
    assert_eq!(refused.add_table(0, &frame, &whole, &many), Err(AppendageError::Modes));
    let flat = Beam { polar_inertia_per_length: 0.0, ..b };
    assert_eq!(refused.add_beam(0, shapes, &flat), Err(AppendageError::Massless(3)));
    assert!(refused.parts().is_empty() && refused.modes().is_empty());
    for _ in 0..8 {
        refused.add_beam(0, Shapes::default(), &b).unwrap();
    }
    assert_eq!(refused.add_beam(0, Shapes::default(), &b), Err(AppendageError::Appendages));
}
