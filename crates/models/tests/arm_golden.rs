//! Golden facts A01-A22 on the free-floating arm. Kinds: P arithmetic of the paper, F physics, R reference value.
#![allow(clippy::unwrap_used)]

use crate::arm_common::{NO_EFFECTS, Random, Run};
use trueup_models::arm::chain::Chain;
use trueup_models::arm::solve::Symmetric;
use trueup_models::arm::{PlanarManipulator, kinematics, output, parameter, rotor};
use trueup_numerics::hybrid::Hybrid;
use trueup_numerics::{Dual, Scalar};

/// A01, R: upper triangle of M at q = (0, 0, 0, 7.5, -15, -22.5 deg).
pub(crate) const A01: [f64; 21] = [
    68.96,
    0.0,
    0.1994470643199815,
    0.1891770643199815,
    0.6715988794447929,
    0.3489446568505761,
    68.96,
    10.210047088192507,
    6.749057088192507,
    3.0481015833715324,
    0.6081018746948852,
    14.17975062526562,
    8.318765309480424,
    4.134718238972571,
    0.904120565243533,
    6.044143893695229,
    3.10683640649692,
    0.6988412888145061,
    1.789307236598612,
    0.448589764199306,
    0.1574375568,
];
/// A02, R: C v there at v = (.1, -.2, .3, .4, -.5, .6).
const A02: [f64; 6] = [
    -2.6117424855140694,
    0.0007683598769797628,
    -0.036002889188715075,
    -0.03365008398174314,
    -0.18230386643384636,
    -0.1088940771259154,
];
/// A06, F: end-effector at the start, m.
const A06: [f64; 2] = [1.4957853606868576, -0.156];
/// A12, R: x_0, y_0, q_0 .. q_3 after the forced run of 10 s.
const A12: [f64; 6] = [
    0.16034769794456588,
    0.007215224481631735,
    -1.3300839527326167,
    4.17135700138761,
    -2.316175878342558,
    1.3745372411550394,
];
/// A13, R: base pose at the end of the rigid reference trajectory; A14, R: tau_1 at its begin and end.
const A13: [f64; 3] = [0.017366523188224965, -0.009182827014584753, -0.2572613502943539];
const A14: [f64; 2] = [0.008809219089267496, 0.015330865928925925];
/// A15, R: inertia about joint 1, base fixed and free.
const A15: [f64; 2] = [6.044143893695229, 1.15437994509415];
/// S0 table 2: I_m, k, b of tests 1 to 5.
const TABLE_2: [[f64; 3]; 5] =
    [[6.9, 12.8, 1.3], [3.3, 5.1, 0.4], [5.6, 9.2, 0.5], [7.6, 5.1, 0.0], [4.5, 8.3, 0.1]];
/// A16, R: the frequencies that they imply, Hz.
const A16: [f64; 5] = [0.3500808703, 0.2523690214, 0.3083666998, 0.2171316865, 0.3048130986];

const RIGID: &[bool] = &[false; 3];
const START: [f64; 6] = [0.0, 0.0, 0.0, 7.5, -15.0, -22.5];

fn start() -> [f64; 6] {
    START.map(f64::to_radians)
}
fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b} within {tolerance}: {:e}", a - b);
}
fn rigid() -> (PlanarManipulator, Vec<f64>) {
    let model = PlanarManipulator::new(RIGID, NO_EFFECTS).unwrap();
    let p = model.defaults();
    (model, p)
}
fn state(q: &[f64], v: &[f64]) -> Vec<f64> {
    [q, v].concat()
}
fn bias(p: &[f64], q: &[f64], v: &[f64]) -> [f64; 6] {
    let mut out = [0.0; 6];
    Chain::new(3, p).turned(q, v).bias(&mut out);
    out
}

/// Checks ARM-1, ARM-2, ARM-3 and ARM-4.
#[test]
fn a01_a02_mass_matrix_and_bias() {
    let (model, p) = rigid();
    let v = [0.1, -0.2, 0.3, 0.4, -0.5, 0.6];
    let m = model.mass_matrix(&state(&start(), &v), &p);
    let mut want = A01.iter();
    for i in 0..6 {
        (i..6).for_each(|j| near(m.at(i, j), *want.next().unwrap(), 1e-9));
    }
    let b = bias(&p, &start(), &v);
    (0..6).for_each(|i| near(b[i], A02[i], 1e-9));
}

