//! Loads along a link stiffen it or make it buckle (LNK-4).

use nalgebra::DMatrix;
use trueup_flexibility::equilibrium::{EquilibriumError, equilibrium, modes};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::States;
use trueup_models::space::{PrescribedAccelerations, SpatialFreeFlyer};
use trueup_numerics::Dual;
use trueup_numerics::hybrid::{At, Hybrid};

use crate::beams::{LENGTHS, MASS, MODULUS, MOMENT, arm_of, chain};

const STIFFNESS: f64 = MODULUS * MOMENT;

/// A link alone, on a joint that is rigid, about z.
fn blade() -> RobotDesign {
    let mut design = chain(1, Shapes { x: 5, y: 5, torsion: 0 }, 1e-9);
    design.links.truncate(1);
    design.links[0].motor.flexible = false;
    design.links[0].mass = 1e-9;
    design.tips.clear();
    design.axial_stiffening = Some(true);
    design
}

/// Frequencies along x (in the plane of the spin) and along y of the blade, 1/s, where it turns at this rate.
fn spinning(design: &RobotDesign, rate: f64) -> [f64; 2] {
    let s = design.structure();
    let (model, p, at) = (SpatialFreeFlyer::new(s.clone()).unwrap(), design.parameters(), States::new(&s));
    let lift = |v: &[f64]| v.iter().map(|v| Dual { re: *v, eps: [0.0] }).collect::<Vec<Dual<1>>>();
    let mut x = vec![0.0; model.sizes().states];
    x[at.joint_velocity] = rate;
    let (mut x, u, p) = (lift(&x), lift(&vec![0.0; model.sizes().inputs]), lift(&p));
    let n = s.modes();
    let mut k = DMatrix::zeros(n, n);
    for c in 0..n {
        x[at.modal_coordinate + c].eps[0] = 1.0;
        let mut dx = vec![Dual { re: 0.0, eps: [0.0] }; x.len()];
        let still = [(0, Dual { re: 0.0, eps: [0.0] })];
        let led = PrescribedAccelerations { base: None, joints: &still, motors: &[] };
        model.rates_prescribed(
            At { t: Dual { re: 0.0, eps: [0.0] }, x: &x, u: &u, p: &p, modes: &[] },
            led,
            &mut dx,
        );
        x[at.modal_coordinate + c].eps[0] = 0.0;
        (0..n).for_each(|r| k[(r, c)] = -dx[at.modal_velocity + r].eps[0]);
    }
    let lowest = |from: usize| {
        let block = k.view((from, from), (n / 2, n / 2)).into_owned();
        block.complex_eigenvalues().iter().map(|e| e.re).fold(f64::INFINITY, f64::min).sqrt()
    };
    [lowest(0), lowest(n / 2)]
}

/// Checks LNK-4: frequencies of a uniform blade at the hub, out of the plane of its spin (Wright, Smith, Thresher, Wang 1982),
/// and in it, where the square of the rate is taken away (Southwell). In units of sqrt(E J / (rho A)) / L^2.
#[test]
fn lnk4_a_blade_that_spins_gets_stiffer() {
    let design = blade();
    let unit = (STIFFNESS / MASS).sqrt() / LENGTHS[0].powi(2);
    for (rate, wanted) in
        [(0.0, 3.5160), (1.0, 3.6816), (2.0, 4.1373), (3.0, 4.7973), (4.0, 5.5850), (6.0, 7.3604)]
    {
        let found = spinning(&design, rate * unit).map(|f| f / unit);
        let in_plane = f64::sqrt(wanted * wanted - rate * rate);
        println!("{rate}: {:.4} and {:.4}, Wright {wanted} and {in_plane:.4}", found[1], found[0]);
        assert!(
            (found[1] / wanted - 1.0).abs() < 1e-4 && (found[0] / in_plane - 1.0).abs() < 1e-4,
            "{found:?}"
        );
    }
    // Without, spin softens falsely in its plane.
    let soft = RobotDesign { axial_stiffening: Some(false), ..blade() };
    let [in_plane, across] = spinning(&soft, 2.0 * unit).map(|f| f / unit);
    assert!((across - 3.5160).abs() < 1e-3 && (in_plane - (3.516_f64.powi(2) - 4.0).sqrt()).abs() < 1e-3);
}

/// Checks LNK-4: under a force along it the link buckles at Euler's pi^2 E J / (4 L^2), and its frequency falls to 0 there.
#[test]
fn lnk4_a_column_buckles_at_euler_s_load() {
    let mut design = chain(1, Shapes { x: 4, y: 0, torsion: 0 }, 0.5);
    design.axial_stiffening = Some(true);
    design.links[0].motor.stiffness = 1e12;
    design.links[1].motor.stiffness = 1e8;
    let (arm, p) = arm_of(&design);
    let critical = STIFFNESS * (std::f64::consts::FRAC_PI_2 / LENGTHS[0]).powi(2);
    let first = |share: f64| {
        let rest = equilibrium(&arm, &p, &[0.0; 2], [-share * critical, 0.0, 0.0])?;
        Ok::<f64, EquilibriumError>(modes(&rest.mass, &rest.stiffness)?.0[0])
    };
    let free = first(0.0).unwrap();
    // The square falls nearly along a line.
    for share in [-1.0, 0.3, 0.6, 0.9] {
        let square = (first(share).unwrap() / free).powi(2);
        println!("{share} of Euler's load: square of the frequency {square:.4}");
        assert!((square - (1.0 - share)).abs() < 0.04);
    }
    assert!(first(0.9995).is_ok());
    assert_eq!(first(1.0005).unwrap_err(), EquilibriumError::Unstable);
}
