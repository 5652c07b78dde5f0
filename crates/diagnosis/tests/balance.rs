//! Accelerations that the recorded inputs do not explain, on recordings that are made here.

use trueup_diagnosis::engine::balance::{GriddedRecording, Links};
use trueup_diagnosis::engine::coordinate::CoordinateReadings;
use trueup_diagnosis::engine::octaves;
use trueup_diagnosis::engine::subject::{DiagnosisSubject, EngineModel};
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_identification::sensors::SensorSet;
use trueup_models::effect::PlantKind;
use trueup_models::joint::{input, output, parameter};

/// A rigid joint without friction, inertia `J` on the motor's side, driven through A sin(w t) by the current that it
/// takes, and a push of `push` N.m on the motor from t = 4 s to 6 s that the current does not make.
fn recording(p: &[f64], push: f64) -> IdentificationRun {
    let inertia = p[parameter::MOTOR_INERTIA] + p[parameter::LOAD_INERTIA] / p[parameter::GEAR_RATIO].powi(2);
    let t: Vec<f64> = (0..5000).map(|k| f64::from(k) * 0.002).collect();
    let pushed = |t: f64| if (4.0..6.0).contains(&t) { push } else { 0.0 };
    let (a, w) = (20.0, 3.0);
    let current = |t: f64| (-inertia * a * w * w * (w * t).sin() - pushed(t)) / p[parameter::TORQUE_CONSTANT];
    IdentificationRun {
        name: "made".into(),
        drives: vec![InputDrive {
            input: input::MOTOR_CURRENT,
            u: t.iter().map(|t| current(*t)).collect(),
            t: t.clone(),
            ..InputDrive::default()
        }],
        channels: vec![OutputChannel {
            name: "motorAngle".into(),
            output: output::MOTOR_ANGLE,
            y: t.iter().map(|t| a * (w * t).sin()).collect(),
            t,
            sigma: 1e-6,
            ..OutputChannel::default()
        }],
        ..IdentificationRun::default()
    }
}

#[test]
fn the_missing_torque_is_the_unrecorded_one() {
    let subject = DiagnosisSubject::new(PlantKind::Joint, vec![false]);
    let model = subject.model(&[] as &[&str]).unwrap();
    let mut p = subject.defaults(&model);
    for i in [parameter::COULOMB_FRICTION, parameter::STATIC_FRICTION, parameter::VISCOUS_FRICTION] {
        p[i] = 0.0;
    }
    let inertia = p[parameter::MOTOR_INERTIA] + p[parameter::LOAD_INERTIA] / p[parameter::GEAR_RATIO].powi(2);
    let coordinates = subject.coordinates(&model, &p);
    for push in [0.0, 0.01] {
        let prescribed = GriddedRecording::new(&recording(&p, push), 2, 1.5).unwrap();
        let links = prescribed.links(&model, &coordinates);
        let missing = prescribed.missing(&model, &links, &p, &SensorSet::none(2, output::COUNT)).unwrap();
        for (k, v) in missing[0].iter().enumerate().filter(|(k, _)| prescribed.counts.contains(k)) {
            let t = prescribed.t[k];
            if [4.0, 6.0].iter().any(|edge| (t - edge).abs() < 0.02) {
                continue;
            }
            let lacks = if (4.0..6.0).contains(&t) { push / inertia } else { 0.0 };
            // The kernels' error: they flatten a sine by (w s)^2 / 2, motion and current alike.
            assert!((v + lacks).abs() < 1e-4 * (180.0 + lacks), "at {t}: {v}, lacks {lacks}");
        }
    }
}

#[test]
fn rests_are_bridged() {
    let p = DiagnosisSubject::new(PlantKind::Joint, vec![false]);
    let model = p.model(&[] as &[&str]).unwrap();
    let mut prescribed = GriddedRecording::new(&recording(&p.defaults(&model), 0.0), 2, 1.5).unwrap();
    let series: Vec<f64> = prescribed.t.clone();
    prescribed.reversal[1000..1500].fill(true);
    let mut odd = series.clone();
    odd[1000..1500].fill(1e9);
    let bridged = prescribed.counted(&odd);
    assert!(bridged.iter().zip(&series[prescribed.counts.clone()]).all(|(a, b)| (a - b).abs() < 0.01));
    assert!(!prescribed.is_bridged());
    prescribed.reversal[500..4500].fill(true);
    assert!(prescribed.is_bridged());
}

