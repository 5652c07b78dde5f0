//! `trueup fmu info`

use std::collections::BTreeSet;

use serde_json::{Value, json};
use trueup_fmi_description::archive::Archive;
use trueup_fmi_description::description::{
    ArrayDimension, Description, DescriptionCausality, DescriptionVariable, InterfaceCapabilities,
    StartValues,
};
use trueup_fmi_description::read;

use crate::args::Info;
use crate::error::CliError;
use crate::output::say;

pub(crate) fn run(args: &Info) -> Result<(), CliError> {
    let mut archive = Archive::open(&args.file).map_err(|e| CliError::Failed(e.to_string()))?;
    let bytes = archive.description().map_err(|e| CliError::Failed(e.to_string()))?;
    let d = read::read(&bytes).map_err(|e| CliError::at(&args.file, e))?;
    let names = archive.entries().iter().filter_map(|e| e.name.strip_prefix("binaries/")?.split_once('/'));
    let platforms: BTreeSet<&str> = names.map(|(platform, _)| platform).collect();
    say(&if args.json { format!("{:#}\n", json(&d, &platforms)) } else { text(&d, &platforms) })
}

const GROUPS: [(&str, DescriptionCausality); 7] = [
    ("Independent variable", DescriptionCausality::Independent),
    ("Inputs", DescriptionCausality::Input),
    ("Outputs", DescriptionCausality::Output),
    ("Structural parameters", DescriptionCausality::StructuralParameter),
    ("Parameters", DescriptionCausality::Parameter),
    ("Calculated parameters", DescriptionCausality::CalculatedParameter),
    ("Local variables", DescriptionCausality::Local),
];

/// The capabilities that the interface declares.
fn capabilities(i: &InterfaceCapabilities) -> Vec<&'static str> {
    [
        ("state", i.can_get_and_set_fmu_state),
        ("serialization", i.can_serialize_fmu_state),
        ("directional derivatives", i.provides_directional_derivatives),
        ("adjoint derivatives", i.provides_adjoint_derivatives),
        ("variable step", i.can_handle_variable_communication_step_size),
        ("interpolated inputs", i.can_interpolate_inputs),
        ("output derivatives", i.max_output_derivative_order > 0),
        ("intermediate update", i.provides_intermediate_update),
        ("early return", i.might_return_early_from_do_step),
        ("event mode", i.has_event_mode),
        ("asynchronous", i.can_run_asynchronously),
        ("needs its tool", i.needs_execution_tool),
        ("one instance per process", i.can_be_instantiated_only_once_per_process),
    ]
    .into_iter()
    .filter_map(|(name, can)| can.then_some(name))
    .collect()
}

fn text(d: &Description, platforms: &BTreeSet<&str>) -> String {
    let mut out = format!("{} (FMI {})\n", d.model_name, d.fmi_version);
    let mut line = |name: &str, value: String| {
        if !value.is_empty() {
            out += &format!("  {name:<20}{value}\n");
        }
    };
    line("description", d.description.clone());
    line("version", d.model_version.clone());
    line("author", d.author.clone());
    line("licence", d.license.clone());
    line("made by", d.generation_tool.clone());
    line("token", d.token.clone());
    line("platforms", platforms.iter().copied().collect::<Vec<_>>().join(", "));
    for (name, i) in d.interfaces() {
        line(name, capabilities(i).join(", "));
    }
    let e = &d.experiment;
    let number = |name: &str, x: Option<f64>| x.map(|x| format!("{name} {x:?}"));
    let experiment = [
        number("start", e.start_time),
        number("stop", e.stop_time),
        number("tolerance", e.tolerance),
        number("step", e.step_size),
    ];
    line("default experiment", experiment.into_iter().flatten().collect::<Vec<_>>().join(", "));
    line("continuous states", states(d).to_string());
    line("event indicators", d.event_indicators().to_string());
    for (title, causality) in GROUPS {
        let group: Vec<&DescriptionVariable> =
            d.variables.iter().filter(|v| v.causality == causality).collect();
        if !group.is_empty() {
            out += &format!("\n{title} ({})\n", group.len());
        }
        for v in group {
            let a = d.attributes(v);
            let start = v.start.as_ref().map_or_else(String::new, |s| format!(" = {}", start(d, v, s)));
            let unit = a.unit.map_or_else(String::new, |u| format!(" {u}"));
            out += &format!("  {:<36}  {}\n", format!("{}{}{start}{unit}", v.name, size(v)), v.description);
        }
    }
    out
}

