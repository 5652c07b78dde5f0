//! S3's tables on its arm.

use trueup_flexibility::elements::{FlexibleElement, contributions};
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::flexible_arm::presets::{RAISED, delian, parameters, structure};

const POSTURE: [f64; 6] = [0.0, RAISED, -RAISED, 0.0, 0.0, 0.0];

fn arm() -> (FlexibleArm, Vec<f64>) {
    let arm = FlexibleArm::new(structure(true)).unwrap();
    let p = parameters(&arm, &delian());
    arm.check(&p).unwrap();
    (arm, p)
}

/// Checks LNK-8 against S3 Table 4: deflections to what is printed.
#[test]
fn table_4_comes_out() {
    let (arm, p) = arm();
    let rest = equilibrium(&arm, &p, &POSTURE, [0.0; 3]).unwrap();
    let all = contributions(&arm, &p, &rest, [0.0; 3]).unwrap();
    for (element, printed) in [
        (FlexibleElement::Link(1), 0.49),
        (FlexibleElement::Link(2), 1.09),
        (FlexibleElement::Joint(2), 0.17),
        (FlexibleElement::Joint(3), 0.08),
        (FlexibleElement::Joint(5), 0.02),
    ] {
        let found = all.iter().find(|c| c.element == element).unwrap().deflection.abs().to_degrees();
        println!("{element}: {found:.4} deg, printed {printed}");
        assert!((found - printed).abs() < 0.005, "{element}: {found}");
    }
}

/// Checks LNK-9 against S3 Table 5: shares of the energy add up to 1, so rises of the square to 20 % at most; the paper's do not.
#[test]
fn table_5_cannot_be() {
    let (arm, p) = arm();
    let rest = equilibrium(&arm, &p, &POSTURE, [0.0; 3]).unwrap();
    let all = contributions(&arm, &p, &rest, [0.0; 3]).unwrap();
    let printed = [
        (FlexibleElement::Joint(2), 0.022),
        (FlexibleElement::Joint(3), 0.017),
        (FlexibleElement::Joint(5), 0.007),
        (FlexibleElement::Link(1), 0.079),
        (FlexibleElement::Link(2), 0.046),
    ];
    let square = |rise: f64| (1.0 + rise).powi(2) - 1.0;
    let of_paper: f64 = printed.iter().map(|(_, r)| square(*r)).sum();
    let of_model: f64 = all.iter().map(|c| square(c.rise)).sum();
    for c in &all {
        let paper = printed.iter().find(|p| p.0 == c.element).map(|p| p.1);
        println!("{}: {:.2} %, the paper {paper:?}; energy {:.3}", c.element, 100.0 * c.rise, c.energy);
    }
    println!(
        "first mode {:.3} Hz; squares add up to {:.1} %, the paper's to {:.1} %",
        rest.frequencies().unwrap()[0] / std::f64::consts::TAU,
        100.0 * of_model,
        100.0 * of_paper
    );
    assert!((all.iter().map(|c| c.energy).sum::<f64>() - 1.0).abs() < 1e-12);
    assert!((of_paper - 0.351).abs() < 0.001 && of_model <= 0.2 + 1e-3);
}
