//! Appendages that the arm or the base damps.

use super::{Controlled, run};
use crate::space::flyer::Flyer;
use trueup_models::space::presets;

/// Energy of the bent panels over the time: both are let go as the base turns them, by flapping, in their plane, and by twist.
fn ringing(base: f64, gains: (f64, f64), of_base: (f64, f64), stop: f64) -> Vec<(f64, f64)> {
    let design = presets::table_1_with_panels();
    let (mut plant, mut control) = (Flyer::of(&design), Controlled::of(&design));
    plant.start(plant.parameter.initial_joint_angle, &[0.4, -0.7, 1.2]);
    plant.start(plant.parameter.initial_modal_coordinate, &[0.05, 0.0, 0.03, 0.0, -0.05, 0.0, 0.03, 0.0]);
    let own = control.own;
    control.p[own.base_control] = base;
    control.p[own.task_weight..][..6].fill(0.0);
    (control.p[own.vibration_gain], control.p[own.base_vibration_gain]) = gains;
    (control.p[own.base_velocity_gain], control.p[own.base_tracking_gain]) = of_base;
    let rows = run(&mut plant, &mut control, (stop, 0.01), |_, _| {});
    rows.iter().map(|r| (r.0, r.1[plant.output.potential_energy])).collect()
}

/// Time from which on the energy stays below a hundredth of its largest value: amplitudes below a tenth.
fn settled(energy: &[(f64, f64)]) -> Option<f64> {
    let most = energy.iter().map(|e| e.1).fold(0.0, f64::max);
    let last = energy.iter().rposition(|e| e.1 > 0.01 * most)?;
    (last + 1 < energy.len()).then(|| energy[last].0)
}

/// Checks CTS-13: the arm's inertia, or the base's, settles the panels at least five times faster than they do by themselves.
#[test]
fn the_arm_or_the_base_settles_the_panels() {
    settles_the_panels(&[6.0], &[((5.0, 6.0), 0.0), ((5.0, 6.0), 0.02)]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn the_arm_or_the_base_settles_the_panels_with_any_gain() {
    let base =
        [((5.0, 6.0), 0.0), ((5.0, 6.0), 0.02), ((2.0, 1.0), 0.0), ((2.0, 1.0), 0.02), ((5.0, 6.0), 0.06)];
    settles_the_panels(&[6.0, 1.0, 3.0, 12.0], &base);
}

/// With these gains of the arm and of the base, the first of the arm's and the second of the base's five times faster.
fn settles_the_panels(arm: &[f64], base: &[((f64, f64), f64)]) {
    let free = settled(&ringing(1.0, (0.0, 0.0), (2.0, 1.0), 60.0)).unwrap();
    println!("joints held: {free:.1} s");
    println!("vibrationGain: at rest after (s)");
    let of_arm = |&g: &f64| {
        let after = settled(&ringing(1.0, (g, 0.0), (2.0, 1.0), 30.0)).unwrap();
        println!("{g}: {after:.1}");
        after
    };
    let arm: Vec<f64> = arm.iter().map(of_arm).collect();
    println!("baseVelocityGain, baseTrackingGain, baseVibrationGain: at rest after (s)");
    let by_base = |&(of_base, g): &((f64, f64), f64)| {
        let after = settled(&ringing(2.0, (0.0, g), of_base, 30.0)).unwrap();
        println!("{} {} {g}: {after:.1}", of_base.0, of_base.1);
        after
    };
    let base: Vec<f64> = base.iter().map(by_base).collect();
    assert!(5.0 * arm[0] < free, "{free} {arm:?}");
    assert!(5.0 * base[1] < free && base[1] < base[0], "{free} {base:?}");
}
