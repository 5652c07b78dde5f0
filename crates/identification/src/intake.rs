//! A case on its way to a fit or a diagnosis: read, looked at with its model, and with what it leaves to the preset.

use std::path::{Path, PathBuf};

use trueup_models::plants;
use trueup_signals::check::{self, Relation};
use trueup_signals::{Case, Finding, FindingKind, Loaded, SignalVariable, base_name};

use crate::model::{ModelError, SimulatedPlant};
use crate::recorded::led;

/// What a case is taken in for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Motors without a recorded torque have their measured motion prescribed.
    Identify,
    /// Static friction alone, from ramps: one that never moves the joint is reported by the method.
    BreakAway,
    /// Every drive has to be recorded: what one does would be attributed to an effect.
    Diagnose,
}

/// A case that was read. It may be used unless one of its findings is an error.
#[derive(Clone, Debug)]
pub struct CaseIntake {
    /// The case with its recordings.
    pub loaded: Loaded,
    /// What was noticed.
    pub findings: Vec<Finding>,
    /// Reports which parameters the case leaves to the preset; `None`: none.
    pub preset: Option<String>,
}

/// A case that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CaseIntakeError {
    /// What is wrong in its files.
    #[error(transparent)]
    Files(#[from] trueup_signals::SignalsError),
    /// It has no model.
    #[error("{}: {source}", .file.display())]
    Model {
        /// The `case.toml`.
        file: PathBuf,
        /// Why.
        source: ModelError,
    },
}

/// That a case has stretches of another weight, which a diagnosis does not take.
pub fn weight_in_a_diagnosis(case: &Case) -> Option<Finding> {
    let stretch = case.weights.first()?;
    let what = "a diagnosis weighs readings by their noise alone, so `weight` of [fit] would be ignored";
    let mend = "remove it; `trueup identify` uses it";
    Some(Finding::error(FindingKind::BadValue, &case.file, what, mend).line(stretch.line))
}

impl CaseIntake {
    /// Reads a case. `with` are effects that are fitted in addition to those that it names.
    ///
    /// # Errors
    /// [`CaseIntakeError`]; what is wrong with recordings as such is in [`Self::findings`].
    pub fn read(path: &Path, purpose: Purpose, with: &[String]) -> Result<Self, CaseIntakeError> {
        let (loaded, findings) = Case::load(path, |case| variables(case, with))?;
        Self::of(loaded, findings, purpose, with)
    }

    /// Takes in a case whose files, if it has any, are read already; `findings` are what was noticed there.
    ///
    /// # Errors
    /// [`CaseIntakeError::Model`]
    pub fn of(
        mut loaded: Loaded,
        mut findings: Vec<Finding>,
        purpose: Purpose,
        with: &[String],
    ) -> Result<Self, CaseIntakeError> {
        for id in with {
            if !loaded.case.with.contains(id) {
                loaded.case.with.push(id.clone());
            }
        }
        let model = SimulatedPlant::of_case(&loaded.case, &[]);
        let model =
            model.map_err(|source| CaseIntakeError::Model { file: loaded.case.file.clone(), source })?;
        findings.extend(check::case(&loaded, &model.variables(), &relations(&model, &loaded.case)));
        // An arm whose motors have their measured motion prescribed needs no torque.
        let all = [loaded.train(), loaded.holdout()].concat();
        if !led(&model, &all).is_empty() {
            let needless = |f: &Finding| match purpose {
                Purpose::Identify => matches!(f.kind, FindingKind::NoInput | FindingKind::MissingInput),
                Purpose::BreakAway | Purpose::Diagnose => f.kind == FindingKind::NoInput,
            };
            findings.retain(|f| !needless(f));
        }
        if purpose == Purpose::BreakAway {
            findings.retain(|f| f.kind != FindingKind::LittleExcitation);
        }
        if purpose == Purpose::Diagnose {
            findings.extend(weight_in_a_diagnosis(&loaded.case));
        }
        let preset = line(&model, &loaded.case);
        Ok(Self { loaded, findings, preset })
    }
}

/// What is known of the model that a case names, with the effects that are fitted.
///
/// # Errors
/// The case names no such model.
pub fn variables(case: &Case, with: &[String]) -> Result<Vec<SignalVariable>, trueup_signals::SignalsError> {
    let wrong = |e: ModelError| {
        trueup_signals::SignalsError::Wrong(vec![Finding::error(
            FindingKind::UnknownModel,
            &case.file,
            e.to_string(),
            "",
        )])
    };
    fitted(case, with).map(|m| m.variables()).map_err(wrong)
}

/// The model of a case with the effects that are fitted.
fn fitted(case: &Case, with: &[String]) -> Result<SimulatedPlant, ModelError> {
    let all: Vec<&str> = case.with.iter().chain(with).map(String::as_str).collect();
    SimulatedPlant::of_case(case, &all)
}

/// Which channels go with each other.
fn relations(model: &SimulatedPlant, case: &Case) -> Vec<Relation> {
    let rate = |rate: &str, of: &str| Relation::Rate { rate: rate.into(), of: of.into() };
    if model.joint().is_some() {
        let n = case.number("gearRatio").unwrap_or_else(|| model.defaults()[2]);
        let (left, right) = ("motorAngle".into(), "loadAngle".into());
        return vec![
            Relation::Proportional { left, right, factor: n, parameter: "gearRatio".into() },
            rate("motorVelocity", "motorAngle"),
            rate("loadVelocity", "loadAngle"),
        ];
    }
    let joints = 1..=model.structure().flexible.len();
    joints
        .flat_map(|j| {
            [("jointVelocity", "jointAngle"), ("motorVelocity", "motorAngle")]
                .map(|(r, a)| rate(&format!("{r}[{j}]"), &format!("{a}[{j}]")))
        })
        .chain([rate("baseRate", "baseAttitude")])
        .collect()
}

/// Names of the parameters that the case leaves out, of arrays that lack as a whole theirs. First states are found anyway.
pub fn left_out<'a>(model: &'a SimulatedPlant, case: &Case) -> Vec<&'a str> {
    let all: Vec<&str> =
        model.parameters().iter().filter(|q| !q.is_initial()).map(|q| q.name.as_str()).collect();
    let missing = |name: &&str| !case.parameters.contains_key(*name);
    let whole = |base: &str| all.iter().filter(|n| base_name(n) == base).all(&missing);
    let mut names: Vec<&str> = Vec::new();
    for name in all.iter().filter(|n| missing(n)) {
        let base = base_name(name);
        let shown = if whole(base) { base } else { name };
        if !names.contains(&shown) {
            names.push(shown);
        }
    }
    names
}

/// `case.toml: left out, so of the preset (..): damping, linkMass[2]`; `None` if the case has all of them.
fn line(model: &SimulatedPlant, case: &Case) -> Option<String> {
    // What a robot's case leaves out is of its file.
    if plants::is_robot(&case.model) {
        return None;
    }
    let names = left_out(model, case);
    let preset = plants::preset(model.plant().model());
    (!names.is_empty()).then(|| {
        format!("{}: left out, so of the preset ({preset}): {}", case.file.display(), names.join(", "))
    })
}
