//! Why a description cannot be written.

/// A variable table that cannot be written: a defect of the model.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// A unit that is not in the list.
    #[error(
        "variable `{variable}` has the unit `{unit}`, which crates/fmi/src/units.rs does not know: add it there"
    )]
    Unit {
        /// Name.
        variable: String,
        /// Unit.
        unit: String,
    },
    /// Two variables of one name.
    #[error("the table has two variables `{0}`: rename one")]
    Twice(String),
    /// A name that leads nowhere.
    #[error("variable `{variable}` names `{other}` ({role}), but the table has no such variable")]
    Name {
        /// Name.
        variable: String,
        /// What it names.
        other: String,
        /// As what.
        role: &'static str,
    },
    /// Start values that do not fit the dimensions.
    #[error("variable `{variable}` has {given} start values for {elements} elements")]
    Start {
        /// Name.
        variable: String,
        /// Number of start values.
        given: usize,
        /// Number of elements.
        elements: usize,
    },
    /// An enumeration index beyond the table's enumerations.
    #[error("variable `{variable}` is of enumeration {index}, but the table has {count}")]
    Enumeration {
        /// Name.
        variable: String,
        /// Index from 0.
        index: usize,
        /// Number of enumerations.
        count: usize,
    },
    /// The XML writer failed.
    #[error("XML cannot be written: {0}")]
    Io(#[from] std::io::Error),
}
