//! The joint as its owner believes it, fitted to a case's recordings.

use trueup_estimation::evidence::Prior;
use trueup_estimation::fit::{Bounds, Effort, Fit, fit};
use trueup_estimation::intake::{IntakeError, Lateness, Raw};
use trueup_estimation::joint::{FULL, Model};
use trueup_estimation::run::Run;
use trueup_estimation::system::Latent;
use trueup_estimation::unknown::{ParametricJoint, Scale, Target, Unknown};
use trueup_models::compiled::{Compiled, PlantModel};
use trueup_models::effect::Measure;
use trueup_models::joint::{TwoMassJoint, parameter as q};
use trueup_models::presets;
use trueup_signals::Loaded;

use crate::catalogue::Cause;
use crate::levels::{BEGIN, CEILING, CORRELATION, FLOOR, KNOWN, LACKS, REST};
use crate::sizes::Sizes;

/// Rounds of a fit.
const ROUNDS: usize = 40;

/// Of these, those before it is settled where friction holds the motor.
const MODES: usize = 8;

fn effort(bounds: Bounds) -> Effort {
    Effort { rounds: ROUNDS, held: 0, modes: MODES, bounds }
}

/// A case that cannot be looked at.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BaselineError {
    /// A recording that cannot be taken.
    #[error(transparent)]
    Intake(#[from] IntakeError),
    /// The structure cannot be built.
    #[error("{0}")]
    Structure(String),
    /// Not one of the plants that this is made for.
    #[error("the filter is made for TwoMassJoint, not for {0}; diagnose it by balances")]
    Model(String),
    /// Effects that are there for certain, gains, offsets of inputs.
    #[error(
        "the filter's model has neither known effects nor gains of sensors nor offsets of inputs; diagnose it by balances, which have"
    )]
    Known,
    /// Nothing can be computed.
    #[error("the nominal model cannot be compared with the recordings; look at the parameters of case.toml")]
    Nominal,
}

/// The baseline model at its posterior mode.
#[derive(Clone, Debug)]
pub struct Baseline {
    /// The recordings for fitting.
    pub raw: Vec<Raw>,
    /// What it has of causes; none at first.
    pub causes: Vec<Cause>,
    /// The joint with its parameters, each as sure as its owner holds it to be.
    pub parametric: ParametricJoint,
    /// Its fit.
    pub fit: Fit,
    /// Its fit with the parameters as the owner has them.
    pub held: Option<Fit>,
    /// Typical sizes.
    pub sizes: Sizes,
    /// Of intensities.
    pub bounds: Bounds,
}

fn parameter(p: &[f64], index: usize, doubt: f64) -> Unknown {
    let mean = p[index].ln();
    Unknown {
        name: q::NAMES[index].0.to_owned(),
        target: Target::Parameter(index),
        scale: Scale::Log,
        lower: mean - 4.0,
        upper: mean + 4.0,
        prior: Prior { mean, deviation: doubt },
    }
}

/// Parameters that may be refitted. Lengths of time and first states are not among them.
fn own(p: &[f64], flexible: bool) -> Vec<usize> {
    let mut all = vec![q::MOTOR_INERTIA, q::LOAD_INERTIA, q::TORQUE_CONSTANT];
    if flexible {
        all.extend([q::STIFFNESS, q::DAMPING]);
    }
    all.extend([q::COULOMB_FRICTION, q::VISCOUS_FRICTION]);
    if p[q::STATIC_FRICTION] > p[q::COULOMB_FRICTION] {
        all.push(q::STATIC_FRICTION);
    }
    all.retain(|i| p[*i] > 0.0);
    all
}

/// The same with the parameters as the owner has them: only what lacks and where the joint was are unknown.
fn without_parameters(parametric: &ParametricJoint) -> ParametricJoint {
    let mut held = parametric.clone();
    held.unknowns.retain(|u| !matches!(u.target, Target::Parameter(_)));
    held
}

/// The runs with a motor that is slower than this taken to be at rest, where its sensor resolves more.
fn at_rest_below(runs: &[Run], speed: f64) -> Vec<Run> {
    let mut runs = runs.to_vec();
    for r in &mut runs {
        r.recording.resolved_speed = r.recording.resolved_speed.max(speed);
        r.recording.friction.clear();
    }
    runs
}

