//! `FlexibleArm` against the joint that it is made of, its energy, its motors that stick.

use crate::arm_common::Run;
use nalgebra::{DMatrix, DVector};
use trueup_models::flexible_arm::layout::{Outputs, Parameters};
use trueup_models::flexible_arm::presets::{RAISED, delian, parameters, structure};
use trueup_models::flexible_arm::{FlexibleArm, FlexibleArmStructure};
use trueup_models::friction::STUCK;
use trueup_models::joint::output::{LOAD_ANGLE, MOTOR_ANGLE};
use trueup_models::joint::{TwoMassJoint, parameter as joint};
use trueup_models::space::appendage::Beam;
use trueup_models::space::bent::DeformedAppendages;
use trueup_models::space::composite::BASE;
use trueup_models::space::design::{Flexure, RobotDesign};
use trueup_models::space::flexible::Appendages;
use trueup_models::space::layout::{Inputs, Outputs as BodyOutputs, Parameters as BodyParameters, States};
use trueup_models::space::ritz;
use trueup_models::space::spatial::{SpatialFrame, SpatialMotion};
use trueup_models::space::table::{LinkTable, ModeReach, ModeTable, TabledMode};
use trueup_models::space::tree::PlacedBody;
use trueup_models::space::vector::identity;
use trueup_numerics::hybrid::{At, Hybrid};

/// DELIAN and where its values are.
struct Delian {
    arm: FlexibleArm,
    p: Vec<f64>,
    at: States,
    input: Inputs,
    body: BodyParameters,
    own: Parameters,
    body_output: BodyOutputs,
    output: Outputs,
}

fn of(design: &RobotDesign, by_current: bool) -> Delian {
    let robot = design.structure();
    let arm = FlexibleArm::new(FlexibleArmStructure { robot: robot.clone(), by_current }).unwrap();
    let p = parameters(&arm, design);
    arm.check(&p).unwrap();
    let sizes = arm.bodies().sizes();
    Delian {
        at: States::new(&robot),
        input: Inputs::new(&robot),
        body: BodyParameters::new(&robot),
        own: Parameters::new(arm.structure()).behind(sizes.parameters),
        body_output: BodyOutputs::new(&robot),
        output: Outputs::new(arm.structure()).behind(sizes.outputs),
        arm,
        p,
    }
}

impl Delian {
    fn smooth(&mut self) {
        for begin in [
            self.own.coulomb_friction,
            self.own.static_friction,
            self.own.viscous_friction,
            self.body.joint_damping,
        ] {
            self.p[begin..][..6].fill(0.0);
        }
        let robot = &self.arm.structure().robot;
        let (beams, tabled) = (robot.beams().count(), robot.linked_tabled());
        self.p[self.body.link_damping..][..beams].fill(0.0);
        self.p[self.body.link_mode_damping..][..tabled].fill(0.0);
    }
}

/// The table that a tool for structures would make of a beam by its shapes.
fn tabled(f: &Flexure) -> LinkTable {
    let here = SpatialFrame { rotation: identity(), origin: [0.0; 3] };
    let shear = f.youngs_modulus / (2.0 * (1.0 + f.poisson_ratio));
    let beam = Beam {
        frame: here,
        length: f.length,
        mass_per_length: f.mass_per_length,
        bending_stiffness: f.area_moment.map(|j| f.youngs_modulus * j),
        torsion_stiffness: shear * f.torsion_constant,
        polar_inertia_per_length: f.polar_inertia_per_length,
        damping_ratio: f.damping_ratio,
    };
    let (mut own, mut bent) = (Appendages::<f64>::new(), DeformedAppendages::new());
    own.add_link(1, f.shapes, &beam, false).unwrap();
    let count = f.shapes.modes();
    own.bend(
        &[PlacedBody::base(here, SpatialMotion::zero()); 2],
        &vec![0.0; count],
        &vec![0.0; count],
        &mut bent,
    );
    let (mass, across) = (f.mass_per_length * f.length, f.mass_per_length * f.length.powi(3) / 12.0);
    let polar = f.polar_inertia_per_length * f.length;
    let per_root = |j: usize| 1.0 / own.modes()[j].mass.sqrt();
    let modes = own.modes().iter().zip(bent.of(&own).coupling).enumerate().map(|(j, (m, c))| {
        let c = c.times(per_root(j));
        TabledMode {
            frequency: (m.stiffness / m.mass).sqrt(),
            damping_ratio: f.damping_ratio,
            participation: [c.force[0], c.force[1], c.force[2], c.torque[0], c.torque[1], c.torque[2]],
        }
    });
    let bending = f.shapes.x + f.shapes.y;
    let reach = |j: usize| {
        let slope = |k: usize| ritz::bending(f.shapes.x, k).unwrap().slope / f.length;
        let (shift, turn) = if j < f.shapes.x {
            ([1.0, 0.0, 0.0], [0.0, slope(j), 0.0])
        } else if j < bending {
            ([0.0, 1.0, 0.0], [-slope(j - f.shapes.x), 0.0, 0.0])
        } else {
            ([0.0; 3], [0.0, 0.0, 1.0])
        };
        ModeReach { shift: shift.map(|s| s * per_root(j)), turn: turn.map(|t| t * per_root(j)) }
    };
    LinkTable {
        body: f.body,
        table: ModeTable {
            name: "link".into(),
            position: f.position,
            orientation: f.orientation,
            mass,
            center_of_mass: [0.0, 0.0, 0.5 * f.length],
            inertia: [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, polar]],
            modes: modes.collect(),
        },
        end: [0.0, 0.0, f.length],
        reach: (0..count).map(reach).collect(),
    }
}

