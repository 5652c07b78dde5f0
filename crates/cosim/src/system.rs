//! A system as its author wrote it: names only, nothing looked up yet. TOML and SSP both become this.

use std::path::{Path, PathBuf};

use trueup_fmi_description::description::DescriptionUnit;

use crate::mistake::{InputMistake, suggestion};
pub use crate::place::SourceSpan;

/// Components, connections and how to run them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CosimSystem {
    /// The file that it was read from, for messages; empty if it was built in code.
    pub file: PathBuf,
    /// What is run.
    pub components: Vec<SystemComponent>,
    /// What is handed on.
    pub connections: Vec<Connection>,
    /// When and how.
    pub run: RunSettings,
    /// What is recorded; empty: all outputs.
    pub record: Vec<RecordedVariable>,
    /// Inputs over time from a file.
    pub inputs: Option<InputFile>,
    /// Names of the system's own connectors, and the inputs or outputs of components that they refer to.
    pub connectors: Vec<(String, Vec<VariablePort>)>,
    /// What was left out or chosen while reading, to be reported to the user.
    pub notes: Vec<String>,
    /// Each component will have a process of its own, so that of an FMU that may be had once per process there may be many.
    pub own_processes: bool,
}

/// A table that drives inputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputFile {
    /// CSV with a column `time`.
    pub file: PathBuf,
    /// Column and the input that it drives; empty: columns bear the inputs' names, `component.variable`.
    pub columns: Vec<(String, VariablePort)>,
    /// Where it was written.
    pub place: SourceSpan,
}

/// One FMU with its name in the system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SystemComponent {
    /// Unique name; of a component of a nested system `inner.name`. Empty (a system of one FMU alone): its variables
    /// are named without a component.
    pub name: String,
    /// The archive.
    pub fmu: PathBuf,
    /// `None`: Co-Simulation where the FMU offers it, else Model Exchange.
    pub interface: Option<ComponentInterface>,
    /// Start values; of several for the same element the last one counts.
    pub start: Vec<StartValue>,
    /// Own communication step in s, a whole multiple of the master's; `None`: the master's.
    pub step: Option<f64>,
    /// Where it was written.
    pub place: SourceSpan,
}

/// A place between output and input where a value has a unit of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct ConnectionHop {
    /// Unit here; `None`: as before.
    pub unit: Option<DescriptionUnit>,
    /// Linear transformation, after a conversion to this unit.
    pub factor: f64,
    /// Linear transformation, after a conversion to this unit.
    pub offset: f64,
    /// Convert to this unit; else the number is taken as it is.
    pub convert_units: bool,
}

impl Default for Connection {
    fn default() -> Self {
        Self {
            from: VariablePort::default(),
            to: VariablePort::default(),
            factor: 1.0,
            offset: 0.0,
            through: Vec::new(),
            map: Vec::new(),
            convert_units: true,
            place: SourceSpan::default(),
        }
    }
}

impl std::fmt::Display for VariablePort {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let dot = if self.component.is_empty() { "" } else { "." };
        write!(f, "{}{dot}{}", self.component, self.variable)
    }
}

/// How an FMU is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComponentInterface {
    /// The FMU steps itself.
    CoSimulation,
    /// The master integrates.
    ModelExchange,
}

/// A start value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StartValue {
    /// Variable or element (`gain`, `mass[2]`).
    pub variable: String,
    /// Its values as text, of an array row by row; of numbers one text may hold several, separated by commas.
    pub values: Vec<String>,
    /// Unit of the value where it was written, to be converted; `None`: that of the variable.
    pub unit: Option<DescriptionUnit>,
    /// Factor and offset, after the conversion of units.
    pub linear: Option<(f64, f64)>,
    /// It comes from a set of values that may hold more than the FMU has: skipped if there is no such variable.
    pub optional: bool,
    /// Where it was written.
    pub place: SourceSpan,
}

/// Hands an output (or an array, or an element of one) to an input: `input = factor * output + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// Output.
    pub from: VariablePort,
    /// Input.
    pub to: VariablePort,
    /// Linear transformation, in addition to a conversion of units.
    pub factor: f64,
    /// Linear transformation, in the unit of the input.
    pub offset: f64,
    /// Connectors with a unit of their own on the way, each with its linear transformation.
    pub through: Vec<ConnectionHop>,
    /// Values that are replaced, as text (Booleans, integers, names of items): of the output, of the input.
    pub map: Vec<(String, String)>,
    /// Convert units where they differ but measure the same.
    pub convert_units: bool,
    /// Where it was written.
    pub place: SourceSpan,
}

/// A variable of a component.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VariablePort {
    /// Component.
    pub component: String,
    /// Variable or element.
    pub variable: String,
}

/// How to run; what is `None` comes from the FMUs' default experiments or is chosen by the master, which reports why.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunSettings {
    /// Start in s.
    pub start: Option<f64>,
    /// Stop in s.
    pub stop: Option<f64>,
    /// Communication step in s (adaptive: the first one).
    pub step: Option<f64>,
    /// Relative tolerance of the coupling (adaptive, iterative) and of integrators.
    pub tolerance: Option<f64>,
    /// How the components are coupled.
    pub algorithm: Option<Algorithm>,
    /// Rows at both sides of events between communication points; `None`: of a single unit (one FMU, or several in Model
    /// Exchange).
    pub event_rows: Option<bool>,
    /// Where it was written.
    pub place: SourceSpan,
}

