//! Loading a case, with all that is wrong with it told on standard error.

mod findings;
pub(crate) mod preset;

use std::path::Path;

use trueup_identification::fmu::FmuModel;
use trueup_identification::model::{Model, ModelError};
use trueup_identification::recorded::led;
use trueup_signals::check::{self, Relation};
use trueup_signals::{Case, Finding, Kind, Loaded};

use crate::error::Error;

/// What a case is loaded for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Motors without a recorded torque are led along their measured motion.
    Identify,
    /// Static friction alone, from ramps: one that never moves the joint is told by the method.
    BreakAway,
    /// Every drive has to be recorded: what one does would be taken for an effect.
    Diagnose,
}

/// A case with its recordings, and what the intake noticed: all of it is told on standard error, as are the parameters that
/// the case leaves out.
/// `with` are effects that are fitted beside those that it names.
pub(crate) fn load(path: &Path, purpose: Purpose, with: &[String]) -> Result<(Loaded, Vec<Finding>), Error> {
    let wrong = |case: &Case, what: String| {
        trueup_signals::Error::Wrong(vec![Finding::error(Kind::UnknownModel, &case.file, what, "")])
    };
    let variables =
        |case: &Case| fitted(case, with).map(|m| m.variables()).map_err(|e| wrong(case, e.to_string()));
    let (mut loaded, mut findings) = Case::load(path, variables).map_err(|e| Error::Failed(e.to_string()))?;
    for id in with {
        if !loaded.case.with.contains(id) {
            loaded.case.with.push(id.clone());
        }
    }
    let model = Model::of_case(&loaded.case, &[]).map_err(|e| Error::at(&loaded.case.file, e))?;
    if let Some(line) = preset::line(&model, &loaded.case) {
        eprintln!("{line}");
    }
    findings.extend(check::case(&loaded, &model.variables(), &relations(&model, &loaded.case)));
    // An arm whose motors are led along their measured motion needs no torque.
    let all = [loaded.train(), loaded.holdout()].concat();
    if !led(&model, &all).is_empty() {
        let needless = |f: &Finding| match purpose {
            Purpose::Identify => matches!(f.kind, Kind::NoInput | Kind::MissingInput),
            Purpose::BreakAway | Purpose::Diagnose => f.kind == Kind::NoInput,
        };
        findings.retain(|f| !needless(f));
    }
    if purpose == Purpose::BreakAway {
        findings.retain(|f| f.kind != Kind::LittleExcitation);
    }
    tell(&findings);
    if findings.iter().any(Finding::is_error) { Err(Error::Said) } else { Ok((loaded, findings)) }
}

/// The model of a case with the effects that are fitted.
fn fitted(case: &Case, with: &[String]) -> Result<Model, ModelError> {
    let all: Vec<&str> = case.with.iter().chain(with).map(String::as_str).collect();
    Model::of_case(case, &all)
}

/// The same for an FMU; which channels go with each other is not known there.
pub(crate) fn load_for(path: &Path, model: &FmuModel) -> Result<Loaded, Error> {
    let variables = model.variables();
    let (loaded, mut findings) =
        Case::load(path, |_| Ok(variables.clone())).map_err(|e| Error::Failed(e.to_string()))?;
    findings.extend(check::case(&loaded, &variables, &[]));
    tell(&findings);
    if findings.iter().any(Finding::is_error) { Err(Error::Said) } else { Ok(loaded) }
}

/// Which channels go with each other.
fn relations(model: &Model, case: &Case) -> Vec<Relation> {
    let rate = |rate: &str, of: &str| Relation::Rate { rate: rate.into(), of: of.into() };
    if model.joint().is_some() {
        let n = case.number("gearRatio").unwrap_or_else(|| model.defaults()[2]);
        let (left, right) = ("motorAngle".into(), "loadAngle".into());
        return vec![
            Relation::Proportional { left, right, factor: n },
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

fn tell(all: &[Finding]) {
    findings::lines(all).iter().for_each(|line| crate::voice::line(line));
}
