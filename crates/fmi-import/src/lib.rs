//! Loads an FMU of FMI 2.0 or 3.0 and calls it, of any vendor.
//!
//! ```no_run
//! use trueup_fmi_import::{ExperimentSetup, UnpackedFmu, InstanceOptions, fmi3};
//!
//! let fmu = UnpackedFmu::open("BouncingBall.fmu")?;
//! let mut ball = fmi3::Fmi3Instance::co_simulation(&fmu, InstanceOptions::named("ball"), fmi3::CoSimulationOptions::default())?;
//! ball.enter_initialization_mode(ExperimentSetup { stop: Some(3.0), ..ExperimentSetup::default() })?;
//! ball.exit_initialization_mode()?;
//! let step = ball.do_step(0.0, 0.01, true)?;
//! assert!(!step.terminate);
//! # Ok::<(), trueup_fmi_import::ImportError>(())
//! ```
//!
//! An FMU is native code of somebody else: opening it means trusting it. What this crate answers for is its own
//! side: lengths are checked, states and instances are freed in order and once, what the FMU hands back is
//! never followed blindly, and every status that is not OK or Warning becomes an [`ImportError`] with the FMU's messages.

#[cfg(target_os = "linux")]
mod children;
mod core;
mod error;
mod event_iteration;
pub mod exit;
pub mod fmi2;
pub mod fmi3;
mod hybrid;
mod instance;
pub mod integration;
pub mod interrupt;
pub mod isolation;
#[cfg(target_os = "linux")]
pub mod keeper;
mod library;
mod log;
mod open;
pub mod pace;
pub mod program;
mod results;
mod surroundings;
mod table;

pub use crate::core::{InstanceOptions, PreparedReferences, StateId};
pub use crate::error::{FmiError, FmiStatus, ImportError};
pub use crate::event_iteration::{MOST_PASSES, iterate_events};
pub use crate::hybrid::{ForceInput, HybridFmu, HybridPorts, MAX_ELEMENTS, element_quantities};
pub use crate::instance::{AnyInstance, DescribedCounts, StateColumns};
pub use crate::isolation::{Isolation, NoIsolation};
pub use crate::library::{UnpackedFmu, UsedInterface};
pub use crate::log::{KEPT, Listener, Message};
pub use crate::results::{CoSimulationStep, CompletedStep, EventInfo, ExperimentSetup};
pub use crate::surroundings::ProcessSurroundings;
