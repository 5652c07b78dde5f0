//! Appendages by tables of modes: against the beams that they are of, and one by hand. Spin that is too fast.

use trueup_models::space::bent::DeformedAppendages;
use trueup_models::space::design::{Appendage, RobotDesign};
use trueup_models::space::flexible::Appendages;
use trueup_models::space::presets;
use trueup_models::space::spatial::{SpatialFrame, SpatialMotion};
use trueup_models::space::table::{ModeTable, TabledMode};
use trueup_models::space::tree::PlacedBody;
use trueup_models::space::vector::identity;

use super::{Flyer, worst};
use crate::arm_common::Random;

/// The table that a tool for structures would make of a beam.
fn tabled(a: &Appendage) -> ModeTable {
    let here = SpatialFrame { rotation: identity(), origin: [0.0; 3] };
    let mut own = Appendages::<f64>::new();
    own.add_beam(0, a.shapes, &trueup_models::space::appendage::Beam { frame: here, ..a.beam() }).unwrap();
    let mut bent = DeformedAppendages::new();
    own.bend(&[PlacedBody::base(here, SpatialMotion::zero())], &[0.0; 16], &[0.0; 16], &mut bent);
    let (mass, length) = (a.mass_per_length * a.length, a.length);
    let across = mass * length * length / 12.0;
    let modes = own.modes().iter().zip(bent.of(&own).coupling).map(|(m, c)| {
        let c = c.times(1.0 / m.mass.sqrt());
        TabledMode {
            frequency: (m.stiffness / m.mass).sqrt(),
            damping_ratio: a.damping_ratio,
            participation: [c.force[0], c.force[1], c.force[2], c.torque[0], c.torque[1], c.torque[2]],
        }
    });
    ModeTable {
        name: a.name.clone(),
        position: a.position,
        orientation: a.orientation,
        mass,
        center_of_mass: [0.0, 0.0, 0.5 * length],
        inertia: [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, a.polar_inertia_per_length * length]],
        modes: modes.collect(),
    }
}

/// Checks SFF-5 and SFF-6: small motion of panels by shapes is that by their tables, one of them or both; what they differ by is of
/// second order.
#[test]
fn a_table_moves_as_the_shapes_that_it_is_made_of() {
    let mut design = presets::table_1_with_panels();
    let by_shapes = Flyer::of(&design);
    let s = by_shapes.model.structure().clone();
    // Of the modal coordinates: metres (radians) per unit of the mass-normalised ones.
    let beam = design.appendages[0].clone();
    let (bent, turned) =
        (0.25 * beam.mass_per_length * beam.length, 0.5 * beam.polar_inertia_per_length * beam.length);
    let unit = [bent, bent, bent, turned].map(|m: f64| 1.0 / m.sqrt());
    let second = design.appendages.pop().unwrap();
    design.tables = vec![tabled(&second)];
    let mixed = Flyer::of(&design);
    let first = design.appendages.pop().unwrap();
    design.tables = vec![tabled(&first), tabled(&second)];
    let tables = Flyer::of(&design);
    for (f, from) in [(&mixed, 4), (&tables, 0)] {
        let mut random = Random(31);
        let mut found = Vec::new();
        for size in [1e-3, 1e-4] {
            let (mut x, mut u) = by_shapes.anywhere(&mut random);
            // The arm's motion is as large as it likes; the panels' and the base's is small.
            u.iter_mut().for_each(|u| *u *= size);
            let row = by_shapes.at;
            for begin in [row.modal_coordinate, row.modal_velocity] {
                x[begin..][..s.modes()].iter_mut().for_each(|v| *v *= size);
            }
            for begin in [row.base_velocity, row.base_angular_velocity, row.joint_velocity] {
                x[begin..][..3].iter_mut().for_each(|v| *v *= size);
            }
            let mut z = x.clone();
            let scaled = |z: &mut [f64], back: bool| {
                for (j, m) in (from..8).map(|j| (j, unit[j % 4])) {
                    for begin in [row.modal_coordinate, row.modal_velocity] {
                        z[begin + j] *= if back { m } else { 1.0 / m };
                    }
                }
            };
            scaled(&mut z, false);
            let (wanted, mut rates) = (by_shapes.rates(&x, &u), f.rates(&z, &u));
            scaled(&mut rates, true);
            let all = wanted[row.base_velocity..].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            found.push(worst(&wanted, &rates) / all);
        }
        println!(
            "tables from mode {from}: off by {:.1e} and {:.1e} of the accelerations",
            found[0], found[1]
        );
        assert!(found[0] < 5e-4 && found[1] < 2e-5 && found[1] < 0.1 * found[0], "{found:?}");
    }
}

