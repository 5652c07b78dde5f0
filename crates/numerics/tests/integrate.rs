//! Orders of convergence, stability and tabulated stiff solutions.
#![allow(missing_docs, clippy::unwrap_used)]

use crate::common::{Prothero, Robertson, VanDerPol};
use trueup_numerics::driver::{DriverOptions, Solver, simulate};
use trueup_numerics::integrate::{Dopri5, Euler, Ode, Rk4, Rodas4, Ros2, StepFault, StepMethod, Tolerance};

/// x1' = -2 t x1^2, x2' = cos(t) x2: x1 = 1/(1 + t^2), x2 = exp(sin t).
struct Pair;

impl Ode for Pair {
    fn rates(&mut self, t: f64, x: &[f64], dx: &mut [f64]) {
        (dx[0], dx[1]) = (-2.0 * t * x[0] * x[0], t.cos() * x[1]);
    }
    fn jacobian(&mut self, t: f64, x: &[f64], dfdx: &mut [f64], dfdt: &mut [f64]) {
        dfdx.copy_from_slice(&[-4.0 * t * x[0], 0.0, 0.0, t.cos()]);
        dfdt.copy_from_slice(&[-2.0 * x[0] * x[0], -t.sin() * x[1]]);
    }
}

fn exact(t: f64) -> [f64; 2] {
    [1.0 / (1.0 + t * t), t.sin().exp()]
}
fn distance(x: &[f64], t: f64) -> f64 {
    x.iter().zip(exact(t)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A system with a stiff part that is not its Jacobian, in factors.
struct Partly {
    factor: f64,
}

impl Ode for Partly {
    fn rates(&mut self, t: f64, x: &[f64], dx: &mut [f64]) {
        Pair.rates(t, x, dx);
    }
    fn jacobian(&mut self, _t: f64, _x: &[f64], _dfdx: &mut [f64], _dfdt: &mut [f64]) {
        panic!("it has a stiff part");
    }
    fn factor_stiff(&mut self, t: f64, x: &[f64], g: f64, dx: &mut [f64]) -> Option<Result<(), StepFault>> {
        self.rates(t, x, dx);
        self.factor = 1.0 + 3.0 * g;
        Some(Ok(()))
    }
    fn solve_stiff(&self, y: &mut [f64]) {
        y.iter_mut().for_each(|y| *y /= self.factor);
    }
}

#[test]
fn ros2_keeps_its_order_whatever_the_stiff_part_is() {
    let errors = [128, 256, 512].map(|steps| {
        let (mut method, mut x, h) = (Ros2::new(2), exact(0.0), 2.0 / f64::from(steps));
        for k in 0..steps {
            method.attempt(&mut Partly { factor: 0.0 }, f64::from(k) * h, &x, h, TOL).unwrap();
            x.copy_from_slice(method.end());
            method.accept();
        }
        distance(&x, 2.0)
    });
    for pair in errors.windows(2) {
        assert!((3.6..4.4).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

const TOL: Tolerance = Tolerance { relative: 1.0, nominal: &[1.0, 1.0] };

/// Error at t = 2 after `steps` equal steps.
fn global(method: &mut dyn StepMethod, steps: usize) -> f64 {
    let (mut x, h) = (exact(0.0), 2.0 / steps as f64);
    for k in 0..steps {
        method.attempt(&mut Pair, k as f64 * h, &x, h, TOL).unwrap();
        x.copy_from_slice(method.end());
        method.accept();
    }
    distance(&x, 2.0)
}

/// Of one step from the exact solution at t = 0.3: largest error within it, and the estimate.
fn local(method: &mut dyn StepMethod, h: f64) -> (f64, f64) {
    let (t, x) = (0.3, exact(0.3));
    method.restart();
    let estimate = method.attempt(&mut Pair, t, &x, h, TOL).unwrap();
    method.prepare_dense(&mut Pair, t, &x, h);
    let mut y = [0.0; 2];
    let error = (0..=20).map(|k| {
        let s = f64::from(k) / 20.0;
        method.dense(s, &mut y);
        distance(&y, t + s * h)
    });
    (error.fold(0.0, f64::max), estimate)
}

#[test]
fn orders_are_what_the_tableaus_promise() {
    // Method, steps, global order, order of the largest error within a step.
    let methods: [(Box<dyn StepMethod>, usize, f64, f64); 5] = [
        (Box::new(Dopri5::new(2)), 128, 5.0, 5.0),
        (Box::new(Rodas4::new(2)), 128, 4.0, 4.0),
        (Box::new(Rk4::new(2)), 128, 4.0, 4.0),
        (Box::new(Ros2::new(2)), 512, 2.0, 3.0),
        (Box::new(Euler::new(2)), 2048, 1.0, 2.0),
    ];
    for (k, (mut method, steps, order, within)) in methods.into_iter().enumerate() {
        let m = method.as_mut();
        m.restart();
        let coarse = global(m, steps);
        m.restart();
        let slope = (coarse / global(m, 2 * steps)).log2();
        println!("method {k}: error {coarse:e}, order {slope}");
        assert!((slope - order).abs() < 0.15, "method {k}: global order {slope}");
        let (a, b) = (local(m, 0.02), local(m, 0.01));
        let slope = (a.0 / b.0).log2();
        println!("method {k}: within a step {slope}");
        assert!((slope - within).abs() < 0.25, "method {k}: dense order {slope}");
        if m.error_order() > 0 {
            let slope = (a.1 / b.1).log2();
            assert!((slope - f64::from(m.error_order())).abs() < 0.25, "method {k}: estimate {slope}");
        }
    }
}

/// x' = -1e12 x.
struct Decay;
impl Ode for Decay {
    fn rates(&mut self, _t: f64, x: &[f64], dx: &mut [f64]) {
        dx[0] = -1e12 * x[0];
    }
    fn jacobian(&mut self, _t: f64, _x: &[f64], dfdx: &mut [f64], dfdt: &mut [f64]) {
        (dfdx[0], dfdt[0]) = (-1e12, 0.0);
    }
}

#[test]
fn stiff_methods_are_l_stable() {
    for method in [&mut Rodas4::new(1) as &mut dyn StepMethod, &mut Ros2::new(1)] {
        method.attempt(&mut Decay, 0.0, &[1.0], 1.0, TOL).unwrap();
        assert!(method.end()[0].abs() < 1e-9, "{}", method.end()[0]);
    }
}

fn stiff(tolerance: f64) -> DriverOptions {
    DriverOptions { solver: Solver::Stiff, tolerance, ..DriverOptions::default() }
}

#[test]
fn van_der_pol_equals_the_tabulated_solution() {
    // Hairer and Wanner, Solving Ordinary Differential Equations II, IV.10; eps = 1e-6.
    let table = [
        (1.0, -1.863_646_254_808_13, 0.753_543_086_543_546),
        (2.0, 0.1706167732170483e1, -0.8928097010247975e0),
    ];
    let run = simulate(&VanDerPol, &[], &[], stiff(1e-9), &|_, _| {}, &[0.0, 1.0, 2.0]).unwrap();
    for ((t, a, b), x) in table.iter().zip(&run.x[1..]) {
        let error = (x[0] - a).abs().max((x[1] - b).abs());
        assert!(error < 1e-7, "t = {t}: error {error:e}");
    }
}

#[test]
fn robertson_equals_the_tabulated_solution() {
    // Mazzia and Magherini, Test Set for IVP Solvers, ROBER, t = 1e11.
    let table = [0.2083340149701255e-7, 0.8333360770334713e-13, 0.999_999_979_166_505];
    let nominal = [1e-4, 1e-8, 1.0];
    let run = simulate(&Robertson, &[], &nominal, stiff(1e-8), &|_, _| {}, &[0.0, 1e11]).unwrap();
    for (x, exact) in run.x[1].iter().zip(table) {
        assert!((x / exact - 1.0).abs() < 1e-5, "{x:e} instead of {exact:e}");
    }
    assert!(run.accepted < 5_000, "{} steps", run.accepted);
}

#[test]
fn stiffness_does_not_hold_the_stiff_solver_back() {
    let run = simulate(&Prothero, &[], &[], stiff(1e-6), &|_, _| {}, &[0.0, 10.0]).unwrap();
    assert!((run.x[1][0] - 10f64.sin()).abs() < 1e-6 && run.accepted < 300, "{} steps", run.accepted);
}
