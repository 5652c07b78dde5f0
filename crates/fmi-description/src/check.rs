//! Is this FMU what the standards demand? Anybody's FMU, in plain words, with the variable, the line and the mend.
//!
//! [`archive`] checks a file or folder whole; [`description`] the modelDescription.xml only.

mod binary;
mod definitions;
mod files;
mod names;
mod structure;
mod variables;

use crate::Version;
use crate::description::Description;

pub use files::archive;

/// How much it matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Against the standard.
    Error,
    /// Allowed, but it will surprise somebody.
    Warning,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How much it matters.
    pub severity: Severity,
    /// File inside the FMU.
    pub file: String,
    /// Line in that file.
    pub line: Option<u32>,
    /// What is wrong, and what to do.
    pub message: String,
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let severity = if self.severity == Severity::Error { "error" } else { "warning" };
        match self.line {
            Some(line) => write!(f, "{severity}: {}, line {line}: {}", self.file, self.message),
            None => write!(f, "{severity}: {}: {}", self.file, self.message),
        }
    }
}

/// The findings in the making.
#[derive(Default)]
struct Findings(Vec<Finding>);

impl Findings {
    fn error(&mut self, line: impl Into<Option<u32>>, message: impl Into<String>) {
        self.add(Severity::Error, "modelDescription.xml", line.into(), message.into());
    }
    fn warning(&mut self, line: impl Into<Option<u32>>, message: impl Into<String>) {
        self.add(Severity::Warning, "modelDescription.xml", line.into(), message.into());
    }
    fn add(&mut self, severity: Severity, file: &str, line: Option<u32>, message: String) {
        self.0.push(Finding { severity, file: file.to_owned(), line, message });
    }
}

/// Checks a description; findings in the order of the file's parts.
pub fn description(d: &Description) -> Vec<Finding> {
    let mut f = Findings::default();
    head(d, &mut f);
    definitions::check(d, &mut f);
    names::check(d, &mut f);
    variables::check(d, &mut f);
    structure::check(d, &mut f);
    f.0
}

fn head(d: &Description, f: &mut Findings) {
    let known = match d.version {
        Version::V2 => d.fmi_version == "2.0",
        Version::V3 => d.fmi_version.split('-').next().is_some_and(|v| {
            let parts: Vec<&str> = v.split('.').collect();
            (2..=3).contains(&parts.len()) && parts.iter().all(|p| p.parse::<u32>().is_ok())
        }),
    };
    if !known {
        f.error(1, format!("fmiVersion=\"{}\": write \"{}\"", d.fmi_version, d.version.as_str()));
    }
    if d.model_name.is_empty() {
        f.error(1, "modelName is missing or empty: give the model's name");
    }
    if d.token.trim().is_empty() {
        let (name, call) = match d.version {
            Version::V2 => ("guid", "fmi2Instantiate"),
            Version::V3 => ("instantiationToken", "fmi3Instantiate.."),
        };
        f.error(
            1,
            format!("{name} is missing or empty: it must be the string that {call} of the binary expects"),
        );
    }
    if d.interfaces().next().is_none() {
        f.error(1, "no interface type: at least one of ModelExchange and CoSimulation (3.0: or ScheduledExecution) must be there");
    }
    for (name, i) in d.interfaces() {
        let id = &i.model_identifier;
        let c_name = id.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && id.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !c_name {
            f.error(
                i.line,
                format!("{name}: modelIdentifier=\"{id}\" is not a name in C: use letters, digits and _, no digit first"),
            );
        }
        if i.can_serialize_fmu_state && !i.can_get_and_set_fmu_state {
            f.error(
                i.line,
                format!("{name}: the FMU state can be serialized but not got: set canGetAndSetFMUState too"),
            );
        }
        if i.can_return_early_after_intermediate_update && !i.provides_intermediate_update {
            f.warning(
                i.line,
                format!("{name}: canReturnEarlyAfterIntermediateUpdate without providesIntermediateUpdate can never happen"),
            );
        }
        if i.fixed_internal_step_size.is_some_and(|h| h <= 0.0) {
            f.error(i.line, format!("{name}: fixedInternalStepSize must be greater than 0"));
        }
    }
    experiment(d, f);
}

fn experiment(d: &Description, f: &mut Findings) {
    let e = &d.experiment;
    for (name, value) in [("tolerance", e.tolerance), ("stepSize", e.step_size)] {
        if let Some(x) = value.filter(|x| !(*x > 0.0 && x.is_finite())) {
            f.error(None, format!("DefaultExperiment: {name}=\"{x}\" must be greater than 0"));
        }
    }
    if let (start, Some(stop)) = (e.start_time.unwrap_or(0.0), e.stop_time)
        && stop <= start
    {
        f.error(None, format!("DefaultExperiment: stopTime {stop} does not lie after startTime {start}"));
    }
}
