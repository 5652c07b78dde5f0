//! Rates and torques at one instant.

use super::Controlled;
use crate::arm_common::Random;
use crate::space::flyer::Flyer;
use trueup_models::space::attitude::{normalized, rotation};
use trueup_models::space::design::{DesignLink, DesignMotor, DesignTip, RobotDesign};
use trueup_models::space::presets;
use trueup_models::space::spatial::SpatialFrame;
use trueup_models::space::tree::JointType;
use trueup_models::space::vector::{Matrix3, times};
use trueup_numerics::hybrid::{At, Hybrid};
use trueup_numerics::{Dual, Scalar};

/// A body's inertia: that of eight masses somewhere.
fn inertia(random: &mut Random) -> Matrix3<f64> {
    let mut sum = [[0.0; 3]; 3];
    for _ in 0..8 {
        let v = random.vector(3, 0.4);
        let square: f64 = v.iter().map(|v| v * v).sum();
        for i in 0..3 {
            (0..3).for_each(|j| sum[i][j] -= v[i] * v[j]);
            sum[i][i] += square;
        }
    }
    sum
}

/// A random robot of one or two arms, of `joints` joints each.
fn drawn(random: &mut Random, arms: usize, joints: usize) -> RobotDesign {
    let mut design = presets::chaser();
    design.base_mass = 40.0 + 20.0 * random.vector(1, 1.0)[0];
    design.base_inertia = inertia(random).map(|row| row.map(|v| 20.0 * v));
    design.links.clear();
    design.tips.clear();
    for arm in 0..arms {
        for k in 0..joints {
            let three = |random: &mut Random, size: f64| {
                let v = random.vector(3, size);
                [v[0], v[1], v[2]]
            };
            let q = normalized([0, 1, 2, 3].map(|_| random.within(-1.0, 1.0)));
            design.links.push(DesignLink {
                name: format!("link {arm} {k}"),
                parent: if k == 0 { 0 } else { arm * joints + k },
                joint: if random.vector(1, 1.0)[0] > 0.8 {
                    JointType::Prismatic
                } else {
                    JointType::Revolute
                },
                mass: 3.0 + 2.0 * random.vector(1, 1.0)[0],
                center_of_mass: three(random, 0.3),
                inertia: inertia(random),
                position: three(random, 0.8),
                orientation: q,
                axis: three(random, 1.0),
                motor: DesignMotor { inertia: 0.2, gear_ratio: 50.0, ..DesignMotor::default() },
            });
        }
        let body = (arm + 1) * joints;
        design.tips.push(DesignTip {
            name: format!("hand {arm}"),
            body,
            offset: [0.3, 0.1, -0.2],
            mount: [0.0; 3],
        });
    }
    design
}

/// Checks CTS-1, CTS-2, CTS-4 and CTS-5: the twist that the rates give by another way to the Jacobians is the reference.
#[test]
fn rates_give_the_reference_by_the_momentum_form() {
    let mut random = Random(70);
    let mut tried = 0;
    for trial in 0..40 {
        let (arms, joints) = ([1, 1, 2][trial % 3], 6 + trial % 3);
        let mut design = drawn(&mut random, arms, joints);
        // The momentum form has no rotors.
        design.links.iter_mut().for_each(|l| l.motor = DesignMotor::default());
        let mut control = Controlled::of(&design);
        let own = control.own;
        control.p[own.threshold] = 0.0;
        (0..arms * joints).for_each(|j| control.p[own.rate_limit + j] = 1e9);
        let moving = trial % 4 == 3;
        control.p[own.base_control] = if moving { 3.0 } else { 1.0 };
        let mut u = random.vector(control.input.count, 1.0);
        u[control.input.base_quaternion] += 2.0;
        u[control.input.contact_force_reference..][..arms].fill(0.0);
        let y = control.outputs(&vec![0.0; control.state.count], &u, &[0, 0]);
        if y[control.output.smallest_singular_value] < 1e-3 {
            continue;
        }
        tried += 1;
        let n = arms * joints;
        let q = &u[control.input.joint_angle..][..n];
        let at = control.input.base_quaternion;
        let frame =
            SpatialFrame { rotation: rotation([u[at], u[at + 1], u[at + 2], u[at + 3]]), origin: [0.0; 3] };
        let robot = design.robot();
        let omega = times(&frame.rotation, [0, 1, 2].map(|i| u[control.input.base_angular_velocity + i]));
        let base: Vec<f64> = u[control.input.base_velocity..][..3].iter().copied().chain(omega).collect();
        for (a, tip) in design.tips.iter().enumerate() {
            let form = robot.momentum_form(frame, q, (tip.body, tip.offset));
            let j_g = form.generalized_jacobian().unwrap();
            let rates = &y[control.output.joint_velocity_command..][..n];
            // J_s H2^-1 f: f from the measured motion.
            let size = 6 + n;
            let mut h: Vec<f64> = (0..6)
                .map(|i| {
                    let of_base: f64 = (0..6).map(|k| form.mass[i * size + k] * base[k]).sum();
                    let measured = &u[control.input.joint_velocity..][..n];
                    of_base + (0..n).map(|j| form.mass[i * size + 6 + j] * measured[j]).sum::<f64>()
                })
                .collect();
            let mut m: Vec<f64> = (0..36).map(|i| form.mass[i / 6 * size + i % 6]).collect();
            trueup_numerics::linear::ldl_factor(&mut m, 6).unwrap();
            trueup_numerics::linear::ldl_solve(&m, 6, &mut h);
            let (by_joints, by_base) = if moving { (&form.j_m, &base) } else { (&j_g, &h) };
            for row in 0..6 {
                let carried: f64 = (0..6).map(|k| form.j_s[row * 6 + k] * by_base[k]).sum();
                let given: f64 = carried + (0..n).map(|j| by_joints[row * n + j] * rates[j]).sum::<f64>();
                let wanted = u[control.input.tip_velocity_reference + 6 * a + row];
                let size = rates.iter().fold(1.0_f64, |m, r| m.max(r.abs()));
                assert!((given - wanted).abs() < 1e-9 * size, "{trial} {a} {row}: {given} {wanted}");
            }
        }
    }
    assert!(tried > 25, "{tried}");
}

