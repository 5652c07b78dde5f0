//! modelDescription.xml: [`mod@write`] it from a model's variable table, [`pack`] an FMU, and for anybody's FMU:
//! open the [`archive`], [`read`] its description, [`check`] it against the standards.
//! Loads no library.

pub mod archive;
pub mod check;
pub mod description;
pub mod documentation;
pub mod elf;
mod macho;
pub mod pack;
pub mod platform;
pub mod read;
pub mod template;
mod version;
pub mod whole;
pub mod write;

pub use version::FmiVersion;
