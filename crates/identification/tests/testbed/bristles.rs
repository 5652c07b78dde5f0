//! The five tests of the test-bed (S0, section 4) as they would be if its spring had bristles: friction in the spring
//! by Dahl's law, the effect `transmission-hysteresis`. As files: a case for `identify`.

use std::fmt::Write as _;
use std::path::Path;

use trueup_identification::flexible_joint::sight;
use trueup_identification::identify::{
    ExperimentDesign, FoundParameter, Identified, IdentifyMethod, IdentifySettings, identify,
};
use trueup_identification::model::SimulatedPlant;
use trueup_models::arm::{Replay, output};
use trueup_models::plants::PlantStructure;
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_signals::Case;

use super::{Noise, reference, times, torque};

/// The effect.
pub(crate) const EFFECT: &str = "transmission-hysteresis";
/// What is true in all five tests: averages of S0 and the stiffness of its CAD model, as elsewhere here; bristles that make
/// stiffness and damping scatter about as much as in S0 where they are not fitted.
pub(crate) const TRUTH: [(&str, f64); 5] = [
    ("motorInertia[1]", 5.6),
    ("jointStiffness[1]", 5.47),
    ("jointDamping[1]", 0.5),
    ("hysteresisTorque[1]", 0.03),
    ("hysteresisDisplacement[1]", 0.002),
];
/// Initial offset of the spring in deg, test by test: those of tests 2 and 3 are printed, the others are below test 2's.
pub(crate) const OFFSETS: [f64; 5] = [0.5, 2.8, -0.2, 1.5, 1.0];
/// Deviation of an angle by eq. 21 in rad, from 1 mm and 0.1 deg.
pub(crate) const SEEN: f64 = 2.7e-3;

/// One recording: time, torque of joint 1, its angle as seen, encoders of joints 2 and 3.
fn csv(model: &SimulatedPlant, truth: &[(&str, f64)], offset: f64, noise: &mut Noise) -> String {
    let mut p = model.defaults();
    let mut set = |name: &str, value: f64| p[model.parameter(name).unwrap()] = value;
    truth.iter().for_each(|(name, value)| set(name, *value));
    for j in 0..3 {
        set(&format!("initialJointAngle[{}]", j + 1), reference(j, 0.0));
    }
    set("initialMotorAngle[1]", reference(0, 0.0));
    set("initialJointAngle[1]", reference(0, 0.0) + offset.to_radians());
    let input = |name: &str| model.input(name).unwrap();
    let (drive, led) = (input("jointTorque[1]"), [2, 3].map(|j| input(&format!("motorAcceleration[{j}]"))));
    let inputs = |t: f64, u: &mut [f64]| {
        u.fill(0.0);
        u[drive] = torque(t);
        u[led[0]] = -0.6f64.to_radians();
        u[led[1]] = -0.75f64.to_radians();
    };
    let options = DriverOptions { tolerance: 1e-10, ..DriverOptions::default() };
    let replay = Replay::new(model.arm().unwrap().clone(), &model.structure().led).unwrap();
    let sim = simulate(&replay, &p, &vec![0.01; model.sizes().states], options, &inputs, &times()).unwrap();
    let (mm, deg) = (1e-3, 0.1f64.to_radians());
    let (mut base, mut tip, mut joints) = (Vec::new(), Vec::new(), vec![Vec::new(); 3]);
    for y in &sim.y {
        let [x0, y0] = [0, 1].map(|i| y[output::base_position(3) + i] + mm * noise.next());
        base.push([x0, y0, y[output::base_attitude(3)] + deg * noise.next()]);
        tip.push([0, 1].map(|i| y[output::tip_position(3) + i] + mm * noise.next()));
        (0..3).for_each(|j| joints[j].push(y[output::joint_angle(3) + j]));
    }
    let seen = sight(&p, 0, &base, &joints, &tip);
    let mut text = "time,jointTorque[1],jointAngle[1],motorAngle[2],motorAngle[3]\n".to_owned();
    for (k, t) in times().iter().enumerate() {
        let _ = writeln!(text, "{t},{},{},{},{}", torque(*t), seen.angle[k], joints[1][k], joints[2][k]);
    }
    text
}

