//! Coupled FMUs whose solutions are known, and FMUs that fail on request, compiled where they are needed by the C
//! compiler `cc` from the sources in `c/`.
//!
//! ```no_run
//! use trueup_testkit::{BlockVersion, problems};
//!
//! let folder = tempfile::tempdir()?;
//! for block in problems::two_mass().blocks {
//!     let file = block.build(BlockVersion::Two, folder.path())?; // folder/<name>.fmi2.fmu
//! }
//! # Ok::<(), std::io::Error>(())
//! ```

mod block;
mod describe;
pub mod problems;

pub use block::{BlockFmu, BlockVersion, Dynamics, compiler};
pub use problems::ShotProblem;
