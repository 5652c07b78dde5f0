//! A hybrid model as FMI 2.0 and 3.0 functions, Model Exchange and Co-Simulation in one library.
//!
//! [`export_fmu!`] turns an [`FmuModel`] into the C functions of both standards. They lead through [`abi`]
//! (pointers, panics) to an [`ModelInstance`](instance::ModelInstance), which has no pointers: its
//! [state machine](state_machine), [values], [events], [derivatives],
//! [Co-Simulation](co_simulation) and [FMU states](snapshot).

pub mod abi;
pub mod co_simulation;
pub mod derivatives;
mod duals;
pub mod events;
mod export;
pub mod fault;
pub mod instance;
mod integrator;
pub mod layout;
pub mod log;
mod memory;
pub mod model;
pub mod reference;
pub mod snapshot;
pub mod state_machine;
pub mod values;

pub use model::{Exported, FmuModel};
pub use trueup_fmi;
pub use trueup_numerics;
