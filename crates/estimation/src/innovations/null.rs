//! The model without any effect: determined with nominal values, and with its parameters refitted.

use std::rc::Rc;

use trueup_signals::Loaded;

use super::frame::{INTENSITY, InnovationsFrame};
use super::rig::RigTerms;
use super::unread::{UnreadFigures, is_estimated, unread};

/// Nats that a refit of the parameters has to gain before rest and noise are determined again with them.
const AGAIN: f64 = 30.0;
/// Nats from which on hypotheses begin with the refitted parameters.
const BEGIN: f64 = 100.0;
/// Standard deviations from nominal that a hypothesis begins at most: a refit without it can be far out.
const NEAR: f64 = 2.5;
/// Relative standard deviation of a parameter that is held.
const HELD: f64 = 1e-4;
/// What replaces a standard deviation that is not declared.
const UNDECLARED: f64 = 0.1;

/// The model alone.
#[derive(Clone, Debug)]
pub struct FittedNull {
    /// Evidence and intensities with the nominal parameters.
    pub nominal: (f64, Vec<f64>),
    /// Evidence with refitted parameters.
    pub evidence: f64,
    /// Intensities there.
    pub q: Vec<f64>,
    /// Parameters there.
    pub theta: Vec<f64>,
    /// What the rig adds to readings there, and the zeros.
    pub zeros: Vec<f64>,
    /// Names of those of the plant: FMU variables.
    pub names: Vec<&'static str>,
    /// What the others are.
    pub rig: Rc<RigTerms>,
    /// Squares that are left, per reading.
    pub squares: f64,
    /// Readings that count.
    pub count: usize,
    /// Farthest parameter from the nominal value, in its standard deviations.
    pub farthest: f64,
    /// Nats that the latents are worth there.
    pub latents: f64,
    /// Intensities with which hypotheses begin.
    pub begin: Vec<f64>,
    /// Figures of channels that are not read.
    pub unread: UnreadFigures,
}

/// Settles a frame and fits its parameters; leaves it where hypotheses begin.
pub fn fit_null(f: &mut InnovationsFrame) -> FittedNull {
    f.settle(false);
    let (packed, mut priors) = f.packed(&[]);
    priors.deviation[..f.unknown.len() + f.intake.rig.assumed()].fill(HELD);
    let held = (packed, priors);
    let q = f.q.clone();
    let from = f.best_of(&held, &[q]);
    let best = f.search_intensities(&held, from, 2);
    let nominal = (best.found.log, best.q);
    let mut best = f.fit(&|_| Vec::new(), &f.q.clone(), 8, true);
    if best.evidence < f.evidence {
        (best.evidence, best.q) = (f.evidence, f.q.clone());
    } else if best.evidence > f.evidence + AGAIN {
        let kept = f.clone();
        f.start.clone_from(&best.theta);
        f.theta.clone_from(&best.theta);
        f.q.clone_from(&best.q);
        f.settle(false);
        let again = f.fit(&|_| Vec::new(), &f.q.clone(), 8, true);
        if again.evidence > best.evidence {
            best = again;
        } else {
            *f = kept;
        }
    }
    let parameters = f.plant.parameters().to_vec();
    let values: Vec<f64> = (0..f.theta.len()).map(|k| f.believed(k)[0]).collect();
    let far = |k: &usize| {
        let [value, deviation] = f.believed(*k);
        let declared = parameters.get(*k).is_none_or(|p| p.declared);
        (best.theta[*k] / value - 1.0).abs() / if declared { deviation } else { UNDECLARED }
    };
    let farthest = f.unknown.iter().map(far).fold(0.0, f64::max);
    f.reset(&best.q);
    f.theta.clone_from(&best.theta);
    f.put_in_force(&[], &[], &best.zeros, &best.q);
    let base = f.packed(&[]);
    let none = vec![INTENSITY[0]; best.q.len()];
    let worth: Vec<f64> = f.evidences_of(&base, &[best.q.clone(), none]).iter().map(|e| e.log).collect();
    let latents = worth[0] - worth[1];
    if best.evidence > f.evidence + BEGIN || f.start != values {
        f.start.clone_from(&best.theta);
        for k in &f.unknown.clone() {
            let [value, deviation] = f.believed(*k);
            let near = NEAR * deviation;
            f.start[*k] = f.start[*k].clamp(value * (1.0 - near), value * (1.0 + near));
        }
        f.q.clone_from(&best.q);
    }
    let begin = f.q.clone();
    f.reset(&begin);
    FittedNull {
        nominal,
        evidence: best.evidence,
        q: best.q,
        theta: best.theta,
        zeros: best.zeros,
        names: parameters.iter().map(|p| p.name).collect(),
        rig: f.intake.rig.clone(),
        squares: best.squares,
        count: best.count,
        farthest,
        latents,
        begin,
        unread: UnreadFigures::default(),
    }
}

/// Figures of channels that the frame does not read, along the trajectory of the model alone.
pub fn unread_of_null(loaded: &Loaded, frame: &InnovationsFrame, null: &FittedNull) -> UnreadFigures {
    let train = loaded.train();
    let mut channels = train.iter().flat_map(|r| &r.channels);
    if channels.all(|c| !is_estimated(&c.sensor) || frame.plant.has_channel(&c.name)) {
        return UnreadFigures::default();
    }
    let mut along = frame.clone();
    along.theta.clone_from(&null.theta);
    along.put_in_force(&[], &[], &null.zeros, &null.q);
    unread(loaded, &along)
}
