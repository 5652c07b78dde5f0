//! Sets of causes for tests: fitted to nothing, what they leave set by hand.

use nalgebra::{DMatrix, DVector};
use trueup_models::effect::{EffectChoice, PlantKind};
use trueup_models::joint::TwoMassJoint;

use super::decide::{FreeRun, FreeRunResults, LeftOut};
use super::hypothesis::{Hypothesis, HypothesisClaim, Times};
use super::search::{FittedSet, Octave, PosedSet};
use super::select::SearchResult;
use super::subject::EngineModel;

/// A cause by its label: `backlash`, `sensor-delay:motorAngle`, `backlash[2]` at a joint of an arm; what is no effect is a
/// parameter.
pub(crate) fn cause(label: &str) -> Hypothesis {
    let (name, joint) = label.split_once('[').map_or((label, None), |(name, rest)| (name, Some(rest)));
    let plant = if joint.is_some() { PlantKind::Arm } else { PlantKind::Joint };
    let choice = EffectChoice::parse(name, plant).ok();
    Hypothesis {
        claim: choice.map_or(HypothesisClaim::Parameter(0), HypothesisClaim::Effect),
        id: choice.map_or(name, |c| c.spec().id).to_owned(),
        component: choice.map_or("parameter", |c| c.component()).to_owned(),
        site: joint.map_or(0, |j| j.trim_end_matches(']').parse::<usize>().unwrap() - 1),
        per_joint: joint.is_some(),
        times: Times::Once,
        rigid: false,
        shifted: choice.is_some_and(|c| c.spec().shifts),
    }
}

/// Causes by their labels, blanks between them.
pub(crate) fn causes(labels: &str) -> Vec<Hypothesis> {
    labels.split_whitespace().map(cause).collect()
}

/// A set in numbers, without unknowns.
pub(crate) fn stated(set: Vec<Hypothesis>) -> PosedSet {
    PosedSet::of_causes(set, EngineModel::joint(TwoMassJoint::new::<&str>(true, &[]).unwrap()))
}

/// A set that leaves `power`, in units of the floor's, in each of two octaves of so many readings.
pub(crate) fn fitted(labels: &str, power: f64, readings: f64) -> FittedSet {
    let octave = Octave { squares: power * readings, expected: readings, count: readings };
    FittedSet {
        stated: stated(causes(labels)),
        theta: Vec::new(),
        residuals: DVector::zeros(0),
        jacobian: DMatrix::zeros(0, 0),
        information: DMatrix::zeros(0, 0),
        readings: 0,
        chi2: 2.0 * octave.squares,
        octaves: vec![octave; 2],
        prior2: 0.0,
        occam: 0.0,
        tightening: 1.0,
    }
}

/// Sets next to a plain model that leaves 100 floors; `best`: which of them was chosen, `None`: the plain model.
pub(crate) fn found(sets: Vec<FittedSet>, best: Option<usize>, readings: f64) -> SearchResult {
    let plain = fitted("", 100.0, readings);
    SearchResult { best: best.map_or_else(|| plain.clone(), |at| sets[at].clone()), plain, sets }
}

/// Gaps of free runs by set; how far all of them are apart; whether they are of one sensor.
#[derive(Default)]
pub(crate) struct FreeRunGaps {
    pub gaps: Vec<Option<f64>>,
    pub apart: Option<f64>,
    pub one_sensor: bool,
    pub left_out: Option<LeftOut>,
}

impl FreeRunResults for FreeRunGaps {
    fn after(&self, set: usize) -> Option<f64> {
        self.gaps[set]
    }
    fn apart(&self, _: usize, _: usize) -> Option<f64> {
        self.apart
    }
    fn one_sensor(&self) -> bool {
        self.one_sensor
    }
    fn each(&self, _: usize) -> Option<Vec<f64>> {
        None
    }
    fn left_out(&self, _: Option<usize>, _: &FittedSet) -> Option<LeftOut> {
        self.left_out
    }
}

/// A nominal model and a tuned one with that gap, in units of the floor.
pub(crate) fn free(tuned: f64) -> FreeRun {
    FreeRun {
        before: tuned,
        tuned,
        after: tuned,
        floor: 1.0,
        chance: 1.5,
        noticed: 1.2,
        trained: false,
        windowed: None,
    }
}
