//! One beam on a held base: statics, spin, and derivatives by its parameters.

use super::flexible_properties::beam;
use rand::SeedableRng;
use rand::rngs::StdRng;
use trueup_models::space::appendage::{Beam, Shapes};
use trueup_models::space::articulated::{SweepResult, accelerations};
use trueup_models::space::bent::DeformedAppendages;
use trueup_models::space::flexible::Appendages;
use trueup_models::space::snapshot::RobotSnapshot;
use trueup_models::space::spatial::{Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use trueup_models::space::tree::{PlacedBody, Tree};
use trueup_models::space::vector::{Vector3, identity};
use trueup_numerics::{Dual, Scalar};

fn plain<T: Scalar>(origin: Vector3<T>) -> SpatialFrame<T> {
    SpatialFrame { rotation: identity(), origin }
}

/// Accelerations of the modes of a beam on a base that moves so.
fn modal<T: Scalar>(
    (shapes, beam): (Shapes, &Beam<T>),
    velocity: SpatialMotion<T>,
    held: Option<SpatialMotion<T>>,
    (eta, rates): (&[T], &[T]),
) -> Vec<T> {
    let mut all = Appendages::<T>::new();
    all.add_beam(0, shapes, beam).unwrap();
    let placed = [PlacedBody::base(plain([T::zero(); 3]), velocity)];
    let mut bent = DeformedAppendages::new();
    all.bend(&placed, eta, rates, &mut bent);
    let one = T::one();
    let inertia = identity::<T>();
    let now = RobotSnapshot {
        tree: &Tree::default(),
        base: &Rigid { mass: one, first: [T::zero(); 3], inertia },
        bodies: &[],
        placed: &placed,
        drives: &[],
        flexing: bent.of(&all),
    };
    let mut out = vec![T::zero(); shapes.modes()];
    let found = SweepResult { joint: &mut [], rotor: &mut [], modal: &mut out };
    accelerations(&now, &[SpatialWrench::zero()], held, found);
    out
}

/// Checks SFF-5: a beam in a field hangs by mass g L^4 / (8 E I), one that is turned faster and faster about its axis twists
/// by rho I_p alpha L^2 / (2 G J); the shapes' sum comes to that.
#[test]
fn sff_5_statics_of_a_beam() {
    let b = Beam { frame: plain([0.3, -0.2, 0.4]), ..beam(&mut StdRng::seed_from_u64(60)) };
    let shapes = Shapes { x: 12, y: 12, torsion: 12 };
    let (lifted, turned) = (9.81, 3.0);
    let held = SpatialMotion { angular: [0.0, 0.0, turned], linear: [lifted, -0.5 * lifted, 0.0] };
    let none = [0.0; 36];
    let free = modal((shapes, &b), SpatialMotion::zero(), Some(held), (&none, &none));
    let mut all = Appendages::<f64>::new();
    all.add_beam(0, shapes, &b).unwrap();
    let eta: Vec<f64> = all.modes().iter().zip(free).map(|(m, a)| a * m.mass / m.stiffness).collect();
    let tip = b.tip(shapes, &eta);
    // Both series alternate: off by less than the first term that is left out, that of the root 12.5 pi.
    let root = 12.5 * std::f64::consts::PI;
    // The root is off the origin: turning lifts it too.
    let lift = [lifted + turned * 0.2, -0.5 * lifted + turned * 0.3];
    for k in 0..2 {
        let wanted = -b.mass_per_length * lift[k] * b.length.powi(4) / (8.0 * b.bending_stiffness[k]);
        let off = (tip[k] - b.frame.origin[k]) / wanted - 1.0;
        println!("deflection off by {off:.1e}, first term left out {:.1e}", 32.0 / root.powi(5));
        assert!(off.abs() < 32.0 / root.powi(5), "{off:e}");
    }
    let twist: f64 = eta[24..].iter().sum();
    let wanted = -b.polar_inertia_per_length * turned * b.length.powi(2) / (2.0 * b.torsion_stiffness);
    let off = twist / wanted - 1.0;
    println!("twist off by {off:.1e}, first term left out {:.1e}", 4.0 / root.powi(3));
    assert!(off.abs() < 4.0 / root.powi(3), "{off:e}");
}

/// Checks SFF-5, and what it gets wrong: spin softens bending in its plane by its square, and nothing stiffens it.
#[test]
fn sff_5_spin_softens_and_nothing_stiffens() {
    let b = Beam { frame: plain([0.0; 3]), damping_ratio: 0.0, ..beam(&mut StdRng::seed_from_u64(61)) };
    let shapes = Shapes { x: 1, y: 1, torsion: 0 };
    let lift = Dual::<1>::constant;
    let of = Beam {
        frame: plain([lift(0.0); 3]),
        length: lift(b.length),
        mass_per_length: lift(b.mass_per_length),
        bending_stiffness: b.bending_stiffness.map(lift),
        torsion_stiffness: lift(b.torsion_stiffness),
        polar_inertia_per_length: lift(b.polar_inertia_per_length),
        damping_ratio: lift(0.0),
    };
    let spin = 0.7;
    let velocity = SpatialMotion { angular: [lift(spin), lift(0.0), lift(0.0)], linear: [lift(0.0); 3] };
    let by = |k: usize| {
        let mut eta = [lift(0.01), lift(0.02)];
        eta[k].eps[0] = 1.0;
        modal((shapes, &of), velocity, Some(SpatialMotion::zero()), (&eta, &[lift(0.0); 2]))
    };
    let by = [by(0), by(1)];
    let mut all = Appendages::<f64>::new();
    all.add_beam(0, shapes, &b).unwrap();
    let square = |j: usize| all.modes()[j].stiffness / all.modes()[j].mass;
    assert!((all.lowest_frequency().unwrap().powi(2) / square(0).min(square(1)) - 1.0).abs() < 1e-14);
    let wanted = [-square(0), -(square(1) - spin * spin)];
    for j in 0..2 {
        let own = by[j][j].eps[0];
        assert!((own / wanted[j] - 1.0).abs() < 1e-12, "{j}: {own}, not {}", wanted[j]);
        assert!(by[1 - j][j].eps[0].abs() < 1e-12);
    }
}

/// Checks SFF-5: derivatives by a beam's parameters, by dual numbers and by differences.
#[test]
fn sff_5_parameters_have_exact_derivatives() {
    let b = beam(&mut StdRng::seed_from_u64(62));
    let shapes = Shapes { x: 2, y: 2, torsion: 1 };
    let values = [
        b.length,
        b.mass_per_length,
        b.bending_stiffness[0],
        b.bending_stiffness[1],
        b.torsion_stiffness,
        b.polar_inertia_per_length,
        b.damping_ratio,
        b.frame.origin[1],
    ];
    fn run<T: Scalar>(v: &[T; 8], frame: &SpatialFrame<f64>, shapes: Shapes) -> Vec<T> {
        let c = T::constant;
        let [x, _, z] = frame.origin.map(c);
        let beam = Beam {
            frame: SpatialFrame { rotation: frame.rotation.map(|r| r.map(c)), origin: [x, v[7], z] },
            length: v[0],
            mass_per_length: v[1],
            bending_stiffness: [v[2], v[3]],
            torsion_stiffness: v[4],
            polar_inertia_per_length: v[5],
            damping_ratio: v[6],
        };
        let velocity = SpatialMotion { angular: [0.3, -0.5, 0.7].map(c), linear: [0.2, 0.1, -0.4].map(c) };
        let (eta, rates) = ([0.1, -0.05, 0.2, 0.03, 0.3].map(c), [0.4, 0.2, -0.3, 0.1, -0.2].map(c));
        modal((shapes, &beam), velocity, None, (&eta, &rates))
    }
    let mut worst: f64 = 0.0;
    for k in 0..8 {
        let mut duals = values.map(Dual::<1>::constant);
        duals[k].eps[0] = 1.0;
        let exact = run(&duals, &b.frame, shapes);
        let moved = |h: f64| {
            let mut v = values;
            v[k] += h;
            run(&v, &b.frame, shapes)
        };
        let h = 1e-5 * values[k].abs();
        let (up, down) = (moved(h), moved(-h));
        let size = exact.iter().fold(1.0_f64, |m, e| m.max(e.eps[0].abs()));
        for j in 0..shapes.modes() {
            worst = worst.max(((up[j] - down[j]) / (2.0 * h) - exact[j].eps[0]).abs() / size);
        }
    }
    println!("derivatives by differences off by {worst:.1e}");
    assert!(worst < 1e-7, "{worst:e}");
}
