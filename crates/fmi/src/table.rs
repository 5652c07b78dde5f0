//! The variable table: the one place where a model's variables are written down.
//!
//! modelDescription.xml of both FMI versions, the look-up by value reference at run time, and the tables
//! of the documentation all come from it.

/// Data type of a variable at the FMI boundary; inside, every value is an `f64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundaryType {
    /// fmi2Real, fmi3Float64.
    Real,
    /// fmi2Boolean, fmi3Boolean; stored as 0 or 1.
    Boolean,
    /// fmi2Integer, fmi3Int32.
    Integer,
    /// fmi2Integer, fmi3Int64: index into [`ModelTable::enumerations`]; stored as the item's number (from 1).
    Enumeration(usize),
}

/// FMI causality.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set by the user before (or, if tunable, during) the run.
    Parameter,
    /// Set by connected models.
    Input,
    /// Read by connected models.
    Output,
    /// Internal.
    Local,
    /// Time.
    Independent,
}

/// FMI variability.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variability {
    /// Never changes, cannot be set.
    Constant,
    /// Fixed after initialization.
    Fixed,
    /// May be changed between steps (at events in Model Exchange).
    Tunable,
    /// Changes at events only.
    Discrete,
    /// Changes at any time.
    Continuous,
}

/// Where the value of a variable's first element lives; the others follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// The time.
    Time,
    /// In the parameters.
    Parameter(usize),
    /// In the inputs.
    Input(usize),
    /// In the outputs.
    Output(usize),
    /// In the continuous states.
    State(usize),
    /// In the rates of the states.
    Rate(usize),
    /// In the variable's own start values.
    Constant,
}

/// What an output or a rate depends on. A superset is allowed, a missing dependency is a defect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Depends {
    /// On every state and every input.
    All,
    /// On these variables (names of states and inputs; arrays element by element: element i of the unknown
    /// on element i of each if both have the same length, else on all elements).
    On(Vec<String>),
    /// On all states and on these inputs.
    StatesAnd(Vec<String>),
    /// On these variables, as with `On`, and linearly on each of them: its factor is made of the quantities next to it.
    Linear(Vec<(String, LinearFactor)>),
}

impl Depends {
    /// A copy of this state, or the derivative of what this state is the rate of.
    pub fn copy(state: &str) -> Self {
        Self::linear(&[(state, LinearFactor::Constant)])
    }
    /// Linearly on each of these, with such a factor.
    pub fn linear(terms: &[(&str, LinearFactor)]) -> Self {
        Self::Linear(terms.iter().map(|(name, factor)| ((*name).to_owned(), *factor)).collect())
    }
    /// What the factor of this known variable is made of, where it has one.
    pub fn factor(&self, known: &str) -> Option<LinearFactor> {
        match self {
            Self::Linear(terms) => terms.iter().find(|(name, _)| name == known).map(|(_, factor)| *factor),
            Self::All | Self::On(_) | Self::StatesAnd(_) => None,
        }
    }
}

/// What the factor of a linear term is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinearFactor {
    /// Numbers.
    Constant,
    /// Parameters that are fixed once the run has begun.
    Fixed,
    /// Parameters, tunable ones among them.
    Tunable,
}

impl LinearFactor {
    /// FMI's word for a dependency with such a factor.
    pub fn word(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Fixed => "fixed",
            Self::Tunable => "tunable",
        }
    }
}

/// One variable: a scalar or an array.
#[derive(Clone, Debug, PartialEq)]
pub struct TableVariable {
    /// Name in the structured naming convention, without indices.
    pub name: String,
    /// With the paper's symbol and equation.
    pub description: String,
    /// Data type.
    pub kind: BoundaryType,
    /// Causality.
    pub causality: Causality,
    /// Variability.
    pub variability: Variability,
    /// Lengths of an array's dimensions, empty for a scalar; elements are stored row by row.
    pub dimensions: Vec<usize>,
    /// Unit by name (see [`crate::units`]), empty without.
    pub unit: &'static str,
    /// Start values, one per element; for parameters, inputs and constants. Empty: calculated.
    pub start: Vec<f64>,
    /// Smallest value allowed.
    pub min: Option<f64>,
    /// Largest value allowed.
    pub max: Option<f64>,
    /// The bounds themselves are not allowed (the mass of a body: `min` 0, exclusive).
    pub exclusive: bool,
    /// Typical magnitude, for solvers.
    pub nominal: Option<f64>,
    /// Where it is stored.
    pub storage: Storage,
    /// For a rate: the name of its state.
    pub derivative_of: Option<String>,
    /// For a parameter: while it was not set, it has the value of this other parameter.
    pub follows: Option<String>,
    /// For outputs and rates.
    pub depends: Depends,
    /// Value reference of the first element; FMI 2.0 numbers the elements on from it, in FMI 3.0 it names
    /// the array. Assigned by [`ModelTable::number`].
    pub value_reference: u32,
}

