//! What explains the gap: a screen of all shapes at once, leaders refined and fitted, other structures in frames of their own,
//! pairs for what the first leaves. All evidences are of the same readings.

use std::cell::RefCell;
use std::rc::Rc;

use trueup_estimation::innovations::frame::{INTENSITY, InnovationsFrame};
use trueup_estimation::innovations::intake::{NodeIntake, NodesError};
use trueup_estimation::innovations::intensity::power;
use trueup_estimation::innovations::known_effects::{KnownEffects, KnownPoint, UnfitEffect};
use trueup_estimation::innovations::linear::Feedback;
use trueup_estimation::innovations::plant::{ForcedPlant, StateReading};
use trueup_estimation::innovations::rig::{LateGroup, root_mean_square};
use trueup_estimation::innovations::two_mass::{TwoMassPlant, coordinate};
use trueup_estimation::innovations::unread::{UnreadFigures, is_estimated, unread};
use trueup_signals::{Loaded, ParameterValue, Recording};

use super::candidate::{ScreenedShape, applied};
use super::hypothesis::{FittedEffect, SharedFrame, best_each, fit_candidate, play};
use super::joint_along::{UsualSizes, along_joint};
use super::late::{DelayStart, late_channel};
use super::laws::{law_of, stribeck};
use super::null::{FittedNull, fit_null};
use super::pairs::{FittedPair, beside};
use super::pushes::pursue;
use super::retimed::{LaterChannels, retimed};
use super::screen::{all_shapes, families, refine, sift};
use super::structure::{with_friction, with_spring, with_tip};

/// Leaders that are fitted, and of these, those with all rounds.
const LEADERS: [usize; 2] = [7, 2];
/// Rounds of a leader that begins high, and of the others.
const ROUNDS: [usize; 2] = [8, 4];
/// Nats of the screen below which nothing is fitted.
const LEAST: f64 = 4.0;
/// Starts after a release, in usual speeds with their exponents: a screen along a wrong release does not see them.
const AFTER_RELEASE: [(f64, f64); 4] = [(0.02, 1.0), (0.05, 1.0), (0.05, 2.0), (0.1, 1.0)];
/// Torque held at rest, in levels of dry friction, from which on there is a release.
const RELEASE: f64 = 1.3;

/// FMU variables of dry friction.
const COULOMB: &str = "coulombFriction";
const STATIC: &str = "staticFriction";
/// Parameters that may be 0 in a recording.
const MAY_BE_NONE: [&str; 3] = [COULOMB, "viscousFriction", "damping"];

/// A case that cannot be searched.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JointSearchError {
    /// Recordings that cannot be taken.
    #[error(transparent)]
    Nodes(#[from] NodesError),
    /// Not one of the plants that this is made for.
    #[error("{file}: causes of a joint are those of TwoMassJoint, not of {model}")]
    Model {
        /// The case.
        file: String,
        /// Its model.
        model: String,
    },
    /// A parameter that must be positive.
    #[error("{file}: {name} has to be above 0; correct it in [parameters]")]
    Parameter {
        /// The case.
        file: String,
        /// The parameter.
        name: &'static str,
    },
    /// A known effect that is no force along the trajectory.
    #[error("{file}: causes cannot be compared with `{id}` as a known effect: {why}")]
    Effect {
        /// The case.
        file: String,
        /// The effect.
        id: String,
        /// Why not.
        why: &'static str,
    },
    /// Rigs that differ between recordings.
    #[error("{file}: causes of a joint cannot be compared with {what}; leave {what} out")]
    Known {
        /// The case.
        file: String,
        /// What it does not know.
        what: &'static str,
    },
}

/// All that a verdict is made from.
pub struct JointFindings {
    /// The model alone.
    pub null: FittedNull,
    /// Effects, best first; at least one.
    pub effects: Vec<FittedEffect>,
    /// Pairs, best first.
    pub pairs: Vec<FittedPair>,
}

