//! What a search found in the case of any plant, as a report takes it: effects with their places and parameters, evidences, the verdict.
//!
//! A joint and a chain are searched in frames of their own; from here on they are alike.

use std::rc::Rc;

use trueup_estimation::innovations::foreign::ForeignJoint;
use trueup_estimation::innovations::intensity::power;
use trueup_estimation::innovations::joint_frame::JointFrameError;
use trueup_estimation::innovations::plant::ForcedPlant;
use trueup_estimation::innovations::sensed::without_sensor_effects;
use trueup_estimation::innovations::trajectory::fit::TrajectoryFit;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::structures::{CasePlantError, PlantStructures};
use trueup_signals::Loaded;

use super::along::PlantAlong;
use super::candidate::ScreenedShape;
use super::chain_along::{ChainSizes, FrameMechanics, along_chain};
use super::chain_effect::{ChainEffect, place_of};
use super::chain_form::EffectForm;
use super::chain_pairs::ChainPair;
use super::chain_search::{ChainFindings, ChainSearchError, search_chain};
use super::chain_verdict::{judge_chain, other_stiffnesses, refit};
use super::hypothesis::FittedEffect;
use super::joint_along::{UsualSizes, along_joint};
use super::law::{LawFit, LawValue};
use super::laws::{LawRef, law_of};
use super::pairs::FittedPair;
use super::search::{JointFindings, search_joint, search_plant};
use super::shape::LawShape;
use super::verdict::{EvidenceJudgement, ReportedEffect, judge};

/// A case that cannot be searched.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CaseSearchError {
    /// A joint.
    #[error(transparent)]
    Joint(#[from] JointFrameError),
    /// A chain.
    #[error(transparent)]
    Chain(#[from] ChainSearchError),
    /// Its plant.
    #[error(transparent)]
    Plant(#[from] CasePlantError),
    /// What was found cannot be put into the model.
    #[error("{0}")]
    Made(String),
    /// Nothing to compare with the model alone.
    #[error("{file}: no hypothesis could be compared")]
    Nothing {
        /// The case.
        file: String,
    },
}

/// An effect at one place where its fit ended.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundCause {
    /// Its id in the list of effects.
    pub id: &'static str,
    /// Where it acts, of a reading `sensor:` with the channel.
    pub place: String,
    /// Joint, from 0; 0 of what acts at none.
    pub joint: usize,
    /// Impulses in a recording.
    pub impulses: usize,
    /// Its parameters, and those of the plant that are others with it.
    pub values: Vec<LawValue>,
}

impl FoundCause {
    /// Whether it has a value that only one recording has.
    pub fn is_of_single_recordings(&self) -> bool {
        self.values.iter().any(|v| v.recording.is_some())
    }
}

/// What was fitted together: an effect, at one place or several, or two of them.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundEffect {
    /// Effect and place as the verdict has them; of two those of the first.
    pub key: ReportedEffect,
    /// Log evidence, nats.
    pub evidence: f64,
    /// Power of the latents that are left.
    pub power: f64,
    /// The plant's parameters, behind them gains, offsets that are common and delays.
    pub theta: Vec<f64>,
    /// Offsets of readings, and gains and offsets that only some recordings have: names, recordings, values.
    pub offsets: Vec<(String, usize, f64)>,
    /// Places at which it acts.
    pub causes: Vec<FoundCause>,
}

/// All that is reported of a search.
pub struct CaseFindings {
    /// Names of the plant's parameters: FMU variables.
    pub names: Vec<String>,
    /// The model alone, its parameters refitted: no cause.
    pub alone: FoundEffect,
    /// Effects, best first.
    pub effects: Vec<FoundEffect>,
    /// What else the screen has, best first, with its evidence there: not fitted, no values.
    pub screened: Vec<FoundEffect>,
    /// The two effects that the verdict names.
    pub pair: Option<FoundEffect>,
    /// The verdict.
    pub judged: EvidenceJudgement,
}

/// Searches a case and judges what was found.
///
/// # Errors
/// See [`CaseSearchError`].
pub fn search_case(loaded: &Loaded) -> Result<CaseFindings, CaseSearchError> {
    let loaded = &*without_sensor_effects(loaded);
    match search_joint(loaded) {
        Ok(found) => {
            let file = loaded.case.file.display().to_string();
            let judged = judge(&found).ok_or(CaseSearchError::Nothing { file })?;
            Ok(of_joint(&found, judged))
        }
        Err(JointFrameError::Model { .. }) => {
            let structures = PlantStructures::of(&loaded.case)?;
            Ok(of_chain(&search_chain(loaded, &structures)?))
        }
        Err(e) => Err(e.into()),
    }
}

