//! Does this FMU comply with the standards? For FMUs of all vendors, with the variable, the line and the remedy.
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
pub use finding::{DescriptionFinding, DescriptionSeverity};
pub use whole::description;