/// A case's frame and plant.
///
/// # Errors
/// See [`JointSearchError`].
pub fn frame_of(loaded: &Loaded) -> Result<(InnovationsFrame, TwoMassPlant), JointSearchError> {
    let case = &loaded.case;
    let file = || case.file.display().to_string();
    if case.model != "TwoMassJoint" {
        return Err(JointSearchError::Model { file: file(), model: case.model.clone() });
    }
    let plant = TwoMassPlant::of(case, root_mean_square(loaded, "motorCurrent"));
    let train = loaded.train();
    let value = |r: &Recording, name: &str| r.parameters.get(name).and_then(ParameterValue::number);
    let slides = |r: &&Recording| value(r, COULOMB).is_some_and(|v| v > 0.0);
    let plant = if train.iter().any(slides) { plant.with_dry_recordings() } else { plant };
    let known = KnownEffects::of(case, plant.coordinates().iter().any(|c| c.dry.is_some() || c.holds > 0.0));
    let known = known.map_err(|UnfitEffect(id, why)| JointSearchError::Effect { file: file(), id, why })?;
    let servo = known.as_ref().map_or(0.0, |k| servo_torque(loaded, k, plant.readings()));
    let plant = if servo > 0.0 { plant.driven_by(servo) } else { plant }.with_known(known);
    if let Some(name) = plant.missing() {
        return Err(JointSearchError::Parameter { file: file(), name });
    }
    Ok((frame_with(loaded, &(Rc::new(plant.clone()) as Rc<dyn ForcedPlant>))?, plant))
}

/// A case's frame with a plant.
///
/// # Errors
/// See [`JointSearchError`].
pub fn frame_with(
    loaded: &Loaded,
    plant: &Rc<dyn ForcedPlant>,
) -> Result<InnovationsFrame, JointSearchError> {
    let file = || loaded.case.file.display().to_string();
    let late = LateGroup::all(loaded);
    let known = [
        (
            has_strange_parameters(loaded, &**plant),
            "gear ratios, static frictions and inertias or stiffnesses of 0 of single recordings",
        ),
        (
            late.iter().any(|g| !plant.has_channel(&g.channel)),
            "delays of other channels than angles, rates and inputs",
        ),
    ];
    if let Some((_, what)) = known.into_iter().find(|k| k.0) {
        return Err(JointSearchError::Known { file: file(), what });
    }
    let made = |loaded: &Loaded| -> Result<InnovationsFrame, NodesError> {
        let intake = Rc::new(NodeIntake::new(loaded, &**plant)?);
        Ok(InnovationsFrame::new(&intake, plant.clone(), None))
    };
    let loaded = retimed(loaded, late, f64::INFINITY, |loaded, fits| -> Result<LaterChannels, NodesError> {
        let mut frame = made(loaded)?;
        let counted: usize = frame.runs.iter().map(|r| r.counted.iter().filter(|c| **c).count()).sum();
        let q = frame.q.clone();
        if !fits {
            frame.settle_signs(&q, 2);
            let evidence = frame.evidence / counted.max(1) as f64;
            return Ok(LaterChannels { evidence, ..LaterChannels::default() });
        }
        frame.settle(true);
        let q = frame.q.clone();
        let fit = frame.fit(&|_| Vec::new(), &q, ROUNDS[0], true);
        let step = frame.runs.iter().map(|r| r.dt).fold(f64::INFINITY, f64::min);
        let by = frame.intake.rig.later(&fit.zeros);
        Ok(LaterChannels { evidence: fit.evidence / counted.max(1) as f64, step, by })
    })?;
    Ok(made(&loaded)?)
}