impl TableVariable {
    /// A scalar with the common attributes; the rest by the builder methods below.
    pub fn new(
        name: &str,
        causality: Causality,
        variability: Variability,
        storage: Storage,
        unit: &'static str,
        description: &str,
    ) -> Self {
        Self {
            name: name.to_owned(),
            description: description.to_owned(),
            kind: BoundaryType::Real,
            causality,
            variability,
            dimensions: Vec::new(),
            unit,
            start: Vec::new(),
            min: None,
            max: None,
            exclusive: false,
            nominal: None,
            storage,
            derivative_of: None,
            follows: None,
            depends: Depends::All,
            value_reference: 0,
        }
    }
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.dimensions.iter().product()
    }
    /// No variable is empty (FMI allows no dimension of 0 here).
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Name of element `i` (from 0) as FMI 2.0 writes it: `a`, `a[2]`, `a[1,2]` with indices from 1; of a
    /// derivative `der(a)` it is `der(a[2])`, as the structured naming convention requires it.
    pub fn element_name(&self, i: usize) -> String {
        if self.dimensions.is_empty() {
            return self.name.clone();
        }
        // Row by row: the last index is the fastest.
        let (mut rest, mut indices) = (i, Vec::new());
        for length in self.dimensions.iter().rev() {
            indices.insert(0, (rest % length + 1).to_string());
            rest /= length;
        }
        let index = format!("[{}]", indices.join(","));
        match self.name.strip_prefix("der(").and_then(|n| n.strip_suffix(')')) {
            Some(state) => format!("der({state}{index})"),
            None => format!("{}{index}", self.name),
        }
    }
    /// Whether element `i` may have that value.
    ///
    /// # Errors
    /// One sentence with the variable, the value and the bound.
    pub fn allows(&self, i: usize, value: f64) -> Result<(), String> {
        let name = || self.element_name(i);
        if !value.is_finite() {
            return Err(format!("{} cannot be {value}; give a finite number", name()));
        }
        // A good value costs no allocation.
        let (space, unit) =
            if self.unit.is_empty() || self.unit == "1" { ("", "") } else { (" ", self.unit) };
        if let Some(min) = self.min
            && (value < min || (self.exclusive && value == min))
        {
            let must = if self.exclusive { "above" } else { "at least" };
            return Err(format!(
                "{} = {value}{space}{unit} is not allowed: it must be {must} {min}{space}{unit}",
                name()
            ));
        }
        if let Some(max) = self.max
            && value > max
        {
            return Err(format!(
                "{} = {value}{space}{unit} is not allowed: it must be at most {max}{space}{unit}",
                name()
            ));
        }
        Ok(())
    }
    /// With these dimensions.
    #[must_use]
    pub fn array(mut self, dimensions: &[usize]) -> Self {
        self.dimensions = dimensions.to_vec();
        self
    }
    /// With these start values.
    #[must_use]
    pub fn start(mut self, start: &[f64]) -> Self {
        self.start = start.to_vec();
        self
    }
    /// With this data type.
    #[must_use]
    pub fn kind(mut self, kind: BoundaryType) -> Self {
        self.kind = kind;
        self
    }
    /// Not below `min`.
    #[must_use]
    pub fn at_least(mut self, min: f64) -> Self {
        self.min = Some(min);
        self
    }
    /// Above `min`.
    #[must_use]
    pub fn above(mut self, min: f64) -> Self {
        self.min = Some(min);
        self.exclusive = true;
        self
    }
    /// Changes the lower bound: not below `min`.
    pub fn bounded(&mut self, min: f64) -> &mut Self {
        self.min = Some(min);
        self
    }
    /// Changes the lower bound: above `min`.
    pub fn bounded_above(&mut self, min: f64) -> &mut Self {
        self.min = Some(min);
        self.exclusive = true;
        self
    }
    /// With this nominal value.
    #[must_use]
    pub fn nominal(mut self, nominal: f64) -> Self {
        self.nominal = Some(nominal);
        self
    }
    /// Depends on these only.
    #[must_use]
    pub fn on(mut self, names: &[&str]) -> Self {
        self.depends = Depends::On(names.iter().map(|s| (*s).to_owned()).collect());
        self
    }
    /// Depends on all states and on these inputs.
    #[must_use]
    pub fn on_states_and(mut self, inputs: &[&str]) -> Self {
        self.depends = Depends::StatesAnd(inputs.iter().map(|s| (*s).to_owned()).collect());
        self
    }
    /// Is the derivative of this state.
    #[must_use]
    pub fn derivative_of(mut self, state: &str) -> Self {
        self.derivative_of = Some(state.to_owned());
        self
    }
    /// While unset, follows this parameter.
    #[must_use]
    pub fn follows(mut self, parameter: &str) -> Self {
        self.follows = Some(parameter.to_owned());
        self
    }
}

/// An enumeration type; items are numbered from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Enumeration {
    /// Name of the type.
    pub name: &'static str,
    /// What it chooses.
    pub description: &'static str,
    /// Item names with descriptions.
    pub items: Vec<(&'static str, &'static str)>,
}