#[test]
fn a03_a05_mass_rate_less_twice_c_is_skew_and_m_positive_definite() {
    let (model, p) = rigid();
    let mut random = Random(1);
    for _ in 0..100 {
        let (q, v) = (random.vector(6, 3.0), random.vector(6, 2.0));
        // The rate of M along the motion by a dual number, not by the chain's own formulas.
        let dual = |i: usize| Dual::<1>::new(q[i], [v[i]]);
        let x: Vec<_> = (0..6).map(dual).chain(v.iter().map(|v| Dual::constant(*v))).collect();
        let pd: Vec<_> = p.iter().map(|p| Dual::constant(*p)).collect();
        let m = model.mass_matrix(&x, &pd);
        let c = Chain::new(3, &p).turned(&q, &v).coriolis();
        let skew = |i: usize, j: usize| m.at(i, j).eps[0] - 2.0 * c[i][j];
        let b = bias(&p, &q, &v);
        for i in 0..6 {
            (0..6).for_each(|j| near(skew(i, j) + skew(j, i), 0.0, 1e-11));
            near((0..6).map(|j| c[i][j] * v[j]).sum(), b[i], 1e-12);
        }
        let rows: Vec<usize> = (0..6).collect();
        assert!(model.mass_matrix(&state(&q, &v), &p).solve(&rows, &mut [0.0; 6]).is_ok());
        // x' M x > 0 as well, without the factors.
        let w = random.vector(6, 1.0);
        let mf = model.mass_matrix(&state(&q, &v), &p);
        assert!((0..6).map(|i| w[i] * mf.row_times(i, &w)).sum::<f64>() > 0.0);
    }
}

/// Checks ARM-10.
#[test]
fn a06_end_effector() {
    let (_, p) = rigid();
    let t = Chain::new(3, &p).turned(&start(), &[0.0; 6]);
    let tip = kinematics::tip(&t, &start(), &[0.0; 6]);
    (0..2).for_each(|i| near(tip.position[i], A06[i], 1e-12));
    near(tip.attitude, -30f64.to_radians(), 1e-15);
}

/// Checks ARM-5.
#[test]
fn a07_a09_rotors_of_the_paper() {
    let mut j = Symmetric::zero();
    for (i, inertia) in [2.0, 3.0, 5.0].into_iter().enumerate() {
        rotor::add_inertia(&mut j, i, 6 + i, inertia, rotor::share(rotor::PAPER, 100.0));
    }
    let a = [[10.0, 8.0, 5.0], [8.0, 8.0, 5.0], [5.0, 5.0, 5.0]];
    let b = [[2.0, 3.0, 5.0], [0.0, 3.0, 5.0], [0.0, 0.0, 5.0]];
    let c = [2.0, 3.0, 5.0];
    for i in 0..3 {
        for k in 0..3 {
            near(j.at(2 + i, 2 + k), a[i][k], 1e-12);
            near(j.at(2 + i, 6 + k), b[i][k], 1e-12);
            near(j.at(6 + i, 6 + k), if i == k { c[i] } else { 0.0 }, 1e-12);
        }
    }
    (0..9).for_each(|k| assert_eq!(j.at(5, k), 0.0)); // row q_n
}

/// All joints flexible: I_m .3, .2, .1; k 5.47, 6, 4; b .5, .2, .1; q_1 stretched by 0.05 rad.
fn forced() -> (PlanarManipulator, Vec<f64>) {
    let model = PlanarManipulator::new(&[true; 3], NO_EFFECTS).unwrap();
    let mut p = model.defaults();
    let mut set = |begin: usize, values: [f64; 3]| p[begin..begin + 3].copy_from_slice(&values);
    set(parameter::motor_inertia(3), [0.3, 0.2, 0.1]);
    set(parameter::joint_stiffness(3), [5.47, 6.0, 4.0]);
    set(parameter::joint_damping(3), [0.5, 0.2, 0.1]);
    let angles = [7.5f64, -15.0, -22.5].map(f64::to_radians);
    set(parameter::initial_motor_angle(3), angles);
    set(parameter::initial_joint_angle(3), [angles[0] + 0.05, angles[1], angles[2]]);
    (model, p)
}
fn forced_torque(t: f64) -> Vec<f64> {
    let mut u = vec![0.0; 9];
    (u[0], u[1], u[2]) = (0.3 * t.sin(), -0.2 * (2.0 * t).cos(), 0.1 * (3.0 * t).sin());
    u
}