impl Baseline {
    /// Of a case's recordings for fitting.
    ///
    /// # Errors
    /// See [`BaselineError`].
    pub fn new(loaded: &Loaded) -> Result<Self, BaselineError> {
        let case = &loaded.case;
        if case.model != TwoMassJoint::NAME {
            return Err(BaselineError::Model(case.model.clone()));
        }
        let sensed = loaded.recordings.values().flat_map(|r| &r.channels);
        let input = |name: &str| trueup_models::joint::input::NAMES.iter().any(|n| n.0 == name);
        let mut sensed =
            sensed.map(|c| c.sensor.gain.is_some() || c.sensor.offset.is_some() && input(&c.name));
        if !case.effects.is_empty() || sensed.any(|s| s) {
            return Err(BaselineError::Known);
        }
        let flexible = case.elements("jointFlexible").first().and_then(|v| v.boolean()).unwrap_or(true);
        let joint = TwoMassJoint::new(flexible, &[] as &[&str])
            .map(Compiled::new)
            .map_err(|e| BaselineError::Structure(e.to_string()))?;
        let mut p = presets::delian(1).map_or_else(Vec::new, |p| p.to_vec());
        for (value, name) in p.iter_mut().zip(q::NAMES) {
            *value = case.number(name.0).unwrap_or(*value);
        }
        if case.number("staticFriction").is_none() {
            p[q::STATIC_FRICTION] = p[q::COULOMB_FRICTION];
        }
        let tied = p[q::STATIC_FRICTION] == p[q::COULOMB_FRICTION];
        let ties = if tied { vec![(q::STATIC_FRICTION, q::COULOMB_FRICTION)] } else { Vec::new() };
        let doubt = |i: usize| case.doubt(q::NAMES[i].0).unwrap_or(KNOWN);
        let mut unknowns: Vec<Unknown> =
            own(&p, flexible).into_iter().map(|i| parameter(&p, i, doubt(i))).collect();
        let raw = Raw::train(loaded, &p)?;
        let model = Model { joint: &joint, p: &p, latent: [Latent { deviation: 0.0, time: CORRELATION }; 2] };
        let runs: Vec<Run> = raw.iter().map(|r| Run::sensed(r.grid(&Lateness::default()), &model)).collect();
        let sizes = Sizes::new(&runs, &p, flexible);
        let mut offsets: Vec<usize> = raw.iter().flat_map(Raw::offsets).collect();
        offsets.sort_unstable();
        offsets.dedup();
        for output in offsets {
            let size = sizes.get(Measure::Reading, Some(output));
            unknowns.push(Unknown {
                name: "offset".into(),
                target: Target::Offset(output),
                scale: Scale::Linear(size),
                lower: f64::NEG_INFINITY,
                upper: f64::INFINITY,
                prior: Prior { mean: 0.0, deviation: 1.0 },
            });
        }
        let parametric = ParametricJoint { joint, p, ties, unknowns };
        let torques = sizes.torques();
        let bounds = Bounds { floor: torques.map(|t| FLOOR * t), ceiling: torques.map(|t| CEILING * t) };
        let latent = torques.map(|t| Latent { deviation: BEGIN * t, time: CORRELATION });
        let speed = sizes.get(Measure::Speed, None);
        // Parameters that moved while much seems to lack lead astray: first they are held.
        let first = at_rest_below(&runs, REST[0] * speed);
        let fitted = |parametric: &ParametricJoint, start: &[f64], latent, runs: &[Run]| {
            fit(&raw, parametric, start, latent, runs, effort(bounds))
        };
        let (owned, start) = (without_parameters(&parametric), parametric.start());
        let held = fitted(&owned, &owned.start(), latent, &first);
        let (from, about) = held.as_ref().map_or((latent, &first), |h| (h.latent, &h.runs));
        let mut best = fitted(&parametric, &start, from, about).ok_or(BaselineError::Nominal)?;
        let likelier = |best: &mut Fit, start: &[f64], latent, runs: &[Run]| {
            let found = fitted(&parametric, start, latent, runs);
            if let Some(found) = found.filter(|f| f.log_evidence > best.log_evidence) {
                *best = found;
            }
        };
        // Friction as it acts with other parameters, and with a slower rest.
        likelier(&mut best, &start, from, &at_rest_below(about, REST[0] * speed));
        for share in &REST[1..] {
            let resolved = runs.iter().map(|r| r.recording.resolved_speed).fold(0.0, f64::max);
            if share * speed > resolved {
                let Fit { theta, latent, runs, .. } = best.clone();
                likelier(&mut best, &theta, latent, &at_rest_below(&runs, share * speed));
            }
        }
        let held = fitted(&owned, &owned.start(), best.latent, &best.runs);
        Ok(Self { raw, causes: Vec::new(), parametric, fit: best, held, sizes, bounds })
    }

    /// Its fit with the parameters, those of the owner, doubted by at least so much.
    pub fn doubted(&self, deviation: f64) -> Option<Fit> {
        let mut wide = self.parametric.clone();
        for u in wide.unknowns.iter_mut().filter(|u| matches!(u.target, Target::Parameter(_))) {
            u.prior.deviation = u.prior.deviation.max(deviation);
        }
        self.fitted(&wide, &self.fit.theta)
    }
    /// Its recordings with other unknowns, from where it was and what lacked.
    fn fitted(&self, parametric: &ParametricJoint, start: &[f64]) -> Option<Fit> {
        fit(&self.raw, parametric, start, self.fit.latent, &self.fit.runs, effort(self.bounds))
    }
    /// Whether a latent torque stands out.
    pub fn lacks(&self) -> bool {
        let torques = self.sizes.torques();
        self.fit.latent.iter().zip(torques).any(|(l, t)| l.deviation > LACKS * t)
    }
    /// Whether a latent torque is as large as it may be: readings alone tell the motion then.
    pub fn at_ceiling(&self, fit: &Fit) -> bool {
        fit.latent.iter().zip(self.bounds.ceiling).any(|(l, most)| l.deviation >= most)
    }
    /// With a cause, fitted.
    pub fn with(&self, cause: &Cause, parametric: &ParametricJoint, fit: &Fit) -> Self {
        let causes = self.causes.iter().chain([cause]).cloned().collect();
        Self { causes, parametric: parametric.clone(), fit: fit.clone(), ..self.clone() }
    }
    /// What the log likelihood would be if the latent torques were at their floor and the innovations white.
    pub fn ideal(&self) -> f64 {
        let at = self.parametric.assign(&self.fit.theta);
        let latent =
            core::array::from_fn(|k| Latent { deviation: self.bounds.floor[k], ..self.fit.latent[k] });
        let model = Model { joint: &self.parametric.joint, p: &at.p, latent };
        let of = |r: &Run| {
            let f = r.filtered::<FULL>(&model, &at.offsets);
            -0.5 * (f.filter.log_determinant + f.system.readings() as f64)
        };
        self.fit.runs.iter().map(of).sum()
    }
}
