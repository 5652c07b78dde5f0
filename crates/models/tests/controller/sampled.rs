//! The sampled law: against an independent discretisation, against the continuous one, and its timing.

use super::chain::{
    CONTROLLER_STATES, RUNNING, arranged, measured, parameters, plant_rates, response, with_adaptation,
};
use nalgebra::{DMatrix, Matrix2, Vector2};
use trueup_models::controller::{
    JointController, ManipulatorController, Strategy, adaptation, output, parameter, state,
};
use trueup_numerics::{
    Dual, Scalar,
    hybrid::{At, Hybrid},
};

/// A controller with its values.
struct Run<M: Hybrid> {
    model: M,
    p: Vec<f64>,
    x: Vec<f64>,
    modes: Vec<i32>,
}

impl<M: Hybrid> Run<M> {
    fn new(model: M, p: &[f64], t: f64, u: &[f64]) -> Self {
        let sizes = model.sizes();
        let (mut x, mut modes) = (vec![0.0; sizes.states], vec![0; sizes.modes]);
        model.start(p, &mut x);
        model.start_modes(At { t, x: &x, u, p, modes: &[] }, &mut modes);
        Self { model, p: p.to_vec(), x, modes }
    }
    fn update(&mut self, t: f64, u: &[f64]) {
        for pass in 0.. {
            assert!(pass < 5, "the event iteration does not settle");
            if self.model.update(t, &mut self.x, u, &self.p, &mut self.modes).settled() {
                break;
            }
        }
    }
    fn output(&self, t: f64, u: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.model.sizes().outputs];
        self.model.outputs(At { t, x: &self.x, u, p: &self.p, modes: &self.modes }, &mut y);
        y
    }
}

/// Repeatable noise in -1..1.
pub(crate) fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// One G with its input held, by the matrix exponential.
struct Held {
    a: Matrix2<f64>,
    b: Vector2<f64>,
    x: Vector2<f64>,
}

impl Held {
    fn new(omega: f64, h: f64, value: f64) -> Self {
        let w2 = omega * omega;
        let whole = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, -w2, -omega, w2, 0.0, 0.0, 0.0]) * h;
        let e = whole.exp();
        Self {
            a: Matrix2::new(e[(0, 0)], e[(0, 1)], e[(1, 0)], e[(1, 1)]),
            b: Vector2::new(e[(0, 2)], e[(1, 2)]),
            x: Vector2::new(value, 0.0),
        }
    }
    fn advance(&mut self, u: f64) {
        self.x = self.a * self.x + self.b * u;
    }
}

#[test]
fn equals_an_independent_discretisation() {
    let (h, n, kt, limit) = (2e-3, 7.0, 0.5, 12.0);
    for strategy in Strategy::ALL {
        let (kp, kv, ti, omega, wash) = (2.5, 30.0, 0.1, 20.0, 1.3);
        let p = with_adaptation([kp, kv, ti, n, kt, limit, omega, wash, h, f64::from(strategy as u8)]);
        let mut seed = 7;
        let mut inputs = || [1.0, 0.3, n, n, 1.0, 1.0].map(|scale| scale * noise(&mut seed));
        let mut u = inputs();
        let mut run = Run::new(JointController, &p, 0.0, &u);
        let motion = |u: &[f64; 6]| match strategy {
            Strategy::PPi | Strategy::Wbc | Strategy::WbcAdaptive => (u[2] / n, u[4]),
            _ => (u[3] / n, u[5]),
        };
        let (theta0, _) = motion(&u);
        let (mut b0, mut ga0) = (Held::new(omega, h, theta0 / 2.0), Held::new(omega, h, theta0 / 2.0));
        let (mut low_p, mut low_b, mut integral, mut limited) = (0.0, 0.0, 0.0, 0);
        for k in 0..500 {
            let t = f64::from(k) * h;
            let before = run.output(t, &u)[0];
            run.update(t, &u);
            let ([r, ff, qm, wm, ql, _], b) = (u, b0.x[0]);
            let v = match strategy {
                Strategy::PPi => kp * (r - ql),
                Strategy::Wbc | Strategy::WbcAdaptive => kp * (r / 2.0 + b - qm / n),
                Strategy::Vwbc | Strategy::VwbcAdaptive => kp * (r - ql) / 2.0 + b,
                Strategy::VwbcWashout => kp * (r - ql) / 2.0 + low_p / 2.0 + b - low_b,
            };
            let torque = kv * (v + ff - wm / n) + integral;
            let want = (torque / (n * kt)).clamp(-limit, limit);
            limited += i32::from(want.abs() == limit);
            let got = run.output(t + 0.7 * h, &[9.0; 6])[0];
            assert!((got - want).abs() <= 1e-11 * limit, "{strategy:?}, sample {k}: {got} against {want}");
            assert_eq!(before.to_bits(), got.to_bits(), "due and not committed, sample {k}");

            let (theta0, theta1) = motion(&u);
            let (into_b0, into_ga0) = (theta1 - ga0.x[0], theta0 - b0.x[0]);
            b0.advance(into_b0);
            ga0.advance(into_ga0);
            let lag = |y: f64, u: f64, time: f64| u + (y - u) * (-h / time).exp();
            low_p = lag(low_p, kp * (r - ql), 1.0 / wash);
            low_b = lag(low_b, b, 1.0 / wash);
            integral = lag(integral, want * n * kt, ti);
            u = inputs();
        }
        assert!((5..495).contains(&limited), "both at the limit and away from it: {limited}");
    }
}

