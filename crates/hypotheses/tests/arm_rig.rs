//! What a case declares of the rig of an arm: known effects, a payload, gains, offsets and delays, parameters of single recordings, forces
//! that were recorded.

use std::collections::BTreeMap;

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use trueup_estimation::innovations::trajectory::case_frame::{chain_frame, fit_alone, prepared};
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::{TrajectoryPlant, TrajectoryPoint};
use trueup_estimation::innovations::trajectory::structures::PlantStructures;
use trueup_hypotheses::innovations::chain_search::{ChainNull, chain_null, search_chain};
use trueup_hypotheses::innovations::findings::search_case;
use trueup_models::plants::{PlantStructure, build};
use trueup_signals::{Case, Channel, Loaded, ParameterValue, PriorGuess};

/// Standard deviation of the noise of an angle, rad.
const NOISE: f64 = 1e-4;
/// An arm of two rigid joints on a base that is fixed; initial angles are 0.
const VALUES: [(&str, f64); 14] = [
    ("linkMass[1]", 2.0),
    ("linkMass[2]", 1.5),
    ("linkInertia[1]", 0.05),
    ("linkInertia[2]", 0.03),
    ("linkLength[1]", 0.4),
    ("linkLength[2]", 0.3),
    ("linkCenterOfMass[1,1]", 0.2),
    ("linkCenterOfMass[1,2]", 0.0),
    ("linkCenterOfMass[2,1]", 0.15),
    ("linkCenterOfMass[2,2]", 0.0),
    ("motorInertia[1]", 0.2),
    ("motorInertia[2]", 0.1),
    ("gearRatio[1]", 100.0),
    ("gearRatio[2]", 100.0),
];

/// An arm as it is.
#[derive(Clone, Copy, Default)]
struct MadeArm<'a> {
    /// Of drive and noise.
    seed: u64,
    effects: &'a [&'a str],
    payload: Option<usize>,
    /// True values that differ from [`VALUES`], of both recordings and of the second.
    values: &'a [(&'a str, f64)],
    second: &'a [(&'a str, f64)],
    /// Size of the first input, in N.m, or of a servo's reference in rad.
    drive: f64,
    /// Further inputs with their sizes.
    others: &'a [(&'a str, f64)],
    /// Outputs in addition to the angles of the joints.
    more: &'a [&'a str],
}