/// The same with a joint that is an FMU of others as its plant, whose channels have the names of its readings and inputs.
///
/// # Errors
/// See [`CaseSearchError`].
pub fn search_foreign(loaded: &Loaded, joint: &ForeignJoint) -> Result<CaseFindings, CaseSearchError> {
    let found = search_plant(loaded, &(Rc::new(joint.clone()) as Rc<dyn ForcedPlant>))?;
    let file = loaded.case.file.display().to_string();
    let judged = judge(&found).ok_or(CaseSearchError::Nothing { file })?;
    Ok(of_joint(&found, judged))
}

fn of_joint(found: &JointFindings, judged: EvidenceJudgement) -> CaseFindings {
    let (null, sizes) = (&found.null, &found.sizes);
    let own = null.names.len();
    let of_rig = |theta: &[f64], zeros: &[f64]| -> (Vec<String>, Vec<f64>) {
        let unread = null.unread.values.iter().cloned();
        null.rig.reported(&theta[own..], zeros).into_iter().chain(unread).unzip()
    };
    let values = |theta: &[f64], zeros: &[f64]| [&theta[..own], &of_rig(theta, zeros).1].concat();
    let offsets = |theta: &[f64], zeros: &[f64]| {
        [null.rig.reported_of_single(&theta[own..], zeros), null.unread.offsets.clone()].concat()
    };
    let key = |(id, place): (&'static str, &'static str)| -> ReportedEffect { (id, place.to_owned()) };
    let effect = |h: &FittedEffect| FoundEffect {
        key: key(h.key()),
        evidence: h.evidence,
        power: h.power(),
        theta: values(&h.fit.theta, &h.fit.zeros),
        offsets: offsets(&h.fit.theta, &h.fit.zeros),
        causes: vec![joint_cause(h, (h.id, &h.shape), &h.fit.amplitudes, &h.fit.theta, sizes)],
    };
    let together = |p: &&FittedPair| judged.set == [p.first, p.second].map(key);
    let pair = found.pairs.iter().find(together).and_then(|p| {
        let h = found.effects.iter().find(|h| h.key() == p.first)?;
        let (a, b) = p.fit.amplitudes.split_at(p.of_first.min(p.fit.amplitudes.len()));
        let cause = |id, shape, amplitudes| joint_cause(h, (id, shape), amplitudes, &p.fit.theta, sizes);
        Some(FoundEffect {
            key: key(p.first),
            evidence: p.evidence,
            power: power(&p.fit.q),
            theta: values(&p.fit.theta, &p.fit.zeros),
            offsets: offsets(&p.fit.theta, &p.fit.zeros),
            causes: vec![cause(h.id, &h.shape, a), cause(p.second.0, &p.shape, b)],
        })
    });
    CaseFindings {
        names: null.names.iter().map(|n| (*n).to_owned()).chain(of_rig(&null.theta, &null.zeros).0).collect(),
        alone: FoundEffect {
            key: ("", String::new()),
            evidence: null.evidence,
            power: power(&null.q),
            theta: values(&null.theta, &null.zeros),
            offsets: offsets(&null.theta, &null.zeros),
            causes: Vec::new(),
        },
        effects: found.effects.iter().map(effect).collect(),
        screened: Vec::new(),
        pair,
        judged,
    }
}