/// The plant driven at 1 kHz and slower: the error against the continuous loop falls with the sample period.
#[test]
fn converges_to_the_continuous_law() {
    for strategy in Strategy::ALL {
        let mut p = parameters(strategy, 2.0, 41.648);
        let (grid, steps) = (8e-3, 250);
        let want = response(&p, [1.0, 0.0], grid, steps);
        let mut errors = Vec::new();
        for per in [2u32, 4, 8, 16] {
            let h = grid / f64::from(per);
            p[parameter::COUNT] = h;
            let column = |i: usize| {
                let seed = |k| Dual::<1>::new(0.0, [if i == k { 1.0 } else { 0.0 }]);
                let x: Vec<_> = (0..6).map(seed).collect();
                plant_rates(&x, seed(6), Dual::zero()).map(|d| d.eps[0])
            };
            let a = DMatrix::from_fn(7, 7, |r, c| if r < 6 { column(c)[r] } else { 0.0 });
            let advance = (a * h).exp();
            let mut plant = nalgebra::DVector::<f64>::zeros(7);
            let mut run = Run::new(JointController, &p, 0.0, &measured(1.0, &[0.0; 6]));
            let mut error: f64 = 0.0;
            for k in 0..steps * per as usize {
                if k % per as usize == 0 {
                    error = error.max((plant[2] - want[k / per as usize][CONTROLLER_STATES + 2]).abs());
                }
                let (t, u) = (k as f64 * h, measured(1.0, plant.as_slice()));
                run.update(t, &u);
                plant[6] = run.output(t, &u)[0];
                plant = &advance * plant;
            }
            errors.push(error);
        }
        println!("{strategy:?}: largest error of the tip at 4, 2, 1, 0.5 ms: {errors:?}");
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((1.8..2.4).contains(&ratio), "{strategy:?}: order 1 expected, ratio {ratio}");
        }
        assert!(errors[2] < 0.02);
    }
}

#[test]
fn samples_fall_on_multiples_of_the_period() {
    let mut p = parameters(Strategy::Vwbc, 2.0, 41.648);
    let h = 1e-3;
    p[parameter::COUNT] = h;
    let u = [0.1; 6];
    // Started between two instants; the times of an importer that adds up steps.
    let mut run = Run::new(JointController, &p, 0.3504, &u);
    run.update(0.3504, &u);
    let mut t = 0.351;
    for k in 351..20_000 {
        assert_eq!(run.model.next_event(&p, &run.modes), Some(f64::from(k) * h));
        let (before, early) = (run.x.clone(), f64::from(k) * h - 1e-6);
        run.update(early, &u);
        assert_eq!(run.x, before, "nothing is due before the instant");
        run.update(t, &u);
        t += h;
    }
    // Instants that were passed over are lost; after more samples than an i32 counts the next one is still exact.
    let late = 5e9 * h;
    run.update(late + 0.4 * h, &u);
    assert_eq!(run.model.next_event(&p, &run.modes), Some((5e9 + 1.0) * h));
    p[parameter::COUNT] = 0.0;
    assert_eq!(run.model.next_event(&p, &run.modes), None);
}

