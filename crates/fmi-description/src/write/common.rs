//! What both versions write alike: attributes, units, the default experiment.

use trueup_fmi::table::{BoundaryType, Causality, LOG_CATEGORIES, ModelTable, TableVariable, Variability};
use trueup_fmi::units;

use super::error::WriteError;
use super::xml::DescriptionXml;
use crate::FmiVersion;

pub(super) fn start_demanded(v: &TableVariable) -> bool {
    matches!(v.causality, Causality::Parameter | Causality::Input) || v.variability == Variability::Constant
}

pub(super) fn causality(v: &TableVariable) -> &'static str {
    match v.causality {
        Causality::Parameter => "parameter",
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Local => "local",
        Causality::Independent => "independent",
    }
}

pub(super) fn variability(v: &TableVariable) -> &'static str {
    match v.variability {
        Variability::Constant => "constant",
        Variability::Fixed => "fixed",
        Variability::Tunable => "tunable",
        Variability::Discrete => "discrete",
        Variability::Continuous => "continuous",
    }
}

/// `initial`; inputs and the independent variable must not carry it.
pub(super) fn initial(v: &TableVariable) -> Option<&'static str> {
    match v.causality {
        Causality::Input | Causality::Independent => None,
        _ if v.start.is_empty() => Some("calculated"),
        _ => Some("exact"),
    }
}

/// With what a user needs in addition to the paper's symbol: XML has no place for a parameter that follows
/// another one.
pub(super) fn description(v: &TableVariable) -> String {
    match &v.follows {
        Some(other) => format!("{} (while not set: as {other})", v.description),
        None => v.description.clone(),
    }
}

pub(super) fn value(kind: BoundaryType, x: f64) -> String {
    match kind {
        BoundaryType::Real => format!("{x:?}"),
        BoundaryType::Boolean => (x != 0.0).to_string(),
        BoundaryType::Integer | BoundaryType::Enumeration(_) => format!("{}", x as i64),
    }
}

/// An exclusive `min` is written like any other: XML has no exclusive bound. The FMU itself refuses the bound.
pub(super) fn bounds(v: &TableVariable) -> Vec<(&'static str, String)> {
    let mut out = Vec::new();
    if v.kind != BoundaryType::Boolean {
        let finite = |x: &f64| x.is_finite();
        out.extend(v.min.filter(finite).map(|x| ("min", value(v.kind, x))));
        out.extend(v.max.filter(finite).map(|x| ("max", value(v.kind, x))));
    }
    out
}

pub(super) fn root(table: &ModelTable, version: FmiVersion, token: &str) -> Vec<(&'static str, String)> {
    let id = if version == FmiVersion::V2 { "guid" } else { "instantiationToken" };
    vec![
        ("fmiVersion", version.as_str().to_owned()),
        ("modelName", table.title().to_owned()),
        (id, token.to_owned()),
        ("description", table.description.clone()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("license", env!("CARGO_PKG_LICENSE").to_owned()),
        ("generationTool", format!("Trueup {}", env!("CARGO_PKG_VERSION"))),
        ("variableNamingConvention", "structured".to_owned()),
    ]
}

/// Only the units that are used, in the order of the list; angles can be shown in degrees.
pub(super) fn unit_definitions(x: &mut DescriptionXml, table: &ModelTable) -> Result<(), WriteError> {
    x.group("UnitDefinitions")?;
    for u in units::UNITS.iter().filter(|u| table.variables.iter().any(|v| v.unit == u.name)) {
        x.open("Unit", &[("name", u.name)])?;
        let exponents = [("kg", u.kg), ("m", u.m), ("s", u.s), ("A", u.a), ("rad", u.rad)];
        let exponents: Vec<_> =
            exponents.iter().filter(|e| e.1 != 0).map(|e| (e.0, e.1.to_string())).collect();
        x.element("BaseUnit", &exponents)?;
        if let Some(degrees) = display_unit(u.name) {
            let factor = format!("{:?}", 180.0 / std::f64::consts::PI);
            x.element("DisplayUnit", &[("name", degrees.to_owned()), ("factor", factor)])?;
        }
        x.close()?;
    }
    x.close()
}

/// In which unit people read it.
fn display_unit(unit: &str) -> Option<&'static str> {
    match unit {
        "rad" => Some("deg"),
        "rad/s" => Some("deg/s"),
        _ => None,
    }
}

