//! What may be missing of a joint.

use trueup_models::effect::{Choice, Neutral, Plant, Scope};
use trueup_models::joint::{output, parameter as q};

use crate::baseline::Baseline;

/// An effect that may be missing, in its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Which.
    pub choice: Choice,
    /// The output that a sensor's error is in.
    pub output: Option<usize>,
}

impl Cause {
    /// Its id, the place behind a colon.
    pub fn label(&self) -> String {
        self.choice.id()
    }
    /// Whether the model is built with it; what only moves signals in time is not.
    pub fn built(&self) -> bool {
        !self.choice.spec().shifts
    }
    /// The joint has another structure with it: no column about the baseline tells what it does.
    pub fn restructures(&self) -> bool {
        self.choice.spec().borrows.iter().any(|b| matches!(b.neutral, Neutral::Structure))
    }
    /// What is read is another motion with it: friction holds the motor elsewhere.
    pub fn moves_readings(&self) -> bool {
        !self.built() || self.output.is_some() || self.restructures()
    }
    /// A push that comes and goes.
    pub fn is_push(&self) -> bool {
        self.choice.spec().pulses > 0
    }
}

/// Everything that may be missing.
pub fn all(baseline: &Baseline) -> Vec<Cause> {
    let sensed = |choice: &Choice| {
        let name = choice.place().map_or("", |p| p.name);
        output::NAMES.iter().position(|n| n.0 == name)
    };
    let cause = |choice: Choice| {
        let output = if choice.scope() == Scope::Channel { Some(sensed(&choice)?) } else { None };
        Some(Cause { choice, output })
    };
    Choice::all(Plant::Joint).filter_map(cause).filter(|c| possible(baseline, c)).collect()
}

/// It is not there already, and something would show it. What does nothing in these recordings has no column.
fn possible(baseline: &Baseline, cause: &Cause) -> bool {
    let (p, spec) = (&baseline.parametric.p, cause.choice.spec());
    let flexible = baseline.parametric.joint.flexible();
    if spec.installed || baseline.causes.contains(cause) {
        return false;
    }
    if let Some(output) = cause.output {
        return baseline.fit.runs.iter().any(|r| r.recording.channel(output).is_some());
    }
    if spec.compliant && !flexible {
        return false;
    }
    // What the plant has of itself is no effect that is missing.
    let has = spec.borrows.iter().any(|b| {
        let at = q::NAMES.iter().position(|n| n.0 == b.joint_name);
        match b.neutral {
            Neutral::Value(v) => at.is_some_and(|i| p[i] > v),
            Neutral::Of(base) => {
                let base = q::NAMES.iter().position(|n| n.0 == base);
                at.zip(base).is_some_and(|(i, k)| p[i] > p[k])
            }
            Neutral::Structure => flexible,
        }
    });
    let friction = spec.friction && spec.borrows.is_empty();
    !has && (!friction || p[q::COULOMB_FRICTION] > 0.0)
}