/// By hand: 3 of 8 kg slide along x on a spring on a base of 100 kg. Free of all else their frequency is
/// w sqrt(M / (M - 3)), M = 108 kg; and what pulls at the base does not move the whole.
#[test]
fn a_table_by_hand() {
    let w = 2.0;
    let table = ModeTable {
        name: "mass on a spring".into(),
        position: [0.0; 3],
        orientation: [1.0, 0.0, 0.0, 0.0],
        mass: 8.0,
        center_of_mass: [0.0; 3],
        inertia: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        modes: vec![TabledMode {
            frequency: w,
            damping_ratio: 0.0,
            participation: [3.0_f64.sqrt(), 0.0, 0.0, 0.0, 0.0, 0.0],
        }],
    };
    let design = RobotDesign {
        base_mass: 100.0,
        links: Vec::new(),
        tips: Vec::new(),
        tables: vec![table.clone()],
        ..presets::table_1()
    };
    design.check().unwrap();
    let f = Flyer::of(&design);
    let mut x = vec![0.0; f.at.count];
    x[f.at.base_quaternion] = 1.0;
    x[f.at.modal_coordinate] = 0.1;
    let dx = f.rates(&x, &[0.0; 6]);
    let found = dx[f.at.modal_velocity];
    assert!((found + 0.1 * w * w * 108.0 / 105.0).abs() < 1e-15, "{found}");
    let base = dx[f.at.base_velocity];
    assert!((108.0 * base + 3.0_f64.sqrt() * found).abs() < 1e-14, "{base}");
    // Nine of eight kilograms cannot be moved.
    let mut much = design.clone();
    much.tables[0].modes[0].participation[0] = 3.0;
    let said = much.check().unwrap_err().to_string();
    assert!(
        said.contains(
            "`mass on a spring`: its modes move 9.0000 kg along x, and it has 8.0000; give mass-normalised"
        ),
        "{said}"
    );
    let mut p = f.p.clone();
    p[f.parameter.mode_participation + 4] = 1.5;
    let (at, said) = f.model.check(&p).unwrap_err();
    assert!(
        at == f.parameter.mode_participation && said.contains("move 2.2500 kg.m2 through its root about y"),
        "{said}"
    );
    // Along x and about y each within what there is, both at once not: the mass would have to be elsewhere.
    p[f.parameter.mode_participation] = 2.5;
    p[f.parameter.mode_participation + 4] = 0.9;
    let (_, said) = f.model.check(&p).unwrap_err();
    assert!(said.contains("its modes together move more"), "{said}");
}

/// Panels of 3.108 rad/s, clamped: the base may spin at 0.62 rad/s.
#[test]
fn spin_that_is_too_fast_is_told() {
    let mut design = presets::table_1_with_panels();
    for tables in [false, true] {
        if tables {
            design.tables = design.appendages.iter().map(tabled).collect();
            design.appendages.clear();
        }
        let f = Flyer::of(&design);
        let mut x = vec![0.0; f.at.count];
        x[f.at.base_quaternion] = 1.0;
        let u = vec![0.0; f.input.count];
        for (rate, told) in [(0.62, false), (0.6225, true)] {
            x[f.at.base_angular_velocity + 1] = -rate;
            let said = f.model.too_fast(&f.now(&x, &u));
            assert_eq!(said.is_some(), told, "{rate}: {said:?}");
            assert!(said.is_none_or(|s| s.contains("appendage 1 (3.1077 rad/s clamped)")));
        }
    }
    let f = Flyer::of(&presets::chaser());
    assert_eq!(f.model.too_fast(&f.now(&vec![9.0; f.at.count], &[])), None);
}
