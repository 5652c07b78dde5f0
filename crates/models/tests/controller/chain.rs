//! The reference plant of the controllers: a linear chain of motor, hub and tip, all load-referred, and its
//! closed loop with a controller, linearised by duals.

use nalgebra::{DMatrix, DVector};
use trueup_models::controller::{JointController, Strategy, adaptation, output, parameter, state};
use trueup_numerics::{
    Dual, Scalar,
    hybrid::{At, Hybrid},
};

/// Motor (n² J_m, joint 2 of DELIAN, n = 21750), hub, tip.
pub(crate) const INERTIA: [f64; 3] = [21750.0 * 21750.0 * 1.2e-7, 0.5, 6.0];
const RATIO2: f64 = 21750.0 * 21750.0;
/// n² D_m.
const FRICTION: f64 = RATIO2 * 2.5e-8;
/// Joint and link.
pub(crate) const STIFFNESS: [f64; 2] = [RATIO2 * 2.2e-5, 1555.0];
pub(crate) const CONTROLLER_STATES: usize = state::COUNT + adaptation::state::COUNT;
/// States of the loop: the controller's, then three angles and three velocities.
pub(crate) const LOOP: usize = CONTROLLER_STATES + 6;
/// Modes of an initialised continuous controller away from its limit.
pub(crate) const RUNNING: [i32; 5] = [1, 0, 0, 0, 0];
pub(crate) const PARAMETERS: usize = adaptation::parameter::end(1);

fn damping() -> [f64; 2] {
    [RATIO2 * 3.18e-8, 2.0 * 0.005 * (STIFFNESS[1] / INERTIA[2]).sqrt() * INERTIA[2]]
}

/// Rates of three angles and three velocities under the motor's torque and a torque on the tip.
pub(crate) fn plant_rates<T: Scalar>(x: &[T], torque: T, load: T) -> [T; 6] {
    rates_with(INERTIA[2], x, torque, load)
}

/// The same with another inertia of the tip.
pub(crate) fn rates_with<T: Scalar>(tip: f64, x: &[T], torque: T, load: T) -> [T; 6] {
    let d = damping();
    let across = |i: usize| (x[i] - x[i + 1]) * STIFFNESS[i] + (x[i + 3] - x[i + 4]) * d[i];
    let (joint, link) = (across(0), across(1));
    let sums = [torque - joint - x[3] * FRICTION, joint - link, link + load];
    let a = |i: usize| sums[i] / [INERTIA[0], INERTIA[1], tip][i];
    [x[3], x[4], x[5], a(0), a(1), a(2)]
}

/// Parameters of a JointController whose output is the load-referred torque itself: ω_v = 60, z_i = 10. An
/// adaptive strategy does not adapt: its rate is 0.
pub(crate) fn parameters(strategy: Strategy, position_gain: f64, wave_frequency: f64) -> [f64; PARAMETERS] {
    let strategy = f64::from(strategy as u8);
    with_adaptation([
        position_gain,
        INERTIA[0] * 60.0,
        0.1,
        1.0,
        1.0,
        1e9,
        wave_frequency,
        1.0,
        0.0,
        strategy,
    ])
}

/// With parameters of an adaptation that does not move.
pub(crate) fn with_adaptation(law: [f64; parameter::COUNT + 2]) -> [f64; PARAMETERS] {
    use adaptation::{Adaptation, KNOTS, parameter as a};
    let omega = law[parameter::WAVE_FREQUENCY];
    let mut p = [0.0; PARAMETERS];
    p[..law.len()].copy_from_slice(&law);
    let own = [f64::from(Adaptation::Estimate as u8), 0.0, omega / 10.0, omega * 10.0, 1.0, 5e-5];
    p[a::first(1)..][..a::COUNT].copy_from_slice(&own);
    for k in 0..KNOTS {
        p[a::schedule_angle(1) + k] = k as f64;
        p[a::schedule_frequency(1) + k] = omega;
    }
    p
}