/// Checks ARM-7, ARM-12 and ARM-13.
#[test]
fn a10_a12_forced_run() {
    let (model, p) = forced();
    let mut run = Run::new(&model, &p, forced_torque).with_power(|at, m| {
        let v = &at.x[m.dofs()..];
        (0..3)
            .map(|j| {
                let (damping, slip) = (at.p[parameter::joint_damping(3) + j], v[6 + j] - v[3 + j]);
                at.u[j] * v[6 + j] - damping * slip * slip
            })
            .sum()
    });
    let y0 = run.outputs();
    let energy = |y: &[f64]| y[output::kinetic_energy(3)] + y[output::potential_energy(3)];
    let (mut drift, mut lost) = (0.0f64, 0.0f64);
    for k in 1..=100 {
        run.to(f64::from(k) * 0.1, 0.05);
        let y = run.outputs();
        for i in [output::linear_momentum(3), output::linear_momentum(3) + 1, output::angular_momentum(3)] {
            drift = drift.max(y[i].abs());
        }
        lost = lost.max((energy(&y) - energy(&y0) - run.work).abs());
    }
    println!("A10 momentum drift {drift:e}; A11 energy {lost:e} J");
    near(drift, 0.0, 1e-10);
    near(lost, 0.0, 1e-9);
    let worst = (0..6).map(|i| (run.x[i] - A12[i]).abs()).fold(0.0, f64::max);
    println!("A12 largest deviation {worst:e}");
    near(worst, 0.0, 1e-7);
}

/// Accelerations of the base that keep a rigid arm's momenta, and the torque of joint 1.
fn inverse(
    model: &PlanarManipulator,
    p: &[f64],
    q: &[f64],
    v: &[f64],
    acceleration: [f64; 3],
) -> ([f64; 3], f64) {
    let m = model.mass_matrix(&state(q, v), p);
    let b = bias(p, q, v);
    let mut a = [0.0, 0.0, 0.0, acceleration[0], acceleration[1], acceleration[2]];
    let arm = a;
    (0..3).for_each(|i| a[i] = -b[i] - m.row_times(i, &arm));
    m.solve(&[0, 1, 2], &mut a).unwrap();
    ([a[0], a[1], a[2]], m.row_times(3, &a) + b[3])
}