/// Checks CTS-12: by the momentum form, rates of a reactionless hand turn the base by less than 1e-9 of what the rates of the
/// generalized Jacobian turn it by, and the hands have the velocities that both are to give; with a base that is to turn it does.
#[test]
fn a_reactionless_hand_does_not_turn_the_base_by_the_momentum_form() {
    let mut random = Random(76);
    let (mut tried, mut worst) = (0, 0.0_f64);
    for trial in 0..40 {
        let (arms, joints) = ([1, 1, 2][trial % 3], 6 + trial % 3);
        let mut design = drawn(&mut random, arms, joints);
        design.links.iter_mut().for_each(|l| l.motor = DesignMotor::default());
        let (mut control, n) = (Controlled::of(&design), arms * joints);
        let own = control.own;
        control.p[own.threshold] = 0.0;
        control.p[own.rate_limit..][..n].fill(1e9);
        (0..arms).for_each(|a| control.p[own.task_weight + 6 * a + 3..][..3].fill(0.0));
        let mut u = random.vector(control.input.count, 1.0);
        u[control.input.base_quaternion] += 2.0;
        // At rest: all momentum is that of the rates.
        u[control.input.base_velocity..][..3].fill(0.0);
        u[control.input.base_angular_velocity..][..3].fill(0.0);
        u[control.input.joint_velocity..][..n].fill(0.0);
        u[control.input.contact_force_reference..][..arms].fill(0.0);
        let turns = trial % 4 == 3;
        if !turns {
            u[control.input.base_rate_reference..][..3].fill(0.0);
        }
        let at = control.input.base_quaternion;
        let frame =
            SpatialFrame { rotation: rotation([u[at], u[at + 1], u[at + 2], u[at + 3]]), origin: [0.0; 3] };
        let robot = design.robot();
        let q = &u[control.input.joint_angle..][..n];
        let tip = |a: usize| (design.tips[a].body, design.tips[a].offset);
        let form = robot.momentum_form(frame, q, tip(0));
        let mut rate = Vec::new();
        let mut smallest = f64::MAX;
        for base in [1.0, 5.0] {
            control.p[own.base_control] = base;
            let y = control.outputs(&vec![0.0; control.state.count], &u, &[0, 0]);
            smallest = smallest.min(y[control.output.smallest_singular_value]);
            let rates = &y[control.output.joint_velocity_command..][..n];
            let mut v: Vec<f64> = (0..6)
                .map(|i| -(0..n).map(|j| form.mass[i * (6 + n) + 6 + j] * rates[j]).sum::<f64>())
                .collect();
            let mut m: Vec<f64> = (0..36).map(|i| form.mass[i / 6 * (6 + n) + i % 6]).collect();
            trueup_numerics::linear::ldl_factor(&mut m, 6).unwrap();
            trueup_numerics::linear::ldl_solve(&m, 6, &mut v);
            if smallest > 1e-2 {
                for a in 0..arms {
                    let form = robot.momentum_form(frame, q, tip(a));
                    let size = rates.iter().fold(1.0_f64, |m, r| m.max(r.abs()));
                    for row in 0..3 {
                        let given: f64 = (0..6).map(|k| form.j_s[row * 6 + k] * v[k]).sum::<f64>()
                            + (0..n).map(|j| form.j_m[row * n + j] * rates[j]).sum::<f64>();
                        let wanted = u[control.input.tip_velocity_reference + 6 * a + row];
                        assert!(
                            (given - wanted).abs() < 1e-9 * size,
                            "{trial} {base} {a} {row}: {given} {wanted}"
                        );
                    }
                }
            }
            rate.push([v[3], v[4], v[5]]);
        }
        if smallest < 1e-2 {
            continue;
        }
        tried += 1;
        let length = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let reference = times(&frame.rotation, [0, 1, 2].map(|i| u[control.input.base_rate_reference + i]));
        let missed = length([0, 1, 2].map(|i| rate[1][i] - reference[i])) / length(rate[0]);
        worst = worst.max(missed);
        assert!(missed < 1e-9, "{trial}: {missed}");
    }
    println!("{tried} robots, the base turns by {worst:.1e} of what it does without");
    assert!(tried > 25, "{tried}");
}

