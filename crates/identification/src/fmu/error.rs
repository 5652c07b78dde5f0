//! Why an FMU cannot be fitted.

use trueup_fmi_import::{ImportError, MAX_ELEMENTS};

/// An FMU that cannot be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FmuError {
    /// It cannot be read or loaded.
    #[error(transparent)]
    Open(#[from] Box<ImportError>),
    /// It has another interface.
    #[error(
        "{file} offers {offers}, not Model Exchange: identification integrates the model itself; export it for Model Exchange"
    )]
    NoModelExchange {
        /// Its file.
        file: String,
        /// What it has.
        offers: String,
    },
    /// Its variables have more elements than anything that is fitted.
    #[error(
        "{file}: `{variable}` has {elements} elements; at most {MAX_ELEMENTS} of all variables can be taken: export the FMU with shorter arrays"
    )]
    TooLarge {
        /// Its file.
        file: String,
        /// The variable that is too much.
        variable: String,
        /// Its elements, by the start values of its dimensions.
        elements: usize,
    },
}
