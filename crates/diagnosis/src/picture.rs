//! What a case shows before any effect is named: noise floors, what the sensors can distinguish, where the model's balances
//! fail, when, and what is missing there, as pictures.
//!
//! Made of measured channels and the model's equations; nothing is simulated and nothing fitted.

mod arm;
mod joint;

use std::collections::BTreeSet;

use trueup_models::effect::PlantKind;
use trueup_signals::Loaded;

use crate::engine::subject::{DiagnosisSubject, EngineModel};
use crate::floor::{self, ChannelFloor};
use crate::locate::isolability::{EquationStructure, Isolability};
use crate::locate::map::{Curve, ForceSurface};
use crate::locate::{Bands, BoundarySide, Interval, ResidualOrder};
use crate::outcome::SensorFindings;

impl From<&Isolability> for SensorFindings {
    fn from(i: &Isolability) -> Self {
        Self { classes: i.classes.clone(), hidden: i.hidden.clone() }
    }
}

/// A component and its share of what is missing.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureComponent {
    /// As in the list of effects: `motor-friction`, `transmission`, `load`, `base`, `sensor:<channel>`.
    pub component: String,
    /// Which joint, from 1 (arms).
    pub joint: Option<usize>,
    /// Share; all together at most 1.
    pub share: f64,
}

/// A quantity over time.
#[derive(Clone, Debug, PartialEq)]
pub struct QuantityCourse {
    /// Its title.
    pub title: String,
    /// The recording.
    pub recording: String,
    /// Its unit.
    pub unit: String,
    /// Times in s.
    pub time: Vec<f64>,
    /// Values.
    pub value: Vec<f64>,
}

/// A map with its title and axes (quantity and unit).
#[derive(Clone, Debug, PartialEq)]
pub struct TitledMap<T> {
    /// Its title.
    pub title: String,
    /// Along x.
    pub x: [String; 2],
    /// Along y, of surfaces; of curves empty.
    pub y: [String; 2],
    /// Unit of what is shown.
    pub unit: String,
    /// The map.
    pub map: T,
}

/// All of it; what the channels do not allow is empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// What these sensors distinguish by structure alone.
    pub isolability: Isolability,
    /// Noise floors of all channels, inputs that are commands left out.
    pub floors: Vec<ChannelFloor>,
    /// Where the balances fail, most first.
    pub places: Vec<PictureComponent>,
    /// Of a free-floating system: inside or outside.
    pub cause: Option<BoundarySide>,
    /// When, by what is missing at the first place.
    pub intervals: Vec<Interval>,
    /// What is missing there over time.
    pub courses: Vec<QuantityCourse>,
    /// Along speed, angle and so on.
    pub curves: Vec<TitledMap<Curve>>,
    /// Over twist and its rate.
    pub surfaces: Vec<TitledMap<ForceSurface>>,
    /// Along the turns of an angle.
    pub orders: Vec<TitledMap<Vec<ResidualOrder>>>,
    /// Along frequency.
    pub bands: Vec<TitledMap<Bands>>,
}

/// What the sensors of a case distinguish by the structure of the equations alone, before anything is compared.
pub fn isolability(loaded: &Loaded, subject: &DiagnosisSubject) -> Isolability {
    let channels = channels(loaded);
    match subject.plant {
        PlantKind::Joint => {
            EquationStructure::joint(subject.flexible.first().copied().unwrap_or(true), &channels)
        }
        // What does not move is known without a sensor.
        PlantKind::Arm if subject.fixed_base => {
            let base = ["basePosition[1]", "basePosition[2]", "baseAttitude"];
            EquationStructure::arm(&subject.flexible, &[channels, base.to_vec()].concat())
        }
        PlantKind::Arm | PlantKind::Space => EquationStructure::arm(&subject.flexible, &channels),
    }
    .isolability()
}

/// Channels that any recording has.
fn channels(loaded: &Loaded) -> Vec<&str> {
    let all = loaded.recordings.values().flat_map(|r| r.channels.iter().map(|c| c.name.as_str()));
    all.collect::<BTreeSet<_>>().into_iter().collect()
}

/// The picture of a case; `p` are the parameters of the plant as the user declares it (refitted, so that a wrong parameter is not
/// interpreted as something missing).
pub fn picture(loaded: &Loaded, subject: &DiagnosisSubject, p: &[f64]) -> Picture {
    let channels = channels(loaded);
    let inputs = subject.inputs();
    let floor = |c: &&str| {
        if inputs.iter().any(|i| i == c) { floor::input(loaded, c) } else { floor::output(loaded, c) }
    };
    let floors = channels.iter().filter_map(floor).collect();
    let mut out = Picture { isolability: isolability(loaded, subject), floors, ..Picture::default() };
    match subject.model::<&str>(&[]) {
        Ok(EngineModel::Joint(joint)) => joint::look(&mut out, loaded, &joint, p),
        Ok(EngineModel::Arm(arm)) => arm::look(&mut out, loaded, &arm, p),
        Err(_) => {}
    }
    out
}

/// The noise of a channel, if it is known.
fn deviation(floors: &[ChannelFloor], channel: &str) -> Option<f64> {
    floors.iter().find(|f| f.channel == channel).map(|f| f.deviation)
}

/// What takes energy in every swing to one side is friction; what also gives some comes from the actuator.
pub(crate) fn at_motor(torque: &[f64], velocity: &[f64]) -> &'static str {
    let mut swings = vec![0.0];
    let mut side = 0.0;
    for (power, v) in torque.iter().zip(velocity).map(|(d, v)| (d * v, v)).filter(|(p, _)| p.is_finite()) {
        if v.signum() != side {
            side = v.signum();
            swings.push(0.0);
        }
        if let Some(last) = swings.last_mut() {
            *last += power;
        }
    }
    let (sum, size) = swings.iter().fold((0.0, 0.0), |(sum, size), w| (sum + w, size + w.abs()));
    if sum < -0.6 * size { "motor-friction" } else { "actuator" }
}

fn titled<T>(title: &str, x: [&str; 2], unit: &str, map: T) -> TitledMap<T> {
    let y = [String::new(), String::new()];
    TitledMap { title: title.into(), x: x.map(str::to_owned), y, unit: unit.into(), map }
}