/// Noise of readings is fast once it is an acceleration: bridges leave next to nothing slow of it.
#[test]
fn bridges_keep_fast_noise_fast() {
    use rand::{Rng, SeedableRng};
    let p = DiagnosisSubject::new(PlantKind::Joint, vec![false]);
    let model = p.model(&[] as &[&str]).unwrap();
    let prescribed = GriddedRecording::new(&recording(&p.defaults(&model), 0.0), 2, 1.5).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let noise: Vec<f64> = prescribed.t.iter().map(|_| rng.sample(rand_distr::StandardNormal)).collect();
    let series = octaves::gaussian(&noise, prescribed.kernel, 2);
    let slow = |series: &[f64]| {
        let last = prescribed.parts.last().map(|p| p.octave);
        let values = octaves::split(series).into_iter().zip(&prescribed.parts);
        let of: Vec<f64> = values.filter(|(_, p)| Some(p.octave) == last).map(|(v, _)| v * v).collect();
        (of.iter().sum::<f64>() / of.len() as f64).sqrt()
    };
    let (mut masked, mut rough) = (prescribed.clone(), series.clone());
    for begin in (400..4600).step_by(400) {
        masked.reversal[begin..begin + 60].fill(true);
        // The same bridge from means of four readings.
        let mean = |from: usize| series[from..from + 4].iter().sum::<f64>() / 4.0;
        let (a, b) = (mean(begin - 4), mean(begin + 60));
        (0..60).for_each(|i| rough[begin + i] = a + (b - a) * (i + 1) as f64 / 61.0);
    }
    let [whole, rough] = [&series, &rough].map(|s| slow(&s[prescribed.counts.clone()]));
    let bridged = slow(&masked.counted(&series));
    assert!(
        bridged < 2.0 * whole && bridged < 0.1 * rough,
        "{whole} whole, {rough} rough, {bridged} bridged"
    );
}

/// Fast torques: a ripple at 38 Hz and a shaking motion at 38 Hz, behind a kernel that leaves a third of either.
#[test]
fn what_is_fast_passes_the_same_kernel_on_both_sides() {
    let subject = DiagnosisSubject::new(PlantKind::Joint, vec![false]);
    let (plain, rippled) =
        (subject.model(&[] as &[&str]).unwrap(), subject.model(&["torque-ripple".to_owned()]).unwrap());
    let without = |model: &EngineModel| {
        let mut p = subject.defaults(model);
        for i in [parameter::COULOMB_FRICTION, parameter::STATIC_FRICTION, parameter::VISCOUS_FRICTION] {
            p[i] = 0.0;
        }
        p
    };
    let mut p = without(&rippled);
    let inertia = p[parameter::MOTOR_INERTIA] + p[parameter::LOAD_INERTIA] / p[parameter::GEAR_RATIO].powi(2);
    let (torque, order, speed, kernel) = (100.0 * inertia, 8.0, 30.0, 3.0);
    for (name, value) in [("rippleSine", torque), ("rippleCosine", 0.0), ("rippleOrder", order)] {
        let at = subject.parameters(&rippled).iter().position(|n| n.name == name).unwrap();
        p[at] = value;
    }
    let (a, w) = (1e-3, order * speed);
    let angle = |t: f64| speed * t + a * (w * t).cos();
    let mut run = recording(&p, 0.0);
    let t = run.channels[0].t.clone();
    run.channels[0].y = t.iter().map(|t| angle(*t)).collect();
    run.drives[0].between = InputInterpolation::Linear;
    run.drives[0].u = (t.iter())
        .map(|t| {
            (-inertia * a * w * w * (w * t).cos() - torque * (order * angle(*t)).sin())
                / p[parameter::TORQUE_CONSTANT]
        })
        .collect();
    let prescribed = GriddedRecording::new(&run, 2, kernel).unwrap();
    let rms = |model: &EngineModel, p: &[f64]| {
        let links = prescribed.links(model, &subject.coordinates(model, p));
        let missing = prescribed.missing(model, &links, p, &SensorSet::none(2, output::COUNT)).unwrap();
        let counted = &missing[0][prescribed.counts.clone()];
        (counted.iter().map(|v| v * v).sum::<f64>() / counted.len() as f64).sqrt()
    };
    // A Gaussian of s samples leaves e^(-(w s h)^2 / 2) of a sine.
    let left = (-0.5 * (w * kernel * 0.002).powi(2)).exp() * 100.0 / std::f64::consts::SQRT_2;
    let (with, lacking) = (rms(&rippled, &p), rms(&plain, &without(&plain)));
    assert!((lacking / left - 1.0).abs() < 0.05, "{lacking} of {left}");
    // The mean over a step of a line between two samples lacks (w h)^2 / 8 of a sine, 2.9 %, of the current here.
    assert!(with < 0.04 * lacking, "{with} of {lacking}");
}