/// Checks CTS-8: the plant, driven by these torques, accelerates its joints as the errors of their rates require.
#[test]
fn torques_give_the_accelerations_that_the_errors_require() {
    let mut random = Random(71);
    for trial in 0..16 {
        let mut design = drawn(&mut random, 1 + trial % 2, 4 + trial % 3);
        design.held = trial % 4 == 3;
        let mut control = Controlled::of(&design);
        let (own, n) = (control.own, design.links.len());
        let attitude = trial % 4 == 2;
        if attitude {
            control.p[own.base_control] = 2.0;
            control.p[own.base_torque_limit] = 1e9;
        }
        (0..n).for_each(|j| control.p[own.torque_limit + j] = 1e9);
        let plant = Flyer::of(&design);
        let (x, _) = plant.anywhere(&mut random);
        let mut u = random.vector(control.input.count, 1.0);
        control.measure(&plant, &x, &mut u);
        u[control.input.torque_feedforward..][..n].fill(0.0);
        u[control.input.contact_force_reference..][..design.tips.len()].fill(0.0);
        let memory = random.vector(control.state.count, 1e-3);
        let y = control.outputs(&memory, &u, &[0, 0]);
        let mut v = vec![0.0; plant.input.count];
        v[plant.input.joint_torque..][..n].copy_from_slice(&y[control.output.joint_torque..][..n]);
        if !design.held {
            v[plant.input.base_torque..][..3].copy_from_slice(&y[control.output.base_torque..][..3]);
        }
        let dx = plant.rates(&x, &v);
        for j in 0..n {
            let error = y[control.output.joint_velocity_command + j] - u[control.input.joint_velocity + j];
            let wanted = control.p[own.velocity_gain + j] * error
                + control.p[own.tracking_gain + j] * memory[control.state.tracking + j];
            let found = dx[plant.at.joint_velocity + j];
            assert!((found - wanted).abs() < 1e-8 * (1.0 + wanted.abs()), "{trial} {j}: {found} {wanted}");
        }
        for i in (0..3).filter(|_| attitude) {
            let error = u[control.input.base_rate_reference + i] - x[plant.at.base_angular_velocity + i];
            let wanted = control.p[own.base_velocity_gain] * error
                + control.p[own.base_tracking_gain] * memory[control.state.base_tracking + i];
            let found = dx[plant.at.base_angular_velocity + i];
            assert!((found - wanted).abs() < 1e-8 * (1.0 + wanted.abs()), "{trial} {i}: {found} {wanted}");
        }
    }
}