/// DELIAN with links by tables: both, or the second alone.
fn by_tables(beams: usize) -> RobotDesign {
    let mut design = delian();
    let tables = design.flexures.split_off(beams);
    design.link_tables = tables.iter().map(tabled).collect();
    design
}

/// A current that breaks the joint away, turns it back, lets it rest.
fn current(t: f64) -> f64 {
    0.018 * (2.0 * t).sin() + 0.004 * (11.0 * t).sin()
}

/// Checks LNK-6: an arm of one joint is the joint (TMJ-1 to TMJ-4).
#[test]
fn lnk6_a_joint_of_the_arm_is_the_two_mass_joint() {
    let mut design = delian().stiffened();
    design.links.truncate(1);
    design.tips.clear();
    design.links[0].inertia = [[8.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 8.0]];
    let arm = FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), by_current: true }).unwrap();
    let at = States::new(&arm.structure().robot);
    let own = Parameters::new(arm.structure()).behind(arm.bodies().sizes().parameters);
    let mut p = arm.defaults();
    let of_bodies = design.parameters();
    p[..of_bodies.len()].copy_from_slice(&of_bodies);
    let model = TwoMassJoint::new::<&str>(true, &[]).unwrap();
    let mut q = vec![0.0; model.sizes().parameters];
    let ratio = 44340.0;
    let (coulomb, breakaway, viscous) = (7.37e-5, 2.99e-4, 7.2e-8);
    p[own.coulomb_friction] = coulomb * ratio;
    p[own.static_friction] = breakaway * ratio;
    p[own.viscous_friction] = viscous * ratio * ratio;
    for (to, value) in [
        (joint::MOTOR_INERTIA, 1.2e-7),
        (joint::LOAD_INERTIA, 8.0),
        (joint::GEAR_RATIO, ratio),
        (joint::TORQUE_CONSTANT, 0.02),
        (joint::STIFFNESS, 3.07e-5),
        (joint::DAMPING, 8.07e-8),
        (joint::COULOMB_FRICTION, coulomb),
        (joint::STATIC_FRICTION, breakaway),
        (joint::VISCOUS_FRICTION, viscous),
    ] {
        q[to] = value;
    }
    let mut arm = Run::new(&arm, &p, |t| vec![current(t)]);
    let mut one = Run::new(&model, &q, |t| vec![current(t), 0.0]);
    let (mut worst, mut moved) = ([0.0_f64; 2], 0.0_f64);
    for k in 1..=40 {
        arm.to(0.1 * f64::from(k), 4e-3);
        one.to(0.1 * f64::from(k), 4e-3);
        let y = one.outputs();
        worst[0] = worst[0].max((arm.x[at.motor_angle] * ratio - y[MOTOR_ANGLE]).abs());
        worst[1] = worst[1].max((arm.x[at.joint_angle] - y[LOAD_ANGLE]).abs());
        moved = moved.max(y[MOTOR_ANGLE].abs());
    }
    println!(
        "motor by {moved:.1} rad, {} and {} events, off by {:.1e} and {:.1e} rad",
        arm.events.len(),
        one.events.len(),
        worst[0],
        worst[1]
    );
    assert!(one.events.len() > 2 && arm.events.len() == one.events.len());
    assert!(worst[0] < 1e-9 * moved && worst[1] < 1e-9 * moved / ratio, "{worst:?}");
}