/// A test-bed's motor that no sensor measures: with accelerations that the model computes for what is prescribed it runs away, with
/// those that were measured it stays where it was.
#[test]
fn unprescribed_coordinates_move_with_what_was_measured() {
    use trueup_models::arm::{input, output, parameter};
    use trueup_numerics::driver::{DriverOptions, simulate};
    let subject = DiagnosisSubject::new(PlantKind::Arm, vec![true, false, false]);
    let model = subject.model(&[] as &[&str]).unwrap();
    let (n, p) = (3, subject.defaults(&model));
    // At rest in the beginning: a kernel has no earlier values.
    let torque = |t: f64| {
        let size = 1.0 - (-(t / 4.0).powi(4)).exp();
        [0.1 * (0.7 * t).sin(), 0.02 * (1.1 * t).sin(), 0.01 * (1.3 * t).cos()].map(|u| size * u)
    };
    let command = move |t: f64, u: &mut [f64]| u[input::joint_torque(n)..][..n].copy_from_slice(&torque(t));
    let t: Vec<f64> = (0..2000).map(|k| f64::from(k) * 0.02).collect();
    let nominal = vec![1.0; model.sizes().states];
    let options = DriverOptions { tolerance: 1e-10, ..DriverOptions::default() };
    let EngineModel::Arm(arm) = &model else { panic!("an arm") };
    let run = simulate(arm.inner(), &p, &nominal, options, &command, &t).unwrap();
    let all = subject.coordinates(&model, &p);
    // The joint's motor is the fifth coordinate.
    let seen = all.iter().enumerate().filter(|(i, _)| *i != 4).map(|(_, c)| c);
    let channel = |c: &CoordinateReadings| OutputChannel {
        output: c.positions[0].0,
        y: run.x.iter().map(|x| x[c.position[0].0]).collect(),
        t: t.clone(),
        sigma: 1e-6,
        ..OutputChannel::default()
    };
    let drive = |j: usize| InputDrive {
        input: input::joint_torque(n) + j,
        between: InputInterpolation::Linear,
        u: t.iter().map(|t| torque(*t)[j]).collect(),
        t: t.clone(),
        ..InputDrive::default()
    };
    let recording = IdentificationRun {
        drives: (0..n).map(drive).collect(),
        channels: seen.map(channel).collect(),
        ..IdentificationRun::default()
    };
    let mut prescribed = GriddedRecording::new(&recording, model.sizes().inputs, 1.5).unwrap();
    prescribed.leading.coordinates = vec![true; all.len()];
    let made_up = prescribed.links(&model, &all);
    prescribed.leading.as_measured = true;
    let links = prescribed.links(&model, &all);
    assert_eq!(links.unprescribed().collect::<Vec<_>>(), [4]);
    let missed = |links: &Links, p: &[f64]| {
        let missing = prescribed
            .missing(&model, links, p, &SensorSet::none(model.sizes().inputs, output::count(3)))
            .unwrap();
        let of = |c: usize| missing[c][prescribed.counts.clone()].iter().map(|v| v * v).sum::<f64>();
        ((0..missing.len()).map(of).sum::<f64>() / prescribed.counts.len() as f64).sqrt()
    };
    let mut soft = p.clone();
    soft[parameter::joint_stiffness(n)] *= 0.8;
    let (held, wrong, free) = (missed(&links, &p), missed(&links, &soft), missed(&made_up, &p));
    assert!(held < 0.02 * wrong && free > 1e3 * held, "{held} held, {wrong} too soft, {free} not held");
}
