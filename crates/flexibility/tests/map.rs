//! Poses, loads, maps over two joints.

use std::f64::consts::FRAC_PI_2;

use trueup_flexibility::elements::{FlexibleElement, contributions, squares};
use trueup_flexibility::equilibrium::{EquilibriumError, equilibrium};
use trueup_flexibility::ground::{EARTH, Standing, loaded, standing};
use trueup_flexibility::map::{PoseGrid, RestPose, weighed};
use trueup_models::flexible_arm::presets::{RAISED, delian};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::layout::Parameters;

use super::beams::chain;

const POSTURE: [f64; 6] = [0.3, 0.6, -0.9, 0.4, 0.5, -0.2];

/// Checks LNK-9: energy is the slope of the frequency's square, d ln(omega^2) / d ln(k), where nothing weighs.
#[test]
fn lnk9_energy_is_the_slope_of_the_square() {
    let on = standing(&delian(), [0.0; 3]).unwrap();
    let pose = RestPose::of(&on, &POSTURE).unwrap();
    let at = Parameters::new(&on.arm.structure().robot);
    let first = |element: FlexibleElement, factor: f64| {
        let mut p = on.parameters.clone();
        match element {
            FlexibleElement::Joint(j) => p[at.joint_stiffness + j - 1] *= factor,
            FlexibleElement::Link(l) => p[at.youngs_modulus + l - 1] *= factor,
        }
        RestPose::of(&Standing { arm: on.arm.clone(), parameters: p }, &POSTURE).unwrap().modes[0]
    };
    for c in &pose.elements {
        let step = 1e-4;
        let slope = (first(c.element, 1.0 + step) / first(c.element, 1.0 - step)).ln() / step;
        assert!((slope - c.energy).abs() < 1e-6, "{}: {slope} {}", c.element, c.energy);
        assert_eq!((c.deflection, c.share), (0.0, 0.0));
        // Concave: the tangent is above.
        assert!((1.0 + c.rise).powi(2) - 1.0 <= 0.2 * c.energy + 1e-12);
    }
    assert!(squares(pose.elements.iter().map(|c| c.rise)) < 0.2);
}

/// A mass at the tip bends the arm as its weight there does.
#[test]
fn a_payload_is_a_weight_at_the_tip_at_rest() {
    let (design, mass) = (delian(), 1.7);
    let (plain, heavy) =
        (standing(&design, EARTH).unwrap(), standing(&loaded(&design, mass).unwrap(), EARTH).unwrap());
    let force = EARTH.map(|g| g * mass);
    let by_force = equilibrium(&plain.arm, &plain.parameters, &POSTURE, force).unwrap();
    let by_mass = equilibrium(&heavy.arm, &heavy.parameters, &POSTURE, [0.0; 3]).unwrap();
    let apart = by_force.state.iter().zip(&by_mass.state).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(apart < 1e-10, "{apart:e}");
    let deflections = |on: &Standing, rest, force| {
        let all = contributions(&on.arm, &on.parameters, rest, force).unwrap();
        all.iter().map(|c| c.deflection).collect::<Vec<_>>()
    };
    let (a, b) = (deflections(&plain, &by_force, force), deflections(&heavy, &by_mass, [0.0; 3]));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-10), "{a:?} {b:?}");
    assert!(by_mass.frequencies().unwrap()[0] < by_force.frequencies().unwrap()[0]);
    assert!(loaded(&trueup_models::space::design::RobotDesign { tips: vec![], ..design }, 1.0).is_none());
}

#[test]
fn joints_about_the_vertical_do_not_change_the_weight() {
    let first_two =
        |gravity| weighed(&standing(&delian(), gravity).unwrap(), &[0.0; 6]).unwrap()[..2].to_vec();
    assert_eq!(first_two(EARTH), [1, 2]);
    assert_eq!(first_two([0.0, -9.81, 0.0]), [0, 1]);
    let floats = standing(&delian(), [0.0; 3]).unwrap();
    assert_eq!(weighed(&floats, &[0.0; 6]).unwrap(), [0; 0]);
}

#[test]
fn a_map_is_its_poses() {
    let on = standing(&delian(), EARTH).unwrap();
    let grid = PoseGrid::even([1, 2], [0.0, -RAISED], [RAISED, 0.0], [2, 1]);
    let mut heard = Vec::new();
    let (poses, fallen) = grid.poses(&on, &[0.0; 6], |done| heard.push(done)).unwrap();
    assert_eq!((poses.len(), fallen.len(), grid.count(), heard.len()), (6, 0, 6, 6));
    let last = [0.0, RAISED, -RAISED, 0.0, 0.0, 0.0];
    assert_eq!(poses[4], RestPose::of(&on, &last).unwrap());
    // Against where the unbent arm would have it: down, and more than a millimetre.
    let down = poses[4].tip_deflection.unwrap();
    assert!(
        down[2] < -1e-3 && down[1].abs() < 1e-12 && (poses[4].tip() - down[2].hypot(down[0])).abs() < 1e-12
    );
    let wrong = grid.poses(&on, &[0.0; 5], |_| ()).unwrap_err();
    assert_eq!(wrong, EquilibriumError::Angles { given: 5, joints: 6 });
}

/// Upright, a mass that is too much for the first joint's spring falls over; hanging, it stays.
#[test]
fn poses_without_rest_are_left_out() {
    let design = chain(1, Shapes { x: 2, y: 2, torsion: 1 }, 900.0);
    let on = standing(&design, [0.0, -9.81, 0.0]).unwrap();
    let grid = PoseGrid::even([0, 1], [-FRAC_PI_2, 0.0], [FRAC_PI_2, 0.1], [1, 1]);
    let (poses, fallen) = grid.poses(&on, &[0.0; 2], |_| ()).unwrap();
    assert_eq!((poses.len(), fallen.len()), (2, 2));
    assert!(poses.iter().all(|p| p.motors[0] < 0.0) && fallen.iter().all(|(at, _)| at[0] > 0.0));
}