/// What a unit measures, by Modelica's names. A unit that several quantities share here has none: `rad/s` is of velocities and of
/// frequencies, `Pa` of moduli.
fn quantity(unit: &str) -> Option<&'static str> {
    Some(match unit {
        "s" => "Time",
        "m" => "Length",
        "m/s" => "Velocity",
        "m/s2" => "Acceleration",
        "rad" => "Angle",
        "rad/s2" => "AngularAcceleration",
        "kg" => "Mass",
        "kg.m2" => "MomentOfInertia",
        "kg.m/s" => "Momentum",
        "kg.m2/s" => "AngularMomentum",
        "N" => "Force",
        "N.m" => "Torque",
        "N.m/rad" => "RotationalSpringConstant",
        "N.m.s/rad" => "RotationalDampingConstant",
        "N/m" => "TranslationalSpringConstant",
        "N.s/m" => "TranslationalDampingConstant",
        "J" => "Energy",
        "A" => "ElectricCurrent",
        _ => return None,
    })
}

/// Quantity, unit and the unit for display of a real variable: a frequency in `rad/s` is not to be shown in `deg/s`.
pub(super) fn measure(v: &TableVariable) -> Vec<(&'static str, String)> {
    let quantity = quantity(v.unit).map(|q| ("quantity", q));
    let unit = (!v.unit.is_empty()).then_some(("unit", v.unit));
    let display = quantity.and(display_unit(v.unit)).map(|u| ("displayUnit", u));
    [quantity, unit, display].into_iter().flatten().map(|(name, text)| (name, text.to_owned())).collect()
}

pub(super) fn log_categories(x: &mut DescriptionXml) -> Result<(), WriteError> {
    x.group("LogCategories")?;
    for (name, description) in LOG_CATEGORIES {
        x.element("Category", &[("name", *name), ("description", *description)])?;
    }
    x.close()
}

pub(super) fn default_experiment(x: &mut DescriptionXml, table: &ModelTable) -> Result<(), WriteError> {
    let e = &table.experiment;
    let numbers = [
        ("startTime", 0.0),
        ("stopTime", e.stop_time),
        ("tolerance", e.tolerance),
        ("stepSize", e.step_size),
    ];
    x.element("DefaultExperiment", &numbers.map(|(name, value)| (name, format!("{value:?}"))))
}

pub(super) fn items(x: &mut DescriptionXml, table: &ModelTable, index: usize) -> Result<(), WriteError> {
    for (i, (name, description)) in table.enumerations[index].items.iter().enumerate() {
        let number = (i + 1).to_string();
        x.element("Item", &[("name", *name), ("value", number.as_str()), ("description", *description)])?;
    }
    Ok(())
}

pub(super) fn yes<const N: usize>(names: [&'static str; N]) -> [(&'static str, String); N] {
    names.map(|name| (name, "true".to_owned()))
}

/// Outputs, states and rates that are calculated, in the order of the table. Event indicators must not be
/// among them.
pub(super) fn initial_unknowns(table: &ModelTable, states: &[(usize, usize)]) -> Vec<usize> {
    let unknown = |at: &usize| {
        let v = &table.variables[*at];
        let in_structure = v.causality == Causality::Output || states.iter().any(|(s, r)| s == at || r == at);
        in_structure && initial(v) == Some("calculated")
    };
    (0..table.variables.len()).filter(unknown).collect()
}