impl MadeArm<'_> {
    /// Two recordings of 2 s, and what the case has in addition to the true values of an arm without effects.
    fn case(&self, lines: &str) -> Loaded {
        let plant = build(&PlantStructure {
            model: "PlanarManipulator".into(),
            flexible: vec![false, false],
            fixed_base: true,
            effects: self.effects.iter().map(|e| (*e).to_owned()).collect(),
            payload: self.payload,
            ..PlantStructure::default()
        })
        .unwrap();
        let rng = &mut StdRng::seed_from_u64(self.seed);
        let mut tables = BTreeMap::new();
        for (file, second) in [("a.csv", &[][..]), ("b.csv", self.second)] {
            let table = plant.table();
            let known = VALUES.iter().chain(self.values).chain(second);
            let value = |name: &str| known.clone().filter(|v| v.0 == name).last().map(|v| v.1);
            let given = table.parameters.iter().map(|q| {
                let usual = if q.is_initial() { 0.0 } else { q.neutral.unwrap_or(q.start) };
                value(&q.name).unwrap_or(usual)
            });
            let theta: Vec<f64> = given.collect();
            let mut plant = TrajectoryPlant::new(plant.clone(), &theta).unwrap();
            plant.others = self
                .others
                .iter()
                .map(|o| table.inputs.iter().position(|q| q.name == o.0).unwrap())
                .collect();
            tables.insert(file.to_owned(), self.run(&plant, &theta, rng));
        }
        let inputs: Vec<&String> = tables["a.csv"].iter().skip(1).map(|c| &c.0).collect();
        let (inputs, outputs) = inputs.split_at(2 + self.others.len());
        let hold = inputs.iter().map(|n| format!("[channels.\"{n}\"]\ninterpolation = \"hold\"\n"));
        let noise = outputs.iter().map(|n| format!("[channels.\"{n}\"]\nnoise = {NOISE}\n"));
        let channels: String = hold.chain(noise).collect();
        let own: String = VALUES.iter().map(|(n, v)| format!("\"{n}\" = {v:?}\n")).collect();
        let text = format!(
            "model = \"PlanarManipulator\"\ntrain = [\"a.csv\", \"b.csv\"]\n[parameters]\nbase = \"fixed\"\njointFlexible = [false, false]\n{own}{lines}\n{channels}"
        );
        Case::of_tables(&text, &tables, |_| Ok(Vec::new())).unwrap().0
    }

    /// Columns of a recording at 100 Hz with held inputs.
    fn run(&self, plant: &TrajectoryPlant, theta: &[f64], rng: &mut StdRng) -> Vec<(String, Vec<f64>)> {
        let table = plant.plant().table();
        let (n, normal) = (plant.coordinates(), Normal::new(0.0, NOISE).unwrap());
        let mut sizes = vec![self.drive, 0.4 * self.drive];
        sizes.extend(self.others.iter().map(|o| o.1));
        let waves: Vec<[f64; 3]> =
            sizes.iter().map(|s| [*s, rng.random_range(3.0..7.0), rng.random_range(0.0..6.0)]).collect();
        let inputs: Vec<usize> = table.driving.iter().chain(&plant.others).copied().collect();
        let angles = plant.plant().coordinates().iter().map(|c| c.position_output);
        let outputs: Vec<usize> = angles.chain(self.more.iter().map(|o| table.output(o).unwrap())).collect();
        let mut columns: Vec<(String, Vec<f64>)> = vec![("time".into(), Vec::new())];
        columns.extend(inputs.iter().map(|k| (table.inputs[*k].name.clone(), Vec::new())));
        columns.extend(outputs.iter().map(|k| (table.outputs[*k].name.clone(), Vec::new())));
        let mut x = plant.first();
        for k in 0..200 {
            let t = f64::from(k) * 0.01;
            let torque: Vec<f64> =
                waves.iter().map(|[size, w, phase]| size * (w * t + phase).sin()).collect();
            let shown =
                plant.outputs(TrajectoryPoint { theta, state: &x, torque: &torque, time: t }, &outputs).0;
            let noisy: Vec<f64> = shown.iter().map(|y| y + normal.sample(rng)).collect();
            let row = std::iter::once(t).chain(torque.iter().copied()).chain(noisy);
            columns.iter_mut().zip(row).for_each(|(c, v)| c.1.push(v));
            for step in 0..20 {
                let at = t + 5e-4 * f64::from(step);
                let rates = |x: &[f64], time: f64| -> Vec<f64> {
                    let point = TrajectoryPoint { theta, state: x, torque: &torque, time };
                    x[n..].iter().copied().chain(plant.accelerations(point, &vec![0.0; n])).collect()
                };
                let ahead =
                    |by: f64, k: &[f64]| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + by * k).collect() };
                let middle = rates(&ahead(2.5e-4, &rates(&x, at)), at + 2.5e-4);
                x = ahead(5e-4, &middle);
            }
        }
        columns
    }
}

fn alone(loaded: &Loaded) -> (TrajectoryFrame, ChainNull) {
    let structures = PlantStructures::of(&loaded.case).unwrap();
    let loaded = prepared(loaded, &structures).unwrap();
    chain_null(&loaded, &structures).unwrap()
}
/// The value of a parameter after the refit of the model alone.
fn refitted((frame, null): &(TrajectoryFrame, ChainNull), name: &str) -> f64 {
    null.fit.theta[frame.plant.plant().table().parameter(name).unwrap()]
}
/// Nothing is left, and the nominal parameters do as well as refitted ones.
fn is_right(found: &(TrajectoryFrame, ChainNull)) -> bool {
    let (null, latents) = (&found.1, found.1.left.largest_of_all());
    println!("nominal {}, refitted {}, latents {latents}", null.nominal, null.fit.evidence);
    latents < 8.0 && null.nominal > null.fit.evidence - 5.0
}
fn channels<'a>(l: &'a mut Loaded, name: &'a str) -> impl Iterator<Item = &'a mut Channel> {
    l.recordings.values_mut().flat_map(|r| &mut r.channels).filter(move |c| c.name == name)
}