/// Root mean square of the torque that a servo makes of what was read, N.m; 0: there is none.
fn servo_torque(loaded: &Loaded, effects: &KnownEffects, readings: &[StateReading]) -> f64 {
    let numbers = vec![1.0; effects.numbers.len()];
    let Some(((drive, numbers), (name, _))) = effects.drive(&numbers).zip(effects.inputs().find(|i| i.1))
    else {
        return 0.0;
    };
    let parameters = drive.parameters(&numbers, &[]);
    let (mut squares, mut count) = (0.0, 0);
    for r in loaded.train() {
        let read = readings.iter().filter(|x| x.angle).find_map(|x| Some((r.channel(x.name)?, x.factor)));
        let Some((reference, (read, factor))) = r.channel(name).zip(read) else { continue };
        let (wanted, angles) = (reference.believed(), read.believed());
        for (t, angle) in read.time.iter().zip(&angles) {
            let held = reference.time.partition_point(|x| x <= t).saturating_sub(1);
            let (angle, wanted) = (factor * angle, wanted.get(held).copied().unwrap_or(0.0));
            let at = KnownPoint {
                time: 0.0,
                parameters: &parameters,
                state: &[angle, 0.0, angle, 0.0],
                inner: &[],
                input: &[0.0, 0.0, wanted],
                sign: 0.0,
                rigid: true,
            };
            squares += drive.motion(&at, &[]).0.forces.iter().sum::<f64>().powi(2);
            count += 1;
        }
    }
    (squares / f64::from(count.max(1))).sqrt()
}

/// Whether a parameter of a recording is none that can be another there: what is neither the plant's nor of a known effect, or an
/// inertia, a stiffness or a torque constant of 0. Static friction is that of the case next to the Coulomb friction there.
fn has_strange_parameters(loaded: &Loaded, plant: &dyn ForcedPlant) -> bool {
    let own = |name: &str| plant.parameters().iter().find(|p| p.name == name);
    let of_effect = |name: &str| plant.known_effects().is_some_and(|e| e.parameter(name).is_some());
    let breakaway = plant.coordinates()[coordinate::MOTOR].breakaway;
    let strange = |r: &Recording, name: &str, value: f64| match name {
        STATIC => {
            let slides = r.parameters.get(COULOMB).and_then(ParameterValue::number);
            let slides = slides.or_else(|| loaded.case.number(COULOMB)).unwrap_or(0.0);
            (value - breakaway * slides).abs() > 1e-9 * value.abs()
        }
        _ if of_effect(name) => false,
        _ => own(name).is_none_or(|p| value <= 0.0 && !MAY_BE_NONE.contains(&p.name)),
    };
    let train = loaded.train();
    let mut all = train.iter().flat_map(|r| r.parameters.iter().map(move |p| (r, p)));
    all.any(|(r, (name, value))| {
        !name.starts_with("initial") && value.number().is_none_or(|v| strange(r, name, v))
    })
}

/// Searches a case.
///
/// # Errors
/// See [`JointSearchError`].
pub fn search_joint(loaded: &Loaded) -> Result<JointFindings, JointSearchError> {
    let (frame, plant) = frame_of(loaded)?;
    Ok(search_frame(loaded, frame, Some(&plant)))
}

/// Searches a case with a plant of which no other structures can be made.
///
/// # Errors
/// See [`JointSearchError`].
pub fn search_plant(loaded: &Loaded, plant: &Rc<dyn ForcedPlant>) -> Result<JointFindings, JointSearchError> {
    Ok(search_frame(loaded, frame_with(loaded, plant)?, None))
}

fn search_frame(loaded: &Loaded, mut frame: InnovationsFrame, own: Option<&TwoMassPlant>) -> JointFindings {
    let mut null = fit_null(&mut frame);
    null.unread = unread_of(loaded, &frame, &null);
    let mut candidates = all_shapes(&frame, &null.sizes);
    let alone = sift(&mut frame, &mut candidates, &null.begin, &[]);
    let frame = Rc::new(RefCell::new(frame));
    search_from(&frame, own, null, candidates, alone)
}

