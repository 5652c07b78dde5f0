//! What explains the gap: a screen of all shapes at once, leaders refined and fitted, other structures in frames of their own,
//! pairs for what the first leaves. All evidences are of the same readings.

use std::cell::RefCell;
use std::rc::Rc;

use trueup_estimation::innovations::frame::{INTENSITY, InnovationsFrame};
use trueup_estimation::innovations::intensity::power;
use trueup_estimation::innovations::joint_frame::{JointFrameError, frame_with_plant, joint_frame};
use trueup_estimation::innovations::linear::Feedback;
use trueup_estimation::innovations::null::{FittedNull, fit_null, unread_of_null};
use trueup_estimation::innovations::plant::ForcedPlant;
use trueup_estimation::innovations::two_mass::TwoMassPlant;
use trueup_signals::Loaded;

use super::candidate::{ScreenedShape, applied};
use super::hypothesis::{FittedEffect, SharedFrame, best_each, fit_candidate, play};
use super::joint_along::{UsualSizes, along_joint};
use super::late::{DelayStart, late_channel};
use super::laws::{law_of, stribeck};
use super::pairs::{FittedPair, beside};
use super::pushes::pursue;
use super::screen::{all_shapes, families, far_out, refine, sift};
use super::structure::{with_friction, with_spring, with_tip};

/// Leaders that are fitted, and of these, those with all rounds.
const LEADERS: [usize; 2] = [7, 2];
/// Effects whose size is far out that are fitted so, too.
const FAR: usize = 3;
/// Rounds of a leader that begins high, and of the others.
const ROUNDS: [usize; 2] = [8, 4];
/// Nats of the screen below which nothing is fitted.
const LEAST: f64 = 4.0;
/// Starts after a release, in usual speeds with their exponents: a screen along a wrong release does not see them.
const AFTER_RELEASE: [(f64, f64); 4] = [(0.02, 1.0), (0.05, 1.0), (0.05, 2.0), (0.1, 1.0)];
/// Torque held at rest, in levels of dry friction, from which on there is a release.
const RELEASE: f64 = 1.3;

/// All that a verdict is made from.
pub struct JointFindings {
    /// The model alone.
    pub null: FittedNull,
    /// Usual sizes along the trajectory with which hypotheses begin.
    pub sizes: UsualSizes,
    /// Effects, best first; at least one.
    pub effects: Vec<FittedEffect>,
    /// Pairs, best first.
    pub pairs: Vec<FittedPair>,
}

/// Searches a case.
///
/// # Errors
/// See [`JointFrameError`].
pub fn search_joint(loaded: &Loaded) -> Result<JointFindings, JointFrameError> {
    let (frame, plant) = joint_frame(loaded)?;
    Ok(search_frame(loaded, frame, Some(&plant)))
}

/// Searches a case with a plant of which no other structures can be made.
///
/// # Errors
/// See [`JointFrameError`].
pub fn search_plant(loaded: &Loaded, plant: &Rc<dyn ForcedPlant>) -> Result<JointFindings, JointFrameError> {
    Ok(search_frame(loaded, frame_with_plant(loaded, plant, None)?, None))
}

fn search_frame(loaded: &Loaded, mut frame: InnovationsFrame, own: Option<&TwoMassPlant>) -> JointFindings {
    let mut null = fit_null(&mut frame);
    null.unread = unread_of_null(loaded, &frame, &null);
    let sizes = UsualSizes::of(&frame);
    let mut candidates = all_shapes(&frame, &sizes);
    let alone = sift(&mut frame, &mut candidates, &null.begin, &[]);
    let frame = Rc::new(RefCell::new(frame));
    search_from(&frame, own, null, sizes, candidates, alone)
}

/// Goes on where a screen ended: `alone` is the evidence without any candidate; `own`: the plant of which other structures can be
/// made, none of an FMU of others.
pub fn search_from(
    frame: &SharedFrame,
    own: Option<&TwoMassPlant>,
    null: FittedNull,
    sizes: UsualSizes,
    mut candidates: Vec<ScreenedShape>,
    alone: f64,
) -> JointFindings {
    let q = &null.begin;
    let rigid = frame.borrow().plant.elements().is_empty();
    let places: &[&str] = if rigid { &["load"] } else { &["load", "actuator"] };
    for place in places {
        candidates.extend(pursue(&mut frame.borrow_mut(), &sizes, q, place, &[]));
    }
    let (first, forms) = families(&candidates);
    // Not impulses: what they cost, the screen does not count.
    let sized: Vec<ScreenedShape> = first.iter().filter(|c| !c.law.is_impulses()).cloned().collect();
    let far = far_out(&mut frame.borrow_mut(), &sized, q, &[]);
    let mut effects = best_each(leaders(frame, (&null, &sizes), &first, [&forms, &far], alone));
    let best = effects.first().map_or(f64::NEG_INFINITY, |h| h.evidence);
    // Shapes once more, along the trajectory that the hypothesis made.
    for h in effects.clone().iter().take(3) {
        if h.evidence > null.evidence + (0.4 * (best - null.evidence)).max(30.0) && is_shaped(h) {
            effects.push(polish(frame, h, &sizes));
        }
    }
    let mut effects = best_each(effects.into_iter().map(play).collect());
    effects.extend(late_channels(frame, (&null, &sizes), &first, alone, effects.first()));
    let top = first.first().map_or(alone, |c| c.evidence);
    for (c, plant) in first.iter().take(4).filter(|c| c.law.is_structure() && !rigid).zip(own.iter().cycle())
    {
        if c.evidence > alone + (0.3 * (top - alone)).max(5.0) {
            effects.extend(with_tip(&frame.borrow(), plant, c));
        }
    }
    if let Some(plant) = own.filter(|_| frame.borrow().plant.coordinates().iter().all(|c| c.dry.is_none())) {
        effects.extend(with_friction(&mut frame.borrow_mut(), plant, &sizes));
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
            let seconds = beside(&mut effects[k], null.evidence, &sizes);
            pairs.extend(seconds.pairs);
            alone_after.extend(seconds.alone);
        }
    }
    effects.extend(alone_after);
    pairs.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    JointFindings { effects: best_each(effects), null, sizes, pairs }
}

/// The first of the screen, refined and fitted.
fn leaders(
    frame: &SharedFrame,
    (null, sizes): (&FittedNull, &UsualSizes),
    first: &[ScreenedShape],
    [forms, far]: [&[ScreenedShape]; 2],
    alone: f64,
) -> Vec<FittedEffect> {
    let q = &null.begin;
    let mut chosen: Vec<(ScreenedShape, usize, bool)> = Vec::new();
    for (k, c) in first.iter().take(LEADERS[0]).enumerate() {
        chosen.push((c.clone(), ROUNDS[usize::from(k >= LEADERS[1])], false));
    }
    let leads = |c: &&ScreenedShape| first.iter().take(4).any(|f| f.key() == c.key());
    chosen.extend(forms.iter().take(3).filter(leads).map(|c| (c.clone(), ROUNDS[1], false)));
    chosen.extend(far.iter().take(FAR).map(|c| (c.clone(), ROUNDS[0], false)));
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
    (null, sizes): (&FittedNull, &UsualSizes),
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
            out.extend(late_channel(frame, place, sizes, &null.q, begin));
        }
    }
    out
}