/// Number of continuous states: elements of the derivatives listed.
fn states(d: &Description) -> usize {
    let derivatives = d.structure.derivatives.iter();
    derivatives.filter_map(|u| d.elements(d.variables.get(d.resolve(u.reference)?)?)).sum()
}

fn size(v: &DescriptionVariable) -> String {
    let dimensions = v.dimensions.iter().map(|x| match x {
        ArrayDimension::Fixed(n) => format!("[{n}]"),
        ArrayDimension::Variable(reference) => format!("[#{reference}]"),
    });
    dimensions.collect()
}

fn start(d: &Description, v: &DescriptionVariable, values: &StartValues) -> String {
    let items = v.declared_type.as_deref().and_then(|t| d.declared_type(t)).map_or(&[][..], |t| &t.items);
    let whole = |x: &i64| {
        let item = items.iter().find(|item| item.value == *x);
        item.map_or_else(|| x.to_string(), |item| item.name.clone())
    };
    let texts: Vec<String> = match values {
        StartValues::Real(v) => v.iter().map(|x| format!("{x:?}")).collect(),
        StartValues::Signed(v) => v.iter().map(whole).collect(),
        StartValues::Unsigned(v) => v.iter().map(ToString::to_string).collect(),
        StartValues::Boolean(v) => v.iter().map(ToString::to_string).collect(),
        StartValues::Text(v) => v.iter().map(|s| format!("{s:?}")).collect(),
        StartValues::Binary(v) => v.iter().map(|b| format!("{} bytes", b.len())).collect(),
    };
    texts.join(", ")
}

fn json(d: &Description, platforms: &BTreeSet<&str>) -> Value {
    let interfaces: serde_json::Map<String, Value> = d
        .interfaces()
        .map(|(name, i)| {
            let value = json!({"modelIdentifier": i.model_identifier, "capabilities": capabilities(i)});
            (name.to_owned(), value)
        })
        .collect();
    let variables: Vec<Value> = d.variables.iter().map(|v| variable(d, v)).collect();
    let e = &d.experiment;
    json!({
        "modelName": d.model_name,
        "fmiVersion": d.fmi_version,
        "token": d.token,
        "description": d.description,
        "generationTool": d.generation_tool,
        "platforms": platforms,
        "interfaces": interfaces,
        "defaultExperiment": {
            "startTime": e.start_time, "stopTime": e.stop_time, "tolerance": e.tolerance, "stepSize": e.step_size,
        },
        "continuousStates": states(d),
        "eventIndicators": d.event_indicators(),
        "variables": variables,
    })
}

fn variable(d: &Description, v: &DescriptionVariable) -> Value {
    let a = d.attributes(v);
    let word = |text: String| text[..1].to_lowercase() + &text[1..];
    let dimensions: Vec<Value> = v
        .dimensions
        .iter()
        .map(|x| match x {
            ArrayDimension::Fixed(n) => json!(n),
            ArrayDimension::Variable(reference) => json!({"valueReference": reference}),
        })
        .collect();
    let start = v.start.as_ref().map(|s| match s {
        StartValues::Real(v) => json!(v),
        StartValues::Signed(v) => json!(v),
        StartValues::Unsigned(v) => json!(v),
        StartValues::Boolean(v) => json!(v),
        StartValues::Text(v) => json!(v),
        StartValues::Binary(v) => json!(v),
    });
    json!({
        "name": v.name,
        "valueReference": v.value_reference,
        "type": v.kind.name(d.version),
        "causality": word(format!("{:?}", v.causality)),
        "variability": word(format!("{:?}", v.variability)),
        "description": v.description,
        "unit": a.unit,
        "min": a.min,
        "max": a.max,
        "nominal": a.nominal,
        "dimensions": dimensions,
        "start": start,
    })
}