/// Figures of channels that the frame does not read, along the trajectory of the model alone.
fn unread_of(loaded: &Loaded, frame: &InnovationsFrame, null: &FittedNull) -> UnreadFigures {
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

/// Goes on where a screen ended: `alone` is the evidence without any candidate; `own`: the plant of which other structures can be
/// made, none of an FMU of others.
pub fn search_from(
    frame: &SharedFrame,
    own: Option<&TwoMassPlant>,
    null: FittedNull,
    mut candidates: Vec<ScreenedShape>,
    alone: f64,
) -> JointFindings {
    let (q, sizes) = (&null.begin, &null.sizes);
    let rigid = frame.borrow().plant.elements().is_empty();
    let places: &[&str] = if rigid { &["load"] } else { &["load", "actuator"] };
    for place in places {
        candidates.extend(pursue(&mut frame.borrow_mut(), sizes, q, place, &[]));
    }
    let (first, forms) = families(&candidates);
    let mut effects = best_each(leaders(frame, &null, &first, &forms, alone));
    let best = effects.first().map_or(f64::NEG_INFINITY, |h| h.evidence);
    // Shapes once more, along the trajectory that the hypothesis made.
    for h in effects.clone().iter().take(3) {
        if h.evidence > null.evidence + (0.4 * (best - null.evidence)).max(30.0) && is_shaped(h) {
            effects.push(polish(frame, h, sizes));
        }
    }
    let mut effects = best_each(effects.into_iter().map(play).collect());
    effects.extend(late_channels(frame, &null, &first, alone, effects.first()));
    let top = first.first().map_or(alone, |c| c.evidence);
    for (c, plant) in first.iter().take(4).filter(|c| c.law.is_structure() && !rigid).zip(own.iter().cycle())
    {
        if c.evidence > alone + (0.3 * (top - alone)).max(5.0) {
            effects.extend(with_tip(&frame.borrow(), plant, c));
        }
    }
    if let Some(plant) = own.filter(|_| frame.borrow().plant.coordinates().iter().all(|c| c.dry.is_none())) {
        effects.extend(with_friction(&mut frame.borrow_mut(), plant, sizes));
    }
    if let Some(plant) = own.filter(|_| rigid) {
        effects.extend(with_spring(&frame.borrow(), plant));
    }
    let mut effects = best_each(effects);
    let (mut pairs, mut alone_after) = (Vec::new(), Vec::new());
    let mut lead: Vec<usize> = (0..effects.len().min(1)).collect();
    if let Some(h) = effects.first() {
        let loud = h.fit.q.iter().any(|q| *q > 2.0 * INTENSITY[0]);
        lead.extend(effects.iter().position(|o| o.id != h.id).filter(|_| loud));
    }
    for k in lead {
        let best = effects[0].evidence;
        if effects[k].evidence - null.evidence > (0.5 * (best - null.evidence)).max(30.0) {
            let seconds = beside(&mut effects[k], null.evidence, sizes);
            pairs.extend(seconds.pairs);
            alone_after.extend(seconds.alone);
        }
    }
    effects.extend(alone_after);
    pairs.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    JointFindings { effects: best_each(effects), null, pairs }
}

/// The first of the screen, refined and fitted.
fn leaders(
    frame: &SharedFrame,
    null: &FittedNull,
    first: &[ScreenedShape],
    forms: &[ScreenedShape],
    alone: f64,
) -> Vec<FittedEffect> {
    let (q, sizes) = (&null.begin, &null.sizes);
    let mut chosen: Vec<(ScreenedShape, usize, bool)> = Vec::new();
    for (k, c) in first.iter().take(LEADERS[0]).enumerate() {
        chosen.push((c.clone(), ROUNDS[usize::from(k >= LEADERS[1])], false));
    }
    let leads = |c: &&ScreenedShape| first.iter().take(4).any(|f| f.key() == c.key());
    chosen.extend(forms.iter().take(3).filter(leads).map(|c| (c.clone(), ROUNDS[1], false)));
    if frame.borrow().release > RELEASE {
        let f = frame.borrow();
        let along = along_joint(&f, sizes);
        for (speed, k) in AFTER_RELEASE {
            let shape = stribeck(speed * sizes.motor_speed, k);
            let made = law_of("stribeck-friction").and_then(|l| ScreenedShape::new(l, &along, shape));
            chosen.extend(made.map(|c| (ScreenedShape { intensities: q.clone(), ..c }, ROUNDS[1], true)));
        }
    }
    let mut out = Vec::new();
    for (c, rounds, as_it_is) in chosen {
        if c.evidence < alone + LEAST && !out.is_empty() && !as_it_is {
            continue;
        }
        frame.borrow_mut().reset(q);
        let c = if as_it_is || c.law.is_impulses() {
            c
        } else {
            let Some(c) = c.again(&frame.borrow(), sizes) else { continue };
            refine(&mut frame.borrow_mut(), c, sizes, &[], 3)
        };
        out.push(fit_candidate(frame, &c, sizes, rounds));
    }
    out
}

fn is_shaped(h: &FittedEffect) -> bool {
    h.shape.get("h").is_some() || h.parts.iter().any(|(law, shape)| !law.refined(shape).is_empty())
}

/// An effect with its shape once more, along its own trajectory.
fn polish(frame: &SharedFrame, h: &FittedEffect, sizes: &UsualSizes) -> FittedEffect {
    let (law, shape) = h.parts[0].clone();
    let f = &mut *frame.borrow_mut();
    f.take_unknowns(&h.fit.theta);
    f.feedback = Feedback::default();
    f.smooth(&h.fit.q, None);
    for _ in 0..2 {
        let laws = applied(&h.parts, f, sizes);
        f.put_in_force(&laws, &h.fit.amplitudes, &h.fit.zeros, &h.fit.q);
    }
    let mut refined = (law, shape.clone());
    if let Some(mut c) = ScreenedShape::new(law, &along_joint(f, sizes), shape) {
        c.intensities.clone_from(&h.fit.q);
        refined.1 = refine(f, c, sizes, &[], 2).shape;
    }
    let parts = [refined];
    let fit = f.fit(&|f| applied(&parts, f, sizes), &h.fit.q, ROUNDS[0], false);
    let [(law, shape)] = parts;
    FittedEffect::of_law(frame, law, shape, fit)
}

/// Channels that the screen has late, each in a frame of its own.
fn late_channels(
    frame: &SharedFrame,
    null: &FittedNull,
    first: &[ScreenedShape],
    alone: f64,
    leader: Option<&FittedEffect>,
) -> Vec<FittedEffect> {
    let late = |c: &&ScreenedShape| c.law.is_late();
    let far = first.iter().filter(late).map(|c| c.evidence).fold(f64::NEG_INFINITY, f64::max);
    let fall = leader.map_or(0.0, |h| 1.0 - h.power() / power(&null.q));
    let loud = null.q.iter().any(|q| *q > 0.02) && fall < 0.8;
    // With one angle a reading that is late is hardly distinguished from a drive that is; the screen then has the drive alone.
    let drive = leader.filter(|h| h.id == "actuator-lag" && !frame.borrow().two_angles());
    let as_drive = drive.map(|h| DelayStart {
        delay: h.shape.value(h.shape.form) * h.fit.amplitudes.first().unwrap_or(&1.0),
        theta: Some(&h.fit.theta),
    });
    let mut out = Vec::new();
    let places = ["sensor:motorAngle", "sensor:loadAngle"].into_iter();
    for place in places.filter(|place| !frame.borrow().plant.refuses("sensor-delay", place)) {
        let found = first.iter().enumerate().find(|(_, c)| late(c) && c.shape.place == place);
        let seen = found.filter(|(rank, c)| {
            let seen = c.evidence > alone + 5.0 && *rank < 8;
            c.evidence >= alone + 0.5 * (far - alone) && (seen || loud)
        });
        let seen = seen.map(|(_, c)| DelayStart { delay: c.shape.value("d"), theta: None });
        if let Some(begin) = as_drive.or(seen) {
            out.extend(late_channel(frame, place, &null.sizes, &null.q, begin));
        }
    }
    out
}
