//! The frame of a case whose plant is the two-mass joint.

use std::rc::Rc;

use trueup_signals::{Loaded, ParameterValue, Recording};

use super::frame::InnovationsFrame;
use super::intake::{NodeIntake, NodesError};
use super::known_effects::{KnownEffects, KnownPoint, UnfitEffect};
use super::plant::{ForcedPlant, StateReading};
use super::retimed::{LaterChannels, retimed};
use super::rig::{LateGroup, root_mean_square};
use super::two_mass::{TwoMassPlant, coordinate};

/// Rounds of a fit that delays come from.
const ROUNDS: usize = 8;
/// Longest step of a frame in which parameters are estimated, s.
const STEP: f64 = 2e-3;

/// FMU variables of dry friction.
const COULOMB: &str = "coulombFriction";
const STATIC: &str = "staticFriction";
/// Parameters that may be 0 in a recording.
const MAY_BE_NONE: [&str; 3] = [COULOMB, "viscousFriction", "damping"];

/// A case that has no such frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JointFrameError {
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
    #[error(
        "{file}: causes cannot be compared with `{id}` as a known effect: {why}; remove it from [effects]"
    )]
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

/// A case's frame and plant.
///
/// # Errors
/// See [`JointFrameError`].
pub fn joint_frame(loaded: &Loaded) -> Result<(InnovationsFrame, TwoMassPlant), JointFrameError> {
    frame_of(loaded, None)
}

/// The frame of a case whose parameters are to be estimated: in steps that are short next to the reversals of friction, with the torque of
/// the spring among the readings.
///
/// # Errors
/// See [`JointFrameError`].
pub fn joint_frame_to_estimate(loaded: &Loaded) -> Result<(InnovationsFrame, TwoMassPlant), JointFrameError> {
    frame_of(loaded, Some(STEP))
}

/// `to_estimate`: its longest step, s.
fn frame_of(
    loaded: &Loaded,
    to_estimate: Option<f64>,
) -> Result<(InnovationsFrame, TwoMassPlant), JointFrameError> {
    let case = &loaded.case;
    let file = || case.file.display().to_string();
    if case.model != "TwoMassJoint" {
        return Err(JointFrameError::Model { file: file(), model: case.model.clone() });
    }
    let plant = TwoMassPlant::of(case, root_mean_square(loaded, "motorCurrent"));
    let train = loaded.train();
    let value = |r: &Recording, name: &str| r.parameters.get(name).and_then(ParameterValue::number);
    let slides = |r: &&Recording| value(r, COULOMB).is_some_and(|v| v > 0.0);
    let plant = if train.iter().any(slides) { plant.with_dry_recordings() } else { plant };
    let known = KnownEffects::of(case, plant.coordinates().iter().any(|c| c.dry.is_some() || c.holds > 0.0));
    let known = known.map_err(|UnfitEffect(id, why)| JointFrameError::Effect { file: file(), id, why })?;
    let servo = known.as_ref().map_or(0.0, |k| servo_torque(loaded, k, plant.readings()));
    let plant = if servo > 0.0 { plant.driven_by(servo) } else { plant };
    // Of known effects in the transmission its torque has a part that is none of the spring's.
    let plant = if to_estimate.is_some() && known.is_none() { plant.with_torque_reading() } else { plant };
    let plant = plant.with_known(known);
    if let Some(name) = plant.missing() {
        return Err(JointFrameError::Parameter { file: file(), name });
    }
    let any = Rc::new(plant.clone()) as Rc<dyn ForcedPlant>;
    Ok((frame_with_plant(loaded, &any, to_estimate)?, plant))
}

/// A case's frame with a plant; `longest`: its longest step, s.
///
/// # Errors
/// See [`JointFrameError`].
pub fn frame_with_plant(
    loaded: &Loaded,
    plant: &Rc<dyn ForcedPlant>,
    longest: Option<f64>,
) -> Result<InnovationsFrame, JointFrameError> {
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
        return Err(JointFrameError::Known { file: file(), what });
    }
    let made = |loaded: &Loaded| -> Result<InnovationsFrame, NodesError> {
        let intake = Rc::new(NodeIntake::in_steps(loaded, &**plant, longest)?);
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
        let fit = frame.fit(&|_| Vec::new(), &q, ROUNDS, true);
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
