//! Lists of variables: what each is, and where its values are in a model's vectors. One list serves the model and its binding.

/// A variable of a list.
#[derive(Clone, Debug, PartialEq)]
pub struct LayoutEntry<K> {
    /// Its name.
    pub name: &'static str,
    /// Lengths of its dimensions; empty for a scalar. Elements are row by row.
    pub dimensions: Vec<usize>,
    /// SI.
    pub unit: &'static str,
    /// Further entries of its list.
    pub kind: K,
    /// Meaning.
    pub text: &'static str,
}

impl<K> LayoutEntry<K> {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.dimensions.iter().product()
    }
    /// It has no elements.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// An enumeration: names of its items, counted from 1, with what they mean.
#[derive(Debug, PartialEq, Eq)]
pub struct Items {
    /// Name of the type.
    pub name: &'static str,
    /// What is chosen.
    pub text: &'static str,
    /// Name and meaning of each item.
    pub items: &'static [(&'static str, &'static str)],
}

/// Which values a parameter may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AllowedValues {
    /// All.
    Any,
    /// Above 0.
    Positive,
    /// 0 and above.
    NotNegative,
    /// 1 and above.
    OneUp,
    /// An item of this enumeration, counted from 1.
    Item(&'static Items),
}

/// A parameter's kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Its values.
    pub allowed: AllowedValues,
    /// It may be changed between steps.
    pub tunable: bool,
    /// While it is not set, it has the value of this parameter.
    pub follows: Option<&'static str>,
    /// It only declares how a run begins.
    pub initial: bool,
}

impl Parameter {
    /// May be changed between steps.
    pub const fn tunable(allowed: AllowedValues) -> Self {
        Self { allowed, tunable: true, follows: None, initial: false }
    }
    /// Fixed once the run has begun.
    pub const fn fixed(allowed: AllowedValues) -> Self {
        Self { allowed, tunable: false, follows: None, initial: false }
    }
    /// How a run begins; any value.
    pub const fn initial() -> Self {
        Self { initial: true, ..Self::fixed(AllowedValues::Any) }
    }
    /// How a run begins; while it is not set, it has the value of that parameter.
    pub const fn following(follows: &'static str) -> Self {
        Self { follows: Some(follows), ..Self::initial() }
    }
}

/// What the factor of a linear term is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TermFactor {
    /// Numbers.
    Constant,
    /// Parameters that are fixed once the run has begun.
    Fixed,
    /// Parameters, tunable ones among them.
    Tunable,
}

/// What an output depends on. States are called `state.` and their name, inputs by their name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shows {
    /// This state, element by element.
    State(&'static str),
    /// States.
    States,
    /// States and these inputs.
    StatesAnd(&'static [&'static str]),
    /// These states and inputs.
    On(&'static [&'static str]),
    /// The same, linearly.
    Linear(&'static [(&'static str, TermFactor)]),
    /// States and inputs.
    All,
    /// Changes at events only: 0 or 1.
    Flag,
    /// Changes at events only: an item of this enumeration, counted from 1.
    Item(&'static Items),
}

/// A state's kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayoutState {
    /// Unit of its rate.
    pub rate: &'static str,
    /// Typical magnitude.
    pub nominal: f64,
    /// What its rate depends on.
    pub depends: Shows,
}

impl LayoutState {
    /// With this unit of its rate, this magnitude and these dependencies.
    pub const fn new(rate: &'static str, nominal: f64, depends: Shows) -> Self {
        Self { rate, nominal, depends }
    }
}

/// An input's kind: its start values, one per element; none: 0.
pub type InputStart = &'static [f64];

/// A parameter of any value that is fixed once the run has begun.
pub(crate) const FIXED: Parameter = Parameter::fixed(AllowedValues::Any);
/// How a run begins.
pub(crate) const INITIAL: Parameter = Parameter::initial();
/// [`Parameter::tunable`], as lists write it.
pub(crate) const fn tunable(allowed: AllowedValues) -> Parameter {
    Parameter::tunable(allowed)
}
/// [`LayoutState::new`], as lists write it.
pub(crate) const fn state(rate: &'static str, nominal: f64, depends: Shows) -> LayoutState {
    LayoutState::new(rate, nominal, depends)
}

/// A list of variables, written once: `Parameters::list` is the table, the fields of `Parameters` give the places of values.
macro_rules! layout {
    ($(#[$doc:meta])* $type:ident of $kind:ty, $s:ident: $structure:ty:
        $($field:ident $name:literal [$($d:expr),*] $(if $there:expr)?, $unit:literal, $more:expr, $text:literal;)*
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $type {
            $(#[doc = concat!("Begin of `", $name, "`.")] pub $field: usize,)*
            /// How many values there are.
            pub count: usize,
        }
        impl $type {
            /// Of a model with this structure.
            pub fn new($s: &$structure) -> Self {
                let _ = $s;
                let mut count = 0;
                $(
                    let $field = count;
                    let dimensions: &[usize] = &[$($d),*];
                    if true $(&& $there)? {
                        count += dimensions.iter().product::<usize>();
                    }
                )*
                Self { $($field,)* count }
            }
            /// The same behind so many other values.
            #[must_use]
            pub fn behind(mut self, others: usize) -> Self {
                $(self.$field += others;)*
                self.count += others;
                self
            }
            /// The variables that a model with this structure has, in order.
            pub fn list($s: &$structure) -> Vec<$crate::layout::LayoutEntry<$kind>> {
                let _ = $s;
                let mut all: Vec<$crate::layout::LayoutEntry<$kind>> = Vec::new();
                $(
                    let dimensions: Vec<usize> = vec![$($d),*];
                    if dimensions.iter().all(|d| *d > 0) $(&& $there)? {
                        all.push($crate::layout::LayoutEntry { name: $name, dimensions, unit: $unit, kind: $more, text: $text });
                    }
                )*
                all
            }
        }
    };
}
pub(crate) use layout;