/// The recordings of a campaign in a folder, begun at these offsets in deg: `test-1.csv` and so on, each with what is known of its
/// beginning.
pub(crate) fn record(folder: &Path, truth: &[(&str, f64)], offsets: &[f64], seed: u64) {
    let structure = PlantStructure {
        model: "PlanarManipulator".into(),
        flexible: vec![true, false, false],
        effects: vec![EFFECT.into()],
        led: vec![1, 2],
        ..PlantStructure::default()
    };
    let model = SimulatedPlant::new(structure).unwrap();
    let mut noise = Noise(seed);
    let known = format!(
        "[parameters]\n\"initialMotorAngle[1]\" = {}\n\"initialMotorVelocity[1]\" = 0.0\n\"initialJointVelocity[1]\" = 0.0\n\
         initialBasePosition = [0.0, 0.0]\ninitialBaseVelocity = [0.0, 0.0]\ninitialBaseAttitude = 0.0\ninitialBaseRate = 0.0\n",
        reference(0, 0.0)
    );
    for (k, offset) in offsets.iter().enumerate() {
        let name = format!("test-{}.csv", k + 1);
        std::fs::write(folder.join(&name), csv(&model, truth, *offset, &mut noise)).unwrap();
        std::fs::write(folder.join(format!("{name}.toml")), &known).unwrap();
    }
}

/// Identifies some tests of a campaign (from 1), compared on others, with the bristles or without; begun at what the paper has for
/// test 1.
pub(crate) fn identified(folder: &Path, train: &[usize], holdout: &[usize], bristles: bool) -> Identified {
    designed(folder, train, holdout, bristles, None)
}

/// The same, and what runs from other starts would identify.
pub(crate) fn designed(
    folder: &Path,
    train: &[usize],
    holdout: &[usize],
    bristles: bool,
    design: Option<&ExperimentDesign>,
) -> Identified {
    let names =
        |list: &[usize]| list.iter().map(|k| format!("\"test-{k}.csv\"")).collect::<Vec<_>>().join(", ");
    let text = format!(
        "model = \"PlanarManipulator\"\ntrain = [{}]\nholdout = [{}]\n[parameters]\n\"motorInertia[1]\" = 6.9\n\
         \"jointStiffness[1]\" = 12.8\n\"jointDamping[1]\" = 1.3\n[channels.\"jointAngle[1]\"]\nnoise = {SEEN}\n\
         [channels.motorAngle]\nnoise = 1e-7\n",
        names(train),
        names(holdout)
    );
    // Each its own file: they may be read at the same time.
    let mark = |list: &[usize]| list.iter().map(usize::to_string).collect::<String>();
    let file = folder.join(format!("{}-{}-{bristles}.toml", mark(train), mark(holdout)));
    std::fs::write(&file, text).unwrap();
    let with = if bristles { vec![EFFECT.to_owned()] } else { Vec::new() };
    let effects: Vec<&str> = with.iter().map(String::as_str).collect();
    let (mut loaded, _) =
        Case::load(&file, |c| Ok(SimulatedPlant::of_case(c, &effects).unwrap().variables())).unwrap();
    loaded.case.with = with.clone();
    let settings =
        IdentifySettings { method: IdentifyMethod::OutputError, profile: false, design, progress: &|_| () };
    identify(&loaded, &settings).unwrap()
}

/// What was found of a parameter.
pub(crate) fn found<'a>(r: &'a Identified, name: &str) -> &'a FoundParameter {
    r.parameters.iter().find(|f| f.estimate.name == name).unwrap()
}

/// Standard deviation over mean.
pub(crate) fn scatter(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt() / mean
}