/// Variables that belong to one plug, for tools that wire by terminals (FMI 3.0).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Terminal {
    /// Name.
    pub name: String,
    /// What it carries.
    pub description: String,
    /// Pairs of member name (the same on both sides of a connection) and variable name.
    pub members: Vec<(String, String)>,
}

/// The default experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableExperiment {
    /// In s.
    pub stop_time: f64,
    /// Relative tolerance.
    pub tolerance: f64,
    /// Communication step in s.
    pub step_size: f64,
}

/// Everything that a model declares of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelTable {
    /// Model name and model identifier.
    pub name: String,
    /// What the FMU is called, if not by that: `TwoMassJoint+backlash`.
    pub title: Option<String>,
    /// One line.
    pub description: String,
    /// Variables; the first one is the time.
    pub variables: Vec<TableVariable>,
    /// Enumeration types.
    pub enumerations: Vec<Enumeration>,
    /// Terminals.
    pub terminals: Vec<Terminal>,
    /// Number of event indicators.
    pub indicators: usize,
    /// Default experiment.
    pub experiment: TableExperiment,
}

/// Categories of log messages, with what they carry.
pub const LOG_CATEGORIES: &[(&str, &str)] = &[
    ("logStatusError", "calls that were refused or failed, with the variable and the remedy"),
    ("logStatusWarning", "calls that were carried out with a reservation"),
    ("logEvents", "events that were located: time, cause, new modes"),
];

impl ModelTable {
    /// What the FMU is called.
    pub fn title(&self) -> &str {
        self.title.as_deref().unwrap_or(&self.name)
    }
    /// Assigns the value references: consecutive over all elements, the time being 0.
    pub fn number(&mut self) {
        let mut next = 0u32;
        for v in &mut self.variables {
            v.value_reference = next;
            next += v.len() as u32;
        }
    }
    /// Value reference of event indicator `k` (from 0): after the last element of the table. FMI 3.0 requires
    /// every event indicator to be a variable; it is a local Float64 [`Self::indicator_name`].
    pub fn indicator_reference(&self, k: usize) -> u32 {
        let end = self.variables.iter().map(|v| v.value_reference + v.len() as u32).max().unwrap_or(0);
        end + k as u32
    }
    /// Name of event indicator `k` (from 0).
    pub fn indicator_name(k: usize) -> String {
        format!("eventIndicator{}", k + 1)
    }
    /// The variable of that name (arrays without index).
    pub fn find(&self, name: &str) -> Option<&TableVariable> {
        self.variables.iter().find(|v| v.name == name)
    }
    /// Gives an element (`linkMass[1]`) or a scalar another start value.
    ///
    /// # Errors
    /// No variable of that name takes a start value, or the value is outside its bounds.
    pub fn set_start(&mut self, element: &str, value: f64) -> Result<(), String> {
        for v in &mut self.variables {
            if !element.starts_with(&v.name) || v.causality == Causality::Output || v.start.is_empty() {
                continue;
            }
            let Some(i) = (0..v.len()).find(|i| v.element_name(*i) == element) else { continue };
            if v.variability == Variability::Constant {
                return Err(format!(
                    "{element} is fixed by the structure; give the structure instead of a start value"
                ));
            }
            v.allows(i, value)?;
            v.start[i] = value;
            return Ok(());
        }
        Err(format!("{} has no parameter or input {element:?}; see `trueup fmu info`", self.name))
    }
    /// Gives start values other than the model's own; a parameter that follows another one and is not named
    /// itself takes the other's.
    ///
    /// # Errors
    /// See [`ModelTable::set_start`].
    pub fn apply(&mut self, start: &[(String, f64)]) -> Result<(), String> {
        for (element, value) in start {
            self.set_start(element, *value)?;
        }
        for k in 0..self.variables.len() {
            let Some(leader) = self.variables[k].follows.as_deref().and_then(|name| self.find(name)) else {
                continue;
            };
            let values = leader.start.clone();
            let follower = &mut self.variables[k];
            for (i, value) in values.into_iter().enumerate().take(follower.start.len()) {
                if start.iter().all(|(element, _)| *element != follower.element_name(i)) {
                    follower.start[i] = value;
                }
            }
        }
        Ok(())
    }
    /// Start values of the storage class that `pick` selects, in storage order.
    pub fn starts(&self, pick: impl Fn(Storage) -> Option<usize>) -> Vec<f64> {
        let mut out = Vec::new();
        for v in &self.variables {
            let Some(base) = pick(v.storage) else { continue };
            if out.len() < base + v.len() {
                out.resize(base + v.len(), 0.0);
            }
            for (i, s) in v.start.iter().enumerate() {
                if let Some(slot) = out.get_mut(base + i) {
                    *slot = *s;
                }
            }
        }
        out
    }
    /// Start values of the parameters.
    pub fn parameter_starts(&self) -> Vec<f64> {
        self.starts(|s| if let Storage::Parameter(i) = s { Some(i) } else { None })
    }
    /// Start values of the inputs.
    pub fn input_starts(&self) -> Vec<f64> {
        self.starts(|s| if let Storage::Input(i) = s { Some(i) } else { None })
    }
}