/// In the frame of a hypothesis, with parameters of the plant.
fn joint_cause(
    h: &FittedEffect,
    (id, shape): (&'static str, &LawShape),
    amplitudes: &[f64],
    theta: &[f64],
    sizes: &UsualSizes,
) -> FoundCause {
    let values = law_of(id).map_or_else(Vec::new, |law| {
        let frame = &mut *h.frame.borrow_mut();
        let kept = std::mem::replace(&mut frame.theta, theta.to_vec());
        let along = along_joint(frame, sizes);
        frame.theta = kept;
        let channel = along.channels.iter().position(|c| c.place == shape.place);
        law.values(&LawFit { along: &along, shape, joint: 0, channel, amplitudes, put_back: false })
    });
    FoundCause { id, place: shape.place.to_owned(), joint: 0, impulses: shape.pulses.len(), values }
}

/// Those of a chain.
pub fn of_chain(found: &ChainFindings) -> CaseFindings {
    let (null, judged) = (&found.null, judge_chain(found));
    let mut effects: Vec<FoundEffect> = found.effects.iter().map(|h| chain_effect(h, &found.sizes)).collect();
    // Friction of a rigid joint is of one body, whichever of both has it.
    let other = judged.set.iter().find(|key| !effects.iter().any(|h| h.key == **key));
    if let (Some(key), Some(lead)) = (other.filter(|_| judged.set.len() > 1), effects.first()) {
        let causes = lead.causes.iter().map(of_load).collect();
        effects.insert(1, FoundEffect { key: key.clone(), causes, ..lead.clone() });
    }
    let frame = found.effects.first().map(|h| &h.frame);
    let table = frame.map(|f| f.plant.plant().table().parameters.clone());
    let rig = frame.map_or_else(Vec::new, |f| f.reported(&null.fit.doubted));
    let pair = found.pairs.iter().find(|p| judged.set == p.named());
    let names = table.into_iter().flatten().map(|q| q.name).chain(rig.iter().map(|r| r.0.clone()));
    let names: Vec<String> = names.collect();
    CaseFindings {
        alone: FoundEffect {
            key: ("", String::new()),
            evidence: null.fit.evidence,
            power: null.left.power(),
            theta: refitted(found, &names),
            offsets: frame.map_or_else(Vec::new, |f| f.reported_of_single(&null.fit.doubted)),
            causes: Vec::new(),
        },
        names,
        screened: screened(found),
        pair: pair.map(|p| chain_pair(p, &found.sizes)),
        effects,
        judged,
    }
}

/// Parameters of the refit: where other stiffnesses alone gain more, those with them.
fn refitted(found: &ChainFindings, names: &[String]) -> Vec<f64> {
    let Some(h) = refit(found) else {
        let frame = found.effects.first().map(|h| &h.frame);
        return frame.map_or_else(Vec::new, |f| chain_theta(f, &found.null.fit));
    };
    let mut theta = chain_theta(&h.frame, &h.fit);
    for (joint, stiffer) in other_stiffnesses(h).unwrap_or_default() {
        let name = format!("jointStiffness[{}]", joint + 1);
        names.iter().zip(&mut theta).filter(|(n, _)| **n == name).for_each(|(_, k)| *k *= stiffer);
    }
    theta
}

/// Friction of the motor as that of the load that is one body with it.
fn of_load(cause: &FoundCause) -> FoundCause {
    let name = |of: &'static str| match of {
        "coulombFriction" => "loadFriction",
        "viscousFriction" => "loadViscousFriction",
        "preslidingDisplacement" => "loadFrictionDisplacement",
        other => other,
    };
    let values = cause.values.iter().map(|v| LawValue { name: name(v.name), ..*v }).collect();
    FoundCause { id: "load-friction", place: "load".to_owned(), values, ..cause.clone() }
}

/// Parameters, behind them gains and offsets.
fn chain_theta(frame: &TrajectoryFrame, fit: &TrajectoryFit) -> Vec<f64> {
    let rig = frame.reported(&fit.doubted).into_iter().map(|r| r.1);
    fit.theta.iter().copied().chain(rig).collect()
}

fn chain_effect(h: &ChainEffect, sizes: &ChainSizes) -> FoundEffect {
    let causes = match &h.form {
        Some(form) => {
            let forms = [(form, Some(&h.shape).filter(|_| h.apart))];
            chain_causes(h, &forms, &h.fit.theta, &h.fit.amplitudes, sizes)
        }
        None => vec![FoundCause {
            id: h.id,
            place: h.shape.place.to_owned(),
            joint: h.shape.joint(),
            impulses: 0,
            values: Vec::new(),
        }],
    };
    let (evidence, power) = (h.evidence, h.left.power());
    let (theta, offsets) = (chain_theta(&h.frame, &h.fit), h.frame.reported_of_single(&h.fit.doubted));
    FoundEffect { key: (h.id, h.place()), evidence, power, theta, offsets, causes }
}

