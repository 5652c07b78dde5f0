//! What is said of a case: by what each hypothesis gains, in nats, and by which share it explains of what could be gained.

use trueup_estimation::fit::Fit;

use crate::levels::{ALONE, APART, EXPLAINED, FRICTION, NOTICED, SECOND_TO_FIRST, SHARE, TEMPERATURE};
use crate::refit::Refitted;
use crate::search::Found;

/// What is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Nothing lacks, and the parameters are as their owner has them.
    NoGap,
    /// Nothing lacks but other parameters.
    Parameters,
    /// One cause, or two.
    Effects,
    /// One of several causes that are not told apart.
    Ambiguous,
    /// Something that no cause explains.
    Unknown,
}

/// A verdict.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// What is said.
    pub kind: Kind,
    /// Where causes are claimed: the likeliest two, not the likeliest one.
    pub two: bool,
    /// Share of what could be gained that the likeliest set gains, or of the latent torques' power that it takes, whichever is
    /// more: where readings miss for another reason besides, no set gains all.
    pub share: f64,
    /// Probability that no cause is right.
    pub unknown: f64,
    /// Of each single its odds beside the first (natural logarithm, tempered, at most 0).
    pub odds: Vec<f64>,
    /// Of each single its probability; they and `unknown` make 1.
    pub probabilities: Vec<f64>,
}

/// Judges what was found.
pub fn judge(found: &Found) -> Verdict {
    let base = found.baseline.fit.log_evidence;
    let gain = |fit: &Fit| fit.log_evidence - base;
    let best = found.singles.first().map_or(0.0, |r| gain(&r.fit));
    let doubted = found.doubted.as_ref().map_or(0.0, gain);
    let moved = found.baseline.held.as_ref().map_or(0.0, |h| base - h.log_evidence);
    let could = (found.ideal - base).max(best).max(1.0);
    let pair = pair(found);
    let most = pair.map_or(best, |r| gain(&r.fit)).max(best);
    let leader = pair.or(found.singles.first());
    let calmed = leader.map_or(0.0, |r| 1.0 - lacking(found, &r.fit) / lacking(found, &found.baseline.fit));
    let share = (most / could).max(calmed);
    let lacks = found.ideal - base > NOTICED && found.baseline.lacks();
    let friction = found.singles.first().is_some_and(|r| r.seen.cause.choice.spec().friction);
    let alone = if friction { FRICTION } else { ALONE };
    let kind = if best < alone && doubted < alone {
        match (lacks, moved > NOTICED) {
            (true, _) => Kind::Unknown,
            (false, true) => Kind::Parameters,
            (false, false) => Kind::NoGap,
        }
    } else if doubted >= best - NOTICED {
        if doubted >= EXPLAINED * could { Kind::Parameters } else { Kind::Unknown }
    } else if share < SHARE || leader.is_some_and(|r| found.baseline.at_ceiling(&r.fit)) {
        Kind::Unknown
    } else {
        Kind::Effects
    };
    // Readings tell less than they would if the model's form were right.
    let odds: Vec<f64> = found.singles.iter().map(|r| (gain(&r.fit) - best) / TEMPERATURE).collect();
    let near = pair.is_none() && odds.iter().skip(1).any(|o| -o < APART);
    let unknown = match kind {
        Kind::NoGap | Kind::Parameters => 0.0,
        Kind::Effects | Kind::Ambiguous => (SHARE / share).powi(2).min(0.5),
        Kind::Unknown => 1.0,
    };
    let sum: f64 = odds.iter().map(|o| o.exp()).sum::<f64>().max(f64::MIN_POSITIVE);
    let probabilities = odds.iter().map(|o| (1.0 - unknown) * o.exp() / sum).collect();
    let kind = if kind == Kind::Effects && near { Kind::Ambiguous } else { kind };
    Verdict { kind, two: pair.is_some(), share, unknown, odds, probabilities }
}

/// Power of the latent torques, in units of the typical torque's.
fn lacking(found: &Found, fit: &Fit) -> f64 {
    let torques = found.baseline.sizes.torques();
    fit.latent.iter().zip(torques).map(|(l, t)| (l.deviation / t).powi(2)).sum()
}

/// The likeliest pair, where its second cause brings enough beside what the first one brings.
fn pair(found: &Found) -> Option<&Refitted> {
    let (first, pair) = (found.singles.first()?, found.pairs.first()?);
    let brings = |r: &Refitted, beside: &Refitted| r.fit.log_evidence - beside.fit.log_evidence;
    let leader = &found.singles[pair.0];
    let brought = leader.fit.log_evidence - found.baseline.fit.log_evidence;
    let enough = brings(&pair.1, first) > NOTICED && brings(&pair.1, leader) > SECOND_TO_FIRST * brought;
    enough.then_some(&pair.1)
}