#[test]
fn starts_from_its_inputs() {
    let (angle, n) = (0.7, 5.0);
    for (strategy, h) in Strategy::ALL.into_iter().flat_map(|s| [(s, 0.0), (s, 1e-3)]) {
        let mut p = parameters(strategy, 2.0, 41.648);
        (p[parameter::GEAR_RATIO], p[parameter::COUNT]) = (n, h);
        // At rest at the reference: no torque, at once and later.
        let u = [angle, 0.0, n * angle, 0.0, angle, 0.0];
        let mut run = Run::new(JointController, &p, 0.0, &u);
        assert!(run.output(0.0, &u)[0].abs() < 1e-9, "before the first update");
        run.update(0.0, &u);
        assert!(run.output(0.0, &u)[0].abs() < 1e-9);
        assert_eq!(run.x[state::POSITION_WAVES], angle / 2.0);
        let mut dx = vec![0.0; CONTROLLER_STATES];
        run.model.rates(At { t: 0.0, x: &run.x, u: &u, p: &p, modes: &run.modes }, &mut dx);
        assert!(dx.iter().all(|d| d.abs() < 1e-9), "{strategy:?}: {dx:?}");
    }
}

#[test]
fn n_joints_are_n_times_one_joint() {
    let n = 3;
    let mut seed = 3;
    for (strategy, h) in Strategy::ALL.into_iter().flat_map(|s| [(s, 0.0), (s, 1e-3)]) {
        let one: Vec<_> = [2.0, 1.0, 3.0]
            .into_iter()
            .map(|kp| {
                use adaptation::parameter as a;
                let mut p = parameters(strategy, kp, 10.0 * kp);
                p[parameter::COUNT] = h;
                p[parameter::LIMIT] = 500.0;
                p[a::first(1) + a::RATE] = 10.0 * kp;
                // The second joint by its schedule, the others by what they measure.
                p[a::first(1) + a::ADAPTATION] = if kp == 1.0 { 1.0 } else { 2.0 };
                p[a::schedule_frequency(1)..].iter_mut().enumerate().for_each(|(k, w)| *w += k as f64);
                p
            })
            .collect();
        let p = arranged(&one);
        let model = ManipulatorController { joints: n };
        assert_eq!((p.len(), model.check(&p)), (model.sizes().parameters, Ok(())));
        let mut u: Vec<f64> = (0..6 * n).map(|_| noise(&mut seed)).collect();
        let of = |u: &[f64], j: usize| -> [f64; 6] { core::array::from_fn(|i| u[i * n + j]) };
        let mut all = Run::new(model, &p, 0.0, &u);
        let mut singles: Vec<_> =
            (0..n).map(|j| Run::new(JointController, &one[j], 0.0, &of(&u, j))).collect();
        for k in 0..50 {
            let t = f64::from(k) * 1e-3;
            let due = all.output(t, &u);
            all.update(t, &u);
            assert!(h == 0.0 || due == all.output(t, &u), "due and not committed, sample {k}");
            let mut rates = vec![0.0; CONTROLLER_STATES * n];
            all.model.rates(At { t, x: &all.x, u: &u, p: &p, modes: &all.modes }, &mut rates);
            for (j, single) in singles.iter_mut().enumerate() {
                let u_j = of(&u, j);
                single.update(t, &u_j);
                let mut dx = vec![0.0; CONTROLLER_STATES];
                let at = At { t, x: &single.x, u: &u_j, p: &one[j], modes: &single.modes };
                single.model.rates(at, &mut dx);
                let (got, want) = (all.output(t, &u), single.output(t, &u_j));
                assert!(
                    (0..want.len()).all(|i| got[i * n + j] == want[i]),
                    "{strategy:?}: {got:?}, {want:?}"
                );
                for i in 0..CONTROLLER_STATES {
                    assert_eq!((all.x[i * n + j], rates[i * n + j]), (single.x[i], dx[i]), "state {i}");
                }
                if strategy.adapts() && h > 0.0 && k == 49 {
                    assert!(want[output::ADAPTATION_ACTIVE] == 1.0);
                    assert!(want[output::WAVE_FREQUENCY_USED] != one[j][parameter::WAVE_FREQUENCY]);
                }
            }
            u = (0..6 * n).map(|_| noise(&mut seed)).collect();
        }
    }
}

#[test]
fn refuses_what_cannot_work() {
    let mut p = parameters(Strategy::Vwbc, 2.0, 41.648);
    p[parameter::COUNT] = 0.1;
    let (index, text) = JointController.check(&p).expect_err("ω T = 4.2");
    assert_eq!(index, parameter::COUNT);
    assert!(text.contains("samplePeriod 0.1") && text.contains("41.648"), "{text}");
    p[parameter::COUNT + 1] = 1.0;
    assert_eq!(JointController.check(&p), Ok(()), "P/PI has no waves");
    p[parameter::COUNT + 1] = 2.5;
    assert_eq!(JointController.check(&p).map_err(|e| e.0), Err(parameter::COUNT + 1));
    assert_eq!(RUNNING.len(), JointController.sizes().modes);
}