/// How components are coupled over a communication step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Algorithm {
    /// All step with inputs held; then feedthrough in the order of dependency.
    Jacobi,
    /// One after the other, each with the newest values.
    GaussSeidel,
    /// All step with inputs extrapolated on a line; nothing is rolled back.
    Extrapolate,
    /// Steps repeated with inputs on the line between old and new values until these settle; rolls back.
    Iterative,
    /// As [`Algorithm::Iterative`], with the step chosen by an error estimate.
    Adaptive,
}

/// Something to record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedVariable {
    /// `component.variable`, an element `component.variable[1]`, all outputs of a component `component.*`.
    pub name: String,
    /// Name of the column; `None`: the same.
    pub column: Option<String>,
    /// Every this many communication points; 0 and 1: all.
    pub every: u32,
    /// Where it was written.
    pub place: SourceSpan,
}

/// Words for the items of an enumeration: the first of each is the one that is written.
macro_rules! words {
    ($type:ident, $what:literal: $($item:ident $first:literal $(| $other:literal)*;)*) => {
        impl std::str::FromStr for $type {
            type Err = String;
            fn from_str(text: &str) -> Result<Self, String> {
                let plain = text.to_lowercase().replace(['-', '_', ' '], "");
                match plain.as_str() {
                    $(x if [$first, $($other),*].iter().any(|word| word.replace('-', "") == x) => Ok(Self::$item),)*
                    _ => {
                        let words = [$($first),*];
                        Err(format!("there is no {} {text:?}{}", $what, crate::mistake::suggestion(text, words)))
                    }
                }
            }
        }
        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(match self { $(Self::$item => $first,)* })
            }
        }
    };
}
words! { ComponentInterface, "interface":
    CoSimulation "co-simulation" | "cs";
    ModelExchange "model-exchange" | "me";
}
words! { Algorithm, "algorithm":
    Jacobi "jacobi";
    GaussSeidel "gauss-seidel";
    Extrapolate "extrapolate";
    Iterative "iterative";
    Adaptive "adaptive";
}

impl CosimSystem {
    /// What a name denotes, `component.variable`: where the component ends is looked up, both may contain dots.
    /// `None` if it names no variable.
    pub fn port(&self, name: &str) -> Option<VariablePort> {
        ComponentNames::of(&self.components).port(name)
    }

    /// Gives a variable (or an element, or a connector of the whole system) a start value as text, after all others: it
    /// counts.
    ///
    /// # Errors
    /// There is no such component; variables are looked up by [`check`](crate::check).
    pub fn set(&mut self, name: &str, value: &str, place: &SourceSpan) -> Result<(), InputMistake> {
        let own = self.connectors.iter().find(|(own, _)| own == name).map(|(_, ports)| ports.clone());
        let ports = own.or_else(|| Some(vec![self.port(name)?])).unwrap_or_default();
        let wrong = |message: String| InputMistake { place: place.clone(), message };
        if ports.is_empty() {
            return Err(wrong(format!("`{name}` names no variable; write component.variable=value")));
        }
        for port in ports {
            let Some(component) = self.components.iter_mut().find(|c| c.name == port.component) else {
                let near = suggestion(&port.component, self.components.iter().map(|c| c.name.as_str()));
                return Err(wrong(format!("there is no component `{}`{near}", port.component)));
            };
            component.start.push(StartValue {
                variable: port.variable,
                values: vec![value.to_owned()],
                place: place.clone(),
                ..StartValue::default()
            });
        }
        Ok(())
    }

    /// A single FMU: its variables are named without a component.
    pub fn of_fmu(file: &Path) -> Self {
        let place = SourceSpan { file: file.into(), line: 0 };
        let component = SystemComponent { fmu: file.into(), place, ..SystemComponent::default() };
        Self { file: file.into(), components: vec![component], ..Self::default() }
    }
}

/// Names of components, to find where a name ends and its variable begins: both may contain dots.
pub(crate) struct ComponentNames<'a>(std::collections::HashSet<&'a str>);

impl<'a> ComponentNames<'a> {
    pub(crate) fn of(components: &'a [SystemComponent]) -> Self {
        Self(components.iter().map(|c| c.name.as_str()).collect())
    }

    /// The component with the longest name that fits; of an unknown one the part before the first dot.
    pub(crate) fn port(&self, text: &str) -> Option<VariablePort> {
        let of = |component: &str, variable: &str| VariablePort {
            component: component.into(),
            variable: variable.into(),
        };
        if text.is_empty() {
            return None;
        }
        if self.0.contains("") {
            return Some(of("", text));
        }
        let dots = text.match_indices('.').map(|(at, _)| at);
        let known = dots.rev().find(|at| self.0.contains(&text[..*at]));
        let at = known.or_else(|| text.find('.'))?;
        let (component, variable) = (&text[..at], &text[at + 1..]);
        (!component.is_empty() && !variable.is_empty()).then(|| of(component, variable))
    }
}