const WEIGHT: &[(&str, f64)] = &[("gravityTorque[1]", 0.6), ("gravityAngle[1]", 0.4)];
const SERVO: [(&str, f64); 4] = [
    ("servoProportionalGain[1]", 8.0),
    ("servoProportionalGain[2]", 4.0),
    ("servoDerivativeGain[1]", 1.5),
    ("servoDerivativeGain[2]", 0.6),
];

/// Checks EST-20.
#[test]
fn known_effects_of_an_arm_are_part_of_its_trajectory() {
    let friction: &[(&str, f64)] = &[("coulombFriction[1]", 0.15), ("viscousFriction[2]", 0.2)];
    let cases: [(&str, &[(&str, f64)], &str); 3] = [
        (
            "motor-friction",
            friction,
            "coulombFriction = [0.15, 0.0]\nviscousFriction = [0.0, 0.2]\n[effects]\nmotor-friction = {}",
        ),
        (
            "gravity-torque",
            WEIGHT,
            "[effects]\ngravity-torque = { gravityTorque = 0.6, gravityAngle = 0.4, joint = 1 }",
        ),
        (
            "current-saturation",
            &[("saturationTorque[1]", 1.2)],
            "[effects]\ncurrent-saturation = { saturationTorque = 1.2, joint = 1 }",
        ),
    ];
    for (seed, (id, values, declared)) in (810_201..).zip(cases) {
        println!("{id}, seed {seed}");
        let made = MadeArm { seed, effects: &[id], values, drive: 2.0, ..MadeArm::default() };
        assert!(is_right(&alone(&made.case(declared))), "{id}");
        assert!(!is_right(&alone(&made.case(""))), "{id} does not show");
    }
}

#[test]
fn a_size_of_a_known_effect_of_an_arm_is_refitted() {
    let made = MadeArm {
        seed: 810_211,
        effects: &["gravity-torque"],
        values: WEIGHT,
        drive: 2.0,
        ..MadeArm::default()
    };
    let found = alone(&made.case(
        "[effects]\ngravity-torque = { gravityTorque = 0.4, gravityAngle = 0.4, joint = 1, doubt = 0.5 }",
    ));
    let value = refitted(&found, "gravityTorque[1]");
    assert!((value - 0.6).abs() < 0.05, "{value}");
}

#[test]
fn a_known_effect_of_an_arm_is_no_hypothesis() {
    let made = MadeArm {
        seed: 810_212,
        effects: &["gravity-torque"],
        values: WEIGHT,
        drive: 2.0,
        ..MadeArm::default()
    };
    let loaded =
        made.case("[effects]\ngravity-torque = { gravityTorque = 0.1, gravityAngle = 0.4, joint = 1 }");
    let found = search_chain(&loaded, &PlantStructures::of(&loaded.case).unwrap()).unwrap();
    let again = |id: &str, joints: &[usize]| id == "gravity-torque" && joints.contains(&0);
    assert!(!found.screen.is_empty() && !found.screen.iter().any(|c| again(c.law.id(), &c.shape.joints)));
    assert!(!found.effects.iter().any(|h| again(h.id, &h.joints())));
}

#[test]
fn what_no_trajectory_has_is_refused_with_the_reason() {
    let made = MadeArm { seed: 810_213, drive: 2.0, ..MadeArm::default() };
    let servo = "servoProportionalGain = 8.0, servoDerivativeGain = 1.5, servoIntegralRate = 2.0";
    for (declared, why) in [
        ("transmission-hysteresis = { hysteresisTorque = 0.1, joint = 1 }", "it has states of its own"),
        (&*format!("position-servo = {{ {servo}, joint = 1 }}"), "its integral is a state of its own"),
    ] {
        let loaded = made.case(&format!("[effects]\n{declared}"));
        let error = search_case(&loaded).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains(why), "{declared}: {error}");
    }
}