/// Parameters of a controller of several joints, each with a schedule over its own angle, from those of single ones.
pub(crate) fn arranged(one: &[[f64; PARAMETERS]]) -> Vec<f64> {
    use adaptation::{KNOTS, parameter as a};
    let n = one.len();
    let columns = |from: usize, count: usize| (0..count * n).map(move |i| one[i % n][from + i / n]);
    let mut p: Vec<f64> = columns(0, parameter::COUNT).collect();
    p.extend(&one[0][parameter::COUNT..][..2]);
    p.extend(columns(a::first(1), a::COUNT));
    for row in [a::schedule_angle(1), a::schedule_frequency(1)] {
        p.extend(one.iter().flat_map(|p| &p[row..][..KNOTS]));
    }
    if n > 1 {
        p.extend((1..=n).map(|k| k as f64));
    }
    p
}

/// Inputs of the controller at the plant's state.
pub(crate) fn measured<T: Scalar>(reference: T, plant: &[T]) -> [T; 6] {
    [reference, T::zero(), plant[0], plant[3], plant[1], plant[4]]
}

/// Rates of controller and plant together.
pub(crate) fn loop_rates<T: Scalar>(p: &[T], modes: &[i32], x: &[T], reference: T, load: T) -> [T; LOOP] {
    let (controller, plant) = x.split_at(CONTROLLER_STATES);
    let u = measured(reference, plant);
    let at = At { t: T::zero(), x: controller, u: &u, p, modes };
    let (mut y, mut dx) = ([T::zero(); output::COUNT], [T::zero(); LOOP]);
    JointController.outputs(at, &mut y);
    JointController.rates(at, &mut dx[..CONTROLLER_STATES]);
    dx[CONTROLLER_STATES..].copy_from_slice(&plant_rates(plant, y[0], load));
    dx
}

/// The loop as x' = A x + B (reference, load torque on the tip).
pub(crate) fn linear(p: &[f64]) -> (DMatrix<f64>, DMatrix<f64>) {
    let p: Vec<Dual<1>> = p.iter().map(|v| Dual::constant(*v)).collect();
    let column = |k: usize| {
        let seed = |i: usize| Dual::<1>::new(0.0, [if i == k { 1.0 } else { 0.0 }]);
        let x: Vec<_> = (0..LOOP).map(seed).collect();
        DVector::from(loop_rates(&p, &RUNNING, &x, seed(LOOP), seed(LOOP + 1)).map(|d| d.eps[0]).to_vec())
    };
    let columns =
        |range: core::ops::Range<usize>| DMatrix::from_columns(&range.map(column).collect::<Vec<_>>());
    (columns(0..LOOP), columns(LOOP..LOOP + 2))
}

/// Exact trajectory of the loop from rest at 0 under constant inputs: `steps` steps of `h` s, the start included.
pub(crate) fn response(p: &[f64], inputs: [f64; 2], h: f64, steps: usize) -> Vec<DVector<f64>> {
    let (a, b) = linear(p);
    let mut whole = DMatrix::zeros(LOOP + 1, LOOP + 1);
    whole.view_mut((0, 0), (LOOP, LOOP)).copy_from(&a);
    whole.view_mut((0, LOOP), (LOOP, 1)).copy_from(&(b * DVector::from(inputs.to_vec())));
    let advance = (whole * h).exp();
    let mut x = DVector::zeros(LOOP + 1);
    x[LOOP] = 1.0;
    let mut all = vec![x.clone()];
    for _ in 0..steps {
        x = &advance * x;
        all.push(x.clone());
    }
    all
}

/// RMS of a signal minus its centred moving average over `window` samples (odd), ends continued by end values.
pub(crate) fn vibration(signal: &[f64], window: usize) -> f64 {
    let (half, last) = ((window / 2) as isize, signal.len() as isize - 1);
    let at = |i: isize| signal[i.clamp(0, last) as usize];
    let off = |i: isize| at(i) - (i - half..=i + half).map(at).sum::<f64>() / window as f64;
    ((0..=last).map(|i| off(i).powi(2)).sum::<f64>() / signal.len() as f64).sqrt()
}
