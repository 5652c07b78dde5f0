//! Derivatives of the arm by duals against differences, at random states in every kind of mode.
#![allow(clippy::unwrap_used)]

use crate::arm_common::Random;
use trueup_models::arm::{PlanarManipulator, parameter, rotor};
use trueup_numerics::hybrid::{At, Hybrid};
use trueup_numerics::{Dual, Scalar};

/// Rates, outputs and indicators one after another at z = (states, inputs, parameters).
fn all<T: Scalar>(model: &PlanarManipulator, z: &[T], modes: &[i32]) -> Vec<T> {
    let s = model.sizes();
    let (x, rest) = z.split_at(s.states);
    let (u, p) = rest.split_at(s.inputs);
    let at = At { t: T::zero(), x, u, p, modes };
    let mut out = vec![T::zero(); s.states + s.outputs + s.indicators];
    let (dx, rest) = out.split_at_mut(s.states);
    let (y, indicators) = rest.split_at_mut(s.outputs);
    model.rates(at, dx);
    model.outputs(at, y);
    model.indicators(at, indicators);
    out
}

#[test]
fn duals_equal_differences_in_every_mode() {
    let mut random = Random(8);
    let mut worst = 0.0f64;
    let effects: [&[&str]; 3] = [
        &[],
        &["stribeck-friction", "backlash"],
        &[
            "backlash",
            "nonlinear-stiffness",
            "transmission-hysteresis",
            "flexible-link",
            "table-tilt",
            "base-drag",
        ],
    ];
    for case in 0..60 {
        let n = random.within(1.0, 4.99) as usize;
        let flexible: Vec<bool> = (0..n).map(|_| random.within(0.0, 1.0) < 0.6).collect();
        let model = PlanarManipulator::new(&flexible, effects[case % 3]).unwrap();
        let s = model.sizes();
        let mut p = model.defaults();
        p[parameter::motor_coupling(n)] = [rotor::PAPER, rotor::GEARED][case / 3 % 2];
        let modes: Vec<i32> = (0..s.modes).map(|_| random.within(-1.5, 1.5).round() as i32).collect();
        let mut z = random.vector(s.states, 1.0);
        for j in (0..n).filter(|_| model.has_friction()) {
            let velocity = &mut z[model.dofs() + model.motor(j)];
            *velocity = velocity.abs() * f64::from(modes[j]);
        }
        z.extend(random.vector(s.inputs, 1.0));
        z.extend(&p);
        for i in (0..z.len()).filter(|i| *i != s.states + s.inputs + parameter::motor_coupling(n)) {
            let d: Vec<_> = z
                .iter()
                .enumerate()
                .map(|(k, v)| Dual::<1>::new(*v, [f64::from(u8::from(k == i))]))
                .collect();
            let duals = all(&model, &d, &modes);
            let values = all(&model, &z, &modes);
            let moved = |h: f64| {
                let mut z = z.clone();
                z[i] += h;
                all(&model, &z, &modes)
            };
            // Parameters may be small and everything to their equation: relative to them.
            let h = if i < s.states + s.inputs || z[i] == 0.0 { 1e-4 } else { 1e-3 * z[i].abs().max(0.01) };
            let [a, b, c, e] = [moved(h), moved(-h), moved(2.0 * h), moved(-2.0 * h)];
            for k in 0..duals.len() {
                assert_eq!(duals[k].re.to_bits(), values[k].to_bits(), "value {k}");
                let slope = (8.0 * (a[k] - b[k]) - (c[k] - e[k])) / (12.0 * h);
                let rounding = 1e-15 * values[k].abs() / h;
                let error =
                    ((duals[k].eps[0] - slope).abs() - 10.0 * rounding).max(0.0) / (1.0 + slope.abs());
                assert!(error < 1e-6, "case {case}: {k} by {i}: {} {slope}", duals[k].eps[0]);
                worst = worst.max(error);
            }
        }
    }
    println!("duals against differences: {worst:e}");
}
