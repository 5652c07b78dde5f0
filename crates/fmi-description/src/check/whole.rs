//! The checks of one description, in the order of the file's parts.

use super::finding::{DescriptionFinding, Findings};
use super::{definitions, names, structure, variables};
use crate::FmiVersion;
use crate::description::Description;

/// Checks a description; findings in the order of the file's parts.
pub fn description(d: &Description) -> Vec<DescriptionFinding> {
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
        FmiVersion::V2 => d.fmi_version == "2.0",
        FmiVersion::V3 => d.fmi_version.split('-').next().is_some_and(|v| {
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
            FmiVersion::V2 => ("guid", "fmi2Instantiate"),
            FmiVersion::V3 => ("instantiationToken", "fmi3Instantiate.."),
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
        f.error(None, format!("DefaultExperiment: stopTime {stop} is not after startTime {start}"));
    }
}
