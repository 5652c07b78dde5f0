//! A call of FMI 3.0 with its status; part of [`super::fmi3`].

use super::status;
use crate::fault::CallOutcome;
use crate::instance::ModelInstance;
use crate::model::FmuModel;
use trueup_fmi::abi::fmi3::{fmi3Instance, fmi3Status};

/// Does `f` with the instance behind `c`, as the function of this name; how it went.
///
/// # Safety
/// `c` is NULL or what this library gave.
pub(super) unsafe fn call<M: FmuModel>(
    c: fmi3Instance,
    function: &str,
    f: impl FnOnce(&mut ModelInstance<M>) -> CallOutcome,
) -> fmi3Status {
    // SAFETY: the importer's pointer, see the module.
    fmi3Status(unsafe { status(c, function, f) })
}