#[test]
fn the_reference_of_a_servo_drives_an_arm() {
    let made = MadeArm {
        seed: 810_214,
        effects: &["position-servo"],
        values: &SERVO,
        drive: 0.5,
        ..MadeArm::default()
    };
    let gains = "servoProportionalGain = [8.0, 4.0], servoDerivativeGain = [1.5, 0.6], servoIntegralRate = [0.0, 0.0]";
    let loaded = made.case(&format!("[effects]\nposition-servo = {{ {gains} }}"));
    let (frame, null) = alone(&loaded);
    assert!(
        (frame.plant.drive_gains[0] - 8.0).abs() < 1e-6 && (frame.plant.drive_gains[1] - 4.0).abs() < 1e-6
    );
    assert!(is_right(&(frame, null)));
    let mut heavier = loaded.clone();
    heavier.case.parameters.insert("motorInertia[1]".into(), ParameterValue::Number(0.14));
    heavier.case.uncertain.insert("motorInertia[1]".into(), 0.5);
    let value = refitted(&alone(&heavier), "motorInertia[1]");
    assert!((value - 0.2).abs() < 0.01, "{value}");
}

#[test]
fn the_mass_of_a_payload_is_found_from_0() {
    let values: &[(&str, f64)] = &[("payload.mass", 1.2), ("payload.centerOfMass[1]", 0.3)];
    let made = MadeArm { seed: 810_215, payload: Some(1), values, drive: 2.0, ..MadeArm::default() };
    // Its centre is the end of the link where the case does not give it.
    let found = alone(&made.case("[payload]\nlink = 2\nmass = { value = 0.0, doubt = 2.0 }"));
    let value = refitted(&found, "payload.mass");
    assert!((value - 1.2).abs() < 0.03, "{value}");
    assert!(is_right(&alone(&made.case("[payload]\nlink = 2\nmass = { value = 1.2, doubt = 0.5 }"))));
}

#[test]
fn the_centre_of_a_payload_whose_mass_is_0_in_the_case_is_refitted() {
    let across = "payload.centerOfMass[2]";
    let values: &[(&str, f64)] = &[("payload.mass", 1.2), ("payload.centerOfMass[1]", 0.3), (across, 0.1)];
    let made = MadeArm { seed: 810_220, payload: Some(1), values, drive: 2.0, ..MadeArm::default() };
    let lines = "[payload]\nlink = 2\nmass = { value = 0.0, doubt = 2.0 }\ncenterOfMass = { value = [0.3, 0.0], doubt = 0.1 }";
    let found = alone(&made.case(lines));
    let value = refitted(&found, across);
    println!("{across} {value}");
    assert!((value - 0.1).abs() < 0.05 && found.1.left.largest_of_all() < 8.0, "{value}");
}

#[test]
fn delays_of_an_arm_are_found() {
    for (seed, name, by) in [
        (810_216, "jointAngle[2]", 0.03),
        (810_217, "jointTorque[1]", 0.023),
        (810_218, "jointAngle[1]", 0.0),
    ] {
        let mut loaded = MadeArm { seed, drive: 2.0, ..MadeArm::default() }.case("");
        for c in channels(&mut loaded, name) {
            c.time.iter_mut().for_each(|t| *t += by);
            c.sensor.late = Some(PriorGuess { value: 0.0, doubt: None });
        }
        let (frame, null) = alone(&loaded);
        let delay = frame.reported(&null.fit.doubted);
        println!("seed {seed}: {delay:?}");
        assert!(delay.len() == 1 && delay[0].0 == format!("{name}.delay"));
        assert!((delay[0].1 - by).abs() < 2e-3, "{name}: {delay:?}");
    }
}

