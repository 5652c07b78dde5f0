//! Sets of causes for tests: fitted to nothing, what they leave set by hand.

use nalgebra::DMatrix;
use trueup_models::effect::{EffectChoice, PlantKind};
use trueup_models::joint::TwoMassJoint;

use super::hypothesis::{Hypothesis, Times};
use super::result::SearchResult;
use super::search::{FittedSet, Octave, PosedSet};
use super::subject::EngineModel;

/// A cause by its label: `backlash`, `sensor-delay:motorAngle`, `backlash[2]` at a joint of an arm.
pub(crate) fn cause(label: &str) -> Hypothesis {
    let (name, joint) = label.split_once('[').map_or((label, None), |(name, rest)| (name, Some(rest)));
    let plant = if joint.is_some() { PlantKind::Arm } else { PlantKind::Joint };
    let choice = EffectChoice::parse(name, plant).unwrap();
    Hypothesis {
        choice,
        id: choice.spec().id.to_owned(),
        component: choice.component().to_owned(),
        site: joint.map_or(0, |j| j.trim_end_matches(']').parse::<usize>().unwrap() - 1),
        per_joint: joint.is_some(),
        times: Times::Once,
        rigid: false,
        shifted: choice.spec().shifts,
    }
}

/// Causes by their labels, blanks between them.
pub(crate) fn causes(labels: &str) -> Vec<Hypothesis> {
    labels.split_whitespace().map(cause).collect()
}

/// A set in numbers, without unknowns.
pub(crate) fn stated(set: Vec<Hypothesis>) -> PosedSet {
    PosedSet {
        model: EngineModel::joint(TwoMassJoint::new::<&str>(true, &[]).unwrap()),
        nominal: Vec::new(),
        ties: Vec::new(),
        unknowns: Vec::new(),
        begin: vec![0; set.len()],
        posed: Vec::new(),
        free: None,
        belief: None,
        set,
    }
}

/// A set that leaves `power`, in units of the floor's, in each of two octaves of so many readings.
pub(crate) fn fitted(labels: &str, power: f64, readings: f64) -> FittedSet {
    let octave = Octave { squares: power * readings, expected: readings, count: readings };
    FittedSet {
        stated: stated(causes(labels)),
        theta: Vec::new(),
        information: DMatrix::zeros(0, 0),
        readings: 0,
        chi2: 2.0 * octave.squares,
        octaves: vec![octave; 2],
        prior2: 0.0,
        occam: 0.0,
    }
}

/// Sets next to a plain model that leaves 100 floors; `best`: which of them was chosen, `None`: the plain model.
pub(crate) fn found(sets: Vec<FittedSet>, best: Option<usize>, readings: f64) -> SearchResult {
    let plain = fitted("", 100.0, readings);
    SearchResult { best: best.map_or_else(|| plain.clone(), |at| sets[at].clone()), plain, sets }
}