#[test]
fn a13_a14_rigid_reference_trajectory() {
    let (model, p) = rigid();
    let acceleration = [0.9f64, -0.6, -0.75].map(f64::to_radians);
    // Base pose and velocity z, joints prescribed.
    let both = |t: f64, z: &[f64; 6]| {
        let (mut q, mut v) = (start(), [0.0; 6]);
        for i in 0..3 {
            (q[i], v[i]) = (z[i], z[3 + i]);
            q[3 + i] += 0.5 * acceleration[i] * t * t;
            v[3 + i] = acceleration[i] * t;
        }
        inverse(&model, &p, &q, &v, acceleration)
    };
    let slope = |t: f64, z: &[f64; 6]| {
        let a = both(t, z).0;
        [z[3], z[4], z[5], a[0], a[1], a[2]]
    };
    let (mut z, steps) = ([0.0; 6], 2000);
    let h = 10.0 / f64::from(steps);
    let moved = |z: &[f64; 6], d: &[f64; 6], h: f64| -> [f64; 6] { std::array::from_fn(|i| z[i] + h * d[i]) };
    near(both(0.0, &z).1, A14[0], 1e-8);
    for k in 0..steps {
        let t = h * f64::from(k);
        let k1 = slope(t, &z);
        let k2 = slope(t + 0.5 * h, &moved(&z, &k1, 0.5 * h));
        let k3 = slope(t + 0.5 * h, &moved(&z, &k2, 0.5 * h));
        let k4 = slope(t + h, &moved(&z, &k3, h));
        z = std::array::from_fn(|i| z[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    (0..3).for_each(|i| near(z[i], A13[i], 1e-8));
    near(both(10.0, &z).1, A14[1], 1e-8);
}

/// Inertia that the row of joint 1 sees with these rows free to follow.
fn seen(m: &Symmetric<f64>, follow: &[usize]) -> f64 {
    let mut a: Vec<f64> = (0..6).map(|i| -m.at(i, 3)).collect();
    m.solve(follow, &mut a).unwrap();
    m.at(3, 3) + follow.iter().map(|i| m.at(3, *i) * a[*i]).sum::<f64>()
}

#[test]
fn a15_inertia_about_joint_1() {
    let (model, p) = rigid();
    let m = model.mass_matrix(&state(&start(), &[0.0; 6]), &p);
    near(seen(&m, &[]), A15[0], 1e-9);
    near(seen(&m, &[0, 1, 2]), A15[1], 1e-9);
}

#[test]
fn a16_frequencies_with_the_motor_locked() {
    let model = PlanarManipulator::new(&[true, false, false], NO_EFFECTS).unwrap();
    for ([inertia, k, _], want) in TABLE_2.iter().zip(A16) {
        let mut p = model.defaults();
        p[parameter::motor_inertia(3)] = *inertia;
        // Locked against the satellite, the rotor turns with it: its rows are those of q_0 in J*.
        let mut x = vec![0.0; model.sizes().states];
        x[..6].copy_from_slice(&start());
        let m = model.mass_matrix(&x, &p);
        near((k / seen(&m, &[0, 1, 2])).sqrt() / std::f64::consts::TAU, want, 1e-8);
    }
}

#[test]
fn a17_a18_table_2_averages() {
    for (i, (mean, deviation)) in [(5.58, 1.7456), (8.10, 3.2148), (0.46, 0.5128)].into_iter().enumerate() {
        let average = TABLE_2.iter().map(|r| r[i]).sum::<f64>() / 5.0;
        near(average, mean, 1e-9);
        let square: f64 = TABLE_2.iter().map(|r| (r[i] - average).powi(2)).sum();
        near((square / 4.0).sqrt(), deviation, 1e-3);
    }
}

/// Checks ARM-11.
#[test]
fn a19_joint_angle_from_the_tip() {
    let (_, p) = rigid();
    let mut random = Random(2);
    let (mut worst, mut mismatch) = (0.0f64, 0.0f64);
    for _ in 0..300 {
        let q = random.vector(6, 2.5);
        let tip = kinematics::tip(&Chain::new(3, &p).turned(&q, &[0.0; 6]), &q, &[0.0; 6]);
        for joint in 1..=3 {
            let mut unknown = q.clone();
            unknown[2 + joint] = f64::NAN;
            let s = kinematics::joint_angle(&p, &unknown, tip.position, joint);
            worst = worst.max((s.angle - q[2 + joint]).abs());
            mismatch = mismatch.max(s.mismatch.abs());
        }
    }
    println!("A19 angle {worst:e} rad, mismatch {mismatch:e} m");
    near(worst, 0.0, 1e-12);
    near(mismatch, 0.0, 1e-12);
}

/// Checks ARM-5 and ARM-6.
#[test]
fn a20_a21_paper_and_geared_coupling() {
    let j = |coupling| {
        let mut j = Symmetric::zero();
        rotor::add_inertia(&mut j, 0, 6, 5.6, rotor::share(coupling, 100.0));
        j
    };
    let (paper, geared) = (j(rotor::PAPER), j(rotor::GEARED));
    near(paper.at(2, 6) / geared.at(2, 6), 100.0, 1e-9);
    near(paper.at(6, 6) - geared.at(6, 6), 0.0, 1e-12);
    near(paper.at(2, 2) / geared.at(2, 2), 1e4, 1e-7);
}

#[test]
fn a22_rigid_limit() {
    let model = PlanarManipulator::new(&[true, false, false], NO_EFFECTS).unwrap();
    let deflection = |k: f64| {
        let mut p = model.defaults();
        p[parameter::joint_stiffness(3)] = k;
        p[parameter::joint_damping(3)] = 0.02 * k;
        p[parameter::motor_inertia(3)] = 0.1;
        let mut run = Run::new(&model, &p, |_| vec![0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        run.to(2.0, 0.01);
        run.x[6] - run.x[3]
    };
    near(deflection(500.0) / deflection(1000.0), 2.0, 0.02);
}

#[test]
fn start_values_are_the_test_beds() {
    let (model, p) = rigid();
    assert!(model.check(&p).is_ok());
    assert_eq!(p.len(), model.sizes().parameters);
    near(Chain::new(3, &p).mass.value(), 68.96, 1e-12);
}