/// Checks LNK-3, LNK-5: falling with bending links and without friction, nothing is lost; links of beams, of tables, of both.
#[test]
fn lnk3_a_falling_arm_keeps_its_energy() {
    falls(&delian(), 0.1, 1.0);
    falls(&by_tables(1), 0.05, 0.3);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn lnk3_an_arm_that_falls_for_half_a_second_keeps_its_energy() {
    falls(&delian(), 0.5, 10.0);
    falls(&by_tables(1), 0.1, 2.0);
}

/// For this long, s; to more than this energy of motion, J.
fn falls(design: &RobotDesign, duration: f64, least: f64) {
    let mut d = of(design, true);
    d.smooth();
    // Motors that weigh little, so that it falls.
    d.p[d.body.motor_inertia..][..6].fill(0.05);
    d.p[d.body.initial_joint_angle + 3] = 0.4;
    d.p[d.body.initial_motor_angle + 3] = 0.4;
    d.p[d.body.initial_joint_velocity] = 1.0;
    d.p[d.body.initial_motor_velocity] = 1.0;
    let inputs = d.arm.sizes().inputs;
    let mut run = Run::new(&d.arm, &d.p, |_| vec![0.0; inputs]);
    let energy = |y: &[f64]| [y[d.body_output.kinetic_energy], y[d.body_output.potential_energy]];
    let before: f64 = energy(&run.outputs()).iter().sum();
    run.to(duration, 1e-4);
    let [kinetic, potential] = energy(&run.outputs());
    let bent = run.x[d.at.link_coordinate..][..5].iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    println!(
        "{kinetic:.1} J of motion, links bent by {:.1} mm, energy off by {:.1e} J",
        1e3 * bent,
        kinetic + potential - before
    );
    assert!(kinetic > least && (kinetic + potential - before).abs() < 1e-7);
}

/// Checks LNK-5: an arm at rest whose links are straight starts as the same, whether they are beams or the tables made of them.
#[test]
fn lnk5_a_table_starts_as_the_beam_that_it_was_made_of() {
    let beams = of(&delian(), true);
    let rates = |d: &Delian| {
        let mut x = vec![0.0; d.arm.sizes().states];
        d.arm.start(&d.p, &mut x);
        for j in 0..6 {
            x[d.at.joint_angle + j] += 0.3 * (j as f64 + 1.0).sin();
        }
        let mut u = vec![0.0; d.arm.sizes().inputs];
        u.iter_mut().enumerate().for_each(|(k, u)| *u = (k as f64).cos());
        let mut dx = vec![0.0; x.len()];
        d.arm.rates(At { t: 0.0, x: &x, u: &u, p: &d.p, modes: &[1; 6] }, &mut dx);
        dx
    };
    let wanted = rates(&beams);
    for kept in [0, 1] {
        let d = of(&by_tables(kept), true);
        let mut found = rates(&d);
        let unit: Vec<f64> = delian()
            .flexures
            .iter()
            .enumerate()
            .flat_map(|(k, f)| {
                let (mass, polar) = (f.mass_per_length * f.length, f.polar_inertia_per_length * f.length);
                let (shapes, tabled) = (f.shapes, k >= kept);
                (0..5).map(move |j| {
                    let square = if j < 4 {
                        mass * ritz::bending(shapes.x, j % 2).unwrap().shape.square
                    } else {
                        polar * ritz::torsion(shapes.torsion, 0).unwrap().shape.square
                    };
                    if tabled { 1.0 / square.sqrt() } else { 1.0 }
                })
            })
            .collect();
        let row = d.at.link_velocity;
        found[row..].iter_mut().zip(&unit).for_each(|(a, u)| *a *= u);
        let largest = wanted.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let off = wanted.iter().zip(&found).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / largest;
        println!("{kept} of 2 links a beam: off by {off:.1e} of the accelerations");
        assert!(off < 1e-12, "{off:e}");
    }
}

/// Checks LNK-6: currents that balance the weight hold the arm by friction; without, it falls where the weight breaks it away.
#[test]
#[ignore = "long: ./test --full runs it"]
fn lnk6_motors_stick_where_friction_holds_the_weight() {
    let mut d = of(&delian().stiffened(), true);
    let inputs = d.arm.sizes().inputs;
    // Twisted by the weight as Table 4 has it: joints 2, 3, 5.
    for (j, twist) in [(1, 0.1712_f64), (2, 0.08), (4, 0.02)] {
        d.p[d.body.initial_joint_angle + j] -= twist.to_radians();
    }
    let held = |t: f64| {
        let mut u = vec![0.0; inputs];
        u[d.input.joint_torque + 1] = 30.9 / (21750.0 * 0.02);
        u[d.input.joint_torque + 2] = 25.8 / (25000.0 * 0.02);
        // Joint 5 carries 5.4 N.m, and sticks up to 5.1 by itself.
        u[d.input.joint_torque + 4] = 5.0 / (25000.0 * 0.02);
        u[d.input.joint_torque] = if t > 0.12 { 0.02 } else { 0.0 };
        u
    };
    let mut run = Run::new(&d.arm, &d.p, held);
    assert_eq!(run.modes, [STUCK; 6]);
    run.to(0.1, 1e-3);
    let y = run.outputs();
    assert_eq!(&y[d.output.sticking..][..6], [1.0; 6]);
    // Its springs carry the weight.
    assert_eq!(run.x[d.at.motor_angle + 1], RAISED);
    let twist = y[d.output.transmission_torque + 1];
    let friction = y[d.output.friction_torque + 1];
    assert!((y[d.output.motor_torque + 1] - twist - friction).abs() < 0.05, "{twist} {friction}");
    // The shoulder's motor is driven beyond 13.3 N.m then.
    run.to(0.2, 1e-3);
    let y = run.outputs();
    assert_eq!(&y[d.output.sticking..][..6], [0.0, 1.0, 1.0, 1.0, 1.0, 1.0]);
    assert!(run.x[d.at.motor_velocity] > 1e-3);
    let loose = Run::new(&d.arm, &d.p, |_| vec![0.0; inputs]);
    assert!(loose.modes[1] == -1 && loose.modes[2] == -1, "{:?}", loose.modes);
}

/// Checks LNK-6: motors that stop at once push what they carry by an impulse: M determines it.
#[test]
fn lnk6_an_impulse_of_the_motors_is_that_of_the_mass_matrix() {
    let d = of(&delian(), true);
    let n = d.arm.joints();
    let modes = d.arm.structure().robot.modes();
    let mut x = vec![0.0; d.arm.sizes().states];
    d.arm.start(&d.p, &mut x);
    for (k, v) in x.iter_mut().enumerate() {
        *v += 0.01 * (k as f64).sin();
    }
    let u = vec![0.0; d.arm.sizes().inputs];
    let at = At { t: 0.0, x: &x, u: &u, p: &d.p, modes: &[] };
    let given = [(1, 0.3), (4, -0.2)];
    let mut jump = vec![0.0; x.len()];
    d.arm.bodies().impulse(at, &given, &mut jump);
    let size = BASE + 2 * n + modes;
    let mut m = vec![0.0; size * size];
    d.arm.bodies().mass_matrix(&at, &mut m);
    let m = DMatrix::from_row_slice(size, size, &m);
    // Held: the base. Given: two motors. Free: the rest, on which no impulse acts.
    let motors: Vec<usize> = given.iter().map(|g| BASE + n + g.0).collect();
    let free: Vec<usize> = (BASE..size).filter(|r| !motors.contains(r)).collect();
    let inner = m.select_rows(&free).select_columns(&free);
    let pushed =
        m.select_rows(&free).select_columns(&motors) * DVector::from_vec(given.map(|g| g.1).to_vec());
    let wanted = inner.lu().solve(&-pushed).unwrap();
    let rows = |r: usize| d.at.joint_velocity + r - BASE;
    for (r, wanted) in free.iter().zip(wanted.iter()) {
        assert!((jump[rows(*r)] - wanted).abs() < 1e-10, "{r}: {} {wanted}", jump[rows(*r)]);
    }
    assert!(motors.iter().zip(given).all(|(r, g)| jump[rows(*r)] == g.1));
    assert!(jump[..d.at.joint_velocity].iter().all(|v| *v == 0.0));
}

#[test]
fn what_an_arm_cannot_be_is_refused() {
    let refused = |s: FlexibleArmStructure| FlexibleArm::new(s).unwrap_err();
    let own = structure(true);
    let with = |change: fn(&mut trueup_models::space::RobotStructure)| {
        let mut s = own.clone();
        change(&mut s.robot);
        refused(s)
    };
    assert!(with(|r| r.held = false).contains("SpatialFreeFlyer"));
    assert!(with(|r| r.links[1].x = 3).contains("the same number of shapes along x and along y"));
    assert!(with(|r| r.links[1].torsion = 6).contains("at most 5"));
    assert!(with(|r| r.links.truncate(3)).contains("3 rows for 6 bodies"));
    assert!(with(|r| r.tabled_links = vec![2]).contains("1 entries for 6 bodies"));
    assert!(with(|r| r.tabled_links = vec![0, 2, 0, 0, 0, 0]).contains("body 2 is a beam and a table"));
    assert!(with(|r| r.tabled_links = vec![16, 0, 0, 0, 0, 0]).contains("16 modes, at most 15"));
    let stiffening = with(|r| {
        r.tabled_links = vec![2, 0, 0, 0, 0, 0];
        r.axial_stiffening = true;
    });
    assert!(stiffening.contains("link of body 1 is a table of modes") && stiffening.contains("leave axial"));
    let d = of(&RobotDesign { links: delian().links, ..delian() }, true);
    let mut robot = d.arm.structure().clone();
    robot.robot.flexible[2] = false;
    let arm = FlexibleArm::new(robot).unwrap();
    let (at, why) = arm.check(&parameters(&arm, &delian())).unwrap_err();
    assert!(why.contains("coulombFriction[3]") && why.contains("jointFlexible[3] = true"), "{at} {why}");
}