/// Checks CTS-6 and CTS-7: at any pose, singular ones included, rates are bounded by the damping and by their limits.
#[test]
fn rates_are_bounded_at_any_pose() {
    let mut random = Random(72);
    let control = Controlled::of(&presets::chaser());
    let n = 6;
    for trial in 0..300 {
        let mut u = control.inputs();
        let angles = random.vector(n, 3.0);
        // Every third one is stretched, and so singular.
        let scale = if trial % 3 == 0 { 0.0 } else { 1.0 };
        (0..n).for_each(|j| u[control.input.joint_angle + j] = scale * angles[j]);
        let reference = random.vector(6, 0.3);
        u[control.input.tip_velocity_reference..][..6].copy_from_slice(&reference);
        let y = control.outputs(&vec![0.0; control.state.count], &u, &[0, 0]);
        let rates = &y[control.output.joint_velocity_command..][..n];
        let length = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let (sigma, lambda) = (y[control.output.smallest_singular_value], y[control.output.damping_used]);
        assert!(y.iter().all(|v| v.is_finite()), "{trial}");
        assert!(rates.iter().all(|r| r.abs() <= 1.0 + 1e-12), "{trial} {rates:?}");
        let bound = length(&reference) / if lambda > 0.0 { (2.0 * lambda).max(sigma) } else { sigma };
        assert!(length(rates) <= bound * (1.0 + 1e-9), "{trial}: {} {bound}", length(rates));
        assert_eq!(lambda > 0.0, sigma < control.p[control.own.threshold], "{trial}");
        // What it costs: nothing away from singularities, unless rates are at their limits.
        let error = length(&y[control.output.tip_velocity_error..][..6]);
        let limited = rates.iter().any(|r| r.abs() > 1.0 - 1e-9);
        if lambda == 0.0 && !limited {
            assert!(error < 1e-9, "{trial}: {error}");
        }
    }
}

/// Derivatives of all outputs by the inputs are those of their values, damped or not.
#[test]
fn derivatives_are_those_of_the_values() {
    let mut random = Random(73);
    for (trial, scale) in [1.0, 1.0, 0.02].into_iter().enumerate() {
        let mut control = Controlled::of(&presets::chaser());
        control.p[control.own.base_control] = [1.0, 2.0, 1.0][trial];
        let mut u = random.vector(control.input.count, 0.5);
        u[control.input.base_quaternion] += 2.0;
        (0..6).for_each(|j| u[control.input.joint_angle + j] *= scale);
        (0..6).for_each(|j| control.p[control.own.rate_limit + j] = 1e9);
        (0..6).for_each(|j| control.p[control.own.torque_limit + j] = 1e9);
        let x = random.vector(control.state.count, 1e-3);
        let slope = random.vector(u.len(), 1.0);
        let dual: Vec<Dual<8>> = u
            .iter()
            .zip(&slope)
            .map(|(v, s)| {
                let mut eps = [0.0; 8];
                eps[0] = *s;
                Dual { re: *v, eps }
            })
            .collect();
        let constant = |v: &[f64]| v.iter().map(|v| Dual::constant(*v)).collect::<Vec<Dual<8>>>();
        let (xd, pd) = (constant(&x), constant(&control.p));
        let mut y = vec![Dual::<8>::constant(0.0); control.output.count];
        let at = At { t: Dual::constant(0.0), x: &xd, u: &dual, p: &pd, modes: &[0, 0] };
        control.model.outputs(at, &mut y);
        let shifted = |h: f64| {
            let u: Vec<f64> = u.iter().zip(&slope).map(|(u, s)| u + h * s).collect();
            control.outputs(&x, &u, &[0, 0])
        };
        let h = 1e-5;
        let (plus, minus, here) = (shifted(h), shifted(-h), shifted(0.0));
        for (i, y) in y.iter().enumerate() {
            assert_eq!(y.re, here[i], "{trial} {i}");
            let slope = (plus[i] - minus[i]) / (2.0 * h);
            let size = 1.0 + slope.abs() + here[i].abs();
            assert!((y.eps[0] - slope).abs() < 1e-5 * size, "{trial} {i}: {} {slope}", y.eps[0]);
        }
    }
}

#[test]
fn what_cannot_be_is_refused_with_its_remedy() {
    let mut none = presets::chaser();
    none.links.clear();
    none.tips.clear();
    let why = trueup_models::space::control::SpaceController::new(none.structure()).unwrap_err();
    assert!(why.contains("no joints") && why.contains("give it an arm"), "{why}");
    let control = Controlled::of(&presets::chaser());
    for (index, value, words) in [
        (control.own.base_control, 7.0, "baseControl is 7: choose 1 (free)"),
        (control.own.base_actuator, 3.0, "baseActuator is 3: choose 1 (wheels) or 2 (thrusters)"),
        (control.own.contact_normal, 0.0, "contactNormal[1,1] to [1,3] are all 0"),
        (control.own.sample_period, 0.1, "samplePeriod 0.1 s is too long for velocityGain[1]"),
    ] {
        let mut p = control.p.clone();
        p[index] = value;
        let (at, why) = control.model.check(&p).unwrap_err();
        assert!(at == index && why.contains(words), "{at} {why}");
    }
    let mut p = control.p.clone();
    p[1] = -1.0;
    assert!(control.model.check(&p).unwrap_err().1.contains("baseInertia"));
}