/// Families of the screen that gain there and were not fitted.
fn screened(found: &ChainFindings) -> Vec<FoundEffect> {
    let Some(frame) = found.effects.first().map(|h| &h.frame) else { return Vec::new() };
    let null = &found.null;
    let names: Vec<&str> = frame.intake.channels.iter().map(|c| &*c.name).collect();
    let fitted = |c: &ScreenedShape| {
        found.effects.iter().any(|h| h.key() == (c.law.id(), c.shape.place, &c.shape.channels))
    };
    let gain = |c: &ScreenedShape| c.evidence - found.base;
    let left = found.screen.iter().filter(|c| gain(c) > 0.0 && !fitted(c));
    let effect = |c: &ScreenedShape| {
        let shape = &c.shape;
        let cause = |joint, channel: Option<usize>| FoundCause {
            id: c.law.cause(shape),
            place: place_in(&names, shape, channel),
            joint,
            impulses: shape.pulses.len(),
            values: Vec::new(),
        };
        FoundEffect {
            key: (c.law.id(), place_of(frame, shape)),
            evidence: null.fit.evidence + gain(c),
            power: null.left.power(),
            theta: null.fit.theta.clone(),
            offsets: Vec::new(),
            causes: each_place(shape, cause),
        }
    };
    left.map(effect).collect()
}

fn chain_pair(p: &ChainPair, sizes: &ChainSizes) -> FoundEffect {
    let first = chain_effect(&p.first, sizes);
    let forms: Vec<(&EffectForm, Option<&LawShape>)> = (p.first.form.iter())
        .map(|f| (f, Some(&p.first.shape).filter(|_| p.first.apart)))
        .chain([(&p.second, None)])
        .collect();
    let mut causes = chain_causes(&p.first, &forms, &p.fit.theta, &p.fit.amplitudes, sizes);
    if p.first.form.is_none() {
        causes.splice(0..0, first.causes);
    }
    FoundEffect {
        key: first.key,
        evidence: p.evidence,
        power: p.left.power(),
        theta: chain_theta(&p.first.frame, &p.fit),
        offsets: p.first.frame.reported_of_single(&p.fit.doubted),
        causes,
    }
}

/// Laws in the frame of a hypothesis, one after the other in the amplitudes; of one whose readings were put back, with the shape that
/// they were put back by.
fn chain_causes(
    h: &ChainEffect,
    forms: &[(&EffectForm, Option<&LawShape>)],
    theta: &[f64],
    amplitudes: &[f64],
    sizes: &ChainSizes,
) -> Vec<FoundCause> {
    let mut frame = h.frame.clone();
    frame.theta = theta.to_vec();
    let own = (sizes.speed.len() != frame.coordinates()).then(|| ChainSizes::of(&frame));
    let unhinged = |_: &[f64], _: usize, _: f64| None;
    let mechanics = FrameMechanics::new(&frame, &unhinged);
    let along = along_chain(&frame, own.as_ref().unwrap_or(sizes), &mechanics);
    let names: Vec<&str> = frame.intake.channels.iter().map(|c| &*c.name).collect();
    let mut amplitudes = amplitudes.iter().copied();
    let mut causes: Vec<FoundCause> = Vec::new();
    for (form, put_back) in forms {
        for part in &form.parts {
            let terms = form.law.terms(&along, &part.shape).map_or(0, |t| t.applied.columns.len());
            let value =
                |k: usize| if part.left_out.contains(&k) { 0.0 } else { amplitudes.next().unwrap_or(0.0) };
            let own: Vec<f64> = (0..terms).map(value).collect();
            let shape = put_back.unwrap_or(&part.shape);
            causes.extend(at_places(form.law, &along, &names, shape, &own, put_back.is_some()));
        }
    }
    causes
}

/// A law at each of its joints or channels.
fn at_places(
    law: LawRef,
    along: &PlantAlong<'_>,
    names: &[&str],
    shape: &LawShape,
    amplitudes: &[f64],
    put_back: bool,
) -> Vec<FoundCause> {
    let of = |joint: usize, channel: Option<usize>| FoundCause {
        id: law.cause(shape),
        place: place_in(names, shape, channel),
        joint,
        impulses: if shape.only.is_empty() { shape.pulses.len() } else { 1 },
        values: law.values(&LawFit { along, shape, joint, channel, amplitudes, put_back }),
    };
    each_place(shape, of)
}

/// Where a shape acts, at one of its channels if it has some.
fn place_in(names: &[&str], shape: &LawShape, channel: Option<usize>) -> String {
    channel.map_or_else(|| shape.place.to_owned(), |c| format!("sensor:{}", names[c]))
}

/// One for each joint or channel of a shape.
fn each_place<T>(shape: &LawShape, of: impl Fn(usize, Option<usize>) -> T) -> Vec<T> {
    match &shape.channels[..] {
        [] => shape.joints().iter().map(|j| of(*j, None)).collect(),
        channels => channels.iter().map(|c| of(0, Some(*c))).collect(),
    }
}