#[test]
fn guesses_that_differ_are_numbers_of_their_recordings() {
    let mut loaded = MadeArm { seed: 810_219, drive: 2.0, ..MadeArm::default() }.case("");
    let guess = |value, doubt| Some(PriorGuess { value, doubt: Some(doubt) });
    for (c, (guessed, gain)) in channels(&mut loaded, "jointTorque[2]").zip([(1.0, 1.08), (1.05, 1.12)]) {
        c.values.iter_mut().for_each(|u| *u *= gain);
        c.sensor.gain = guess(guessed, 0.1);
    }
    for (c, by) in channels(&mut loaded, "jointAngle[2]").zip([0.02, -0.03]) {
        c.values.iter_mut().for_each(|y| *y += by);
        c.sensor.offset = guess(0.0, 0.05);
    }
    let (frame, null) = alone(&loaded);
    let single = frame.reported_of_single(&null.fit.doubted);
    println!("{single:?}");
    assert!(frame.reported(&null.fit.doubted).is_empty());
    for (name, values) in [("jointTorque[2].gain", [1.08, 1.12]), ("jointAngle[2].offset", [0.02, -0.03])] {
        for (k, value) in values.iter().enumerate() {
            let found = single.iter().find(|s| s.0 == name && s.1 == k).unwrap().2;
            assert!((found - value).abs() < 0.01, "{name}, {k}: {found}");
        }
    }
    // Offsets that are guessed alike are each recording's own, gains are one number.
    channels(&mut loaded, "jointTorque[2]").for_each(|c| c.sensor.gain = guess(1.0, 0.1));
    let (frame, null) = alone(&loaded);
    assert_eq!(frame.reported(&null.fit.doubted).len(), 1);
    assert_eq!(frame.reported_of_single(&null.fit.doubted).len(), 2);
}

#[test]
fn a_parameter_of_one_recording_that_is_0_in_the_other_is_known_there() {
    let second: &[(&str, f64)] = &[("linkCenterOfMass[2,2]", 0.06)];
    let loaded = MadeArm { seed: 810_220, second, drive: 2.0, ..MadeArm::default() }.case("");
    assert!(!is_right(&alone(&loaded)));
    let mut own = loaded;
    let name = "linkCenterOfMass[2,2]".to_owned();
    let of_second = own.recordings.get_mut("b.csv").unwrap();
    of_second.parameters.insert(name, ParameterValue::Number(0.06));
    of_second.parameters.insert("motorCoupling".into(), ParameterValue::Text("paper".into()));
    assert!(is_right(&alone(&own)));
}

#[test]
fn forces_that_were_recorded_act_and_a_motor_next_to_its_rigid_joint_is_a_second_reading() {
    let others: &[(&str, f64)] = &[("tipForce[1]", 1.0)];
    let made = MadeArm { seed: 810_221, others, more: &["motorAngle[1]"], drive: 2.0, ..MadeArm::default() };
    let loaded = made.case("");
    assert!(is_right(&alone(&loaded)));
    let mut less = loaded;
    less.recordings.values_mut().for_each(|r| r.channels.retain(|c| !c.name.starts_with("tip")));
    assert!(!is_right(&alone(&less)));
}

#[test]
fn recordings_without_a_common_reading_are_fitted_by_what_each_has() {
    let made = MadeArm {
        seed: 810_222,
        more: &["motorAngle[1]", "motorAngle[2]"],
        drive: 2.0,
        ..MadeArm::default()
    };
    let mut loaded = made.case("");
    for (r, other) in loaded.recordings.values_mut().zip(["motorAngle", "jointAngle"]) {
        r.channels.retain(|c| !c.name.starts_with(other));
    }
    assert!(is_right(&alone(&loaded)));
}

/// Intervals of a mass of the second link, which alone is estimated: all that is not named stays what the case has.
#[test]
fn only_what_is_named_of_an_arm_is_estimated() {
    let made = MadeArm { seed: 81, drive: 1.0, values: &[("linkMass[2]", 1.56)], ..MadeArm::default() };
    let loaded = made.case("[uncertain]\n\"linkMass[2]\" = 0.05");
    let structures = PlantStructures::of(&loaded.case).unwrap();
    let mut frame = chain_frame(&loaded, &structures).unwrap();
    let nominal = frame.theta.clone();
    frame.only(&["linkMass[2]"]);
    let (mut frame, _, fit) = fit_alone(frame).unwrap();
    let found = frame.estimate(&fit).unwrap();
    let named = frame.unknown[0].index;
    let moved: Vec<usize> = (0..nominal.len()).filter(|k| frame.theta[*k] != nominal[*k]).collect();
    assert_eq!(moved, [named]);
    let (mass, error) = (found.numbers[0].value, found.covariance[(0, 0)].sqrt());
    println!("{mass} +- {error} kg of 1.56");
    assert!(error < 0.01 * 1.56 && (mass - 1.56).abs() < 3.0 * error, "{mass} +- {error}");
}
