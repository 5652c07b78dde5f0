//! Is this FMU what the standards demand? Anybody's FMU, in plain words, with the variable, the line and the mend.
//!
//! [`archive`] checks a file or folder whole; [`description`] the modelDescription.xml only.

mod binary;
mod definitions;
mod files;
mod finding;
mod names;
mod structure;
mod variables;
mod whole;

pub use files::archive;
pub use finding::{Finding, Severity};
pub use whole::description;
