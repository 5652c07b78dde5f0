//! Whether the FMU's state can be stored and restored.

use std::sync::Arc;

use trueup_fmi_import::{
    AnyInstance, ExperimentSetup, ImportError, InstanceOptions, UnpackedFmu, UsedInterface,
};

use super::FmuCapabilities;
use super::steps::RepeatedRun;
use crate::quantity::FmuQuantities;

/// Two ways from one stored state have to be one, bit by bit.
pub(super) fn check(
    fmu: &Arc<UnpackedFmu>,
    all: &FmuQuantities,
    by: UsedInterface,
    offers: &mut FmuCapabilities,
) {
    let d = fmu.description();
    let interface = match by {
        UsedInterface::ModelExchange => &d.model_exchange,
        UsedInterface::CoSimulation => &d.co_simulation,
    };
    offers.fmu_state = interface.as_ref().is_some_and(|i| i.can_get_and_set_fmu_state);
    if offers.fmu_state {
        let restored = match by {
            UsedInterface::ModelExchange => exchange(fmu),
            UsedInterface::CoSimulation => steps(fmu, all),
        };
        offers.fmu_state_restored = Some(restored.map_err(|e| e.to_string()));
    }
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Initialised, its first events processed.
pub(super) fn started(fmu: &Arc<UnpackedFmu>) -> Result<AnyInstance, ImportError> {
    let start = fmu.description().experiment.start_time.unwrap_or(0.0);
    let mut instance = AnyInstance::model_exchange(fmu, InstanceOptions::default())?;
    instance.enter_initialization_mode(ExperimentSetup { start, ..ExperimentSetup::default() })?;
    instance.exit_initialization_mode()?;
    instance.iterate_events()?;
    instance.enter_continuous_time_mode()?;
    Ok(instance)
}

/// States are moved away, and are back with the state.
fn exchange(fmu: &Arc<UnpackedFmu>) -> Result<bool, ImportError> {
    let mut instance = started(fmu)?;
    let (n, _) = instance.counts(fmu.description().into())?;
    if n == 0 {
        return Ok(true);
    }
    let (mut before, mut after) = (vec![0.0; n], vec![0.0; n]);
    instance.get_states(&mut before)?;
    let mut slot = None;
    instance.save(&mut slot)?;
    let away: Vec<f64> = before.iter().map(|x| x + 0.1).collect();
    instance.set_states(&away)?;
    if let Some(id) = &slot {
        instance.restore(id)?;
    }
    instance.get_states(&mut after)?;
    Ok(same(&before, &after))
}

/// A step is made twice.
fn steps(fmu: &Arc<UnpackedFmu>, all: &FmuQuantities) -> Result<bool, ImportError> {
    let e = &fmu.description().experiment;
    let (start, step) = (e.start_time.unwrap_or(0.0), e.step_size.unwrap_or(1e-3));
    let mut runs = RepeatedRun::new(fmu, all);
    let u: Vec<f64> = all.inputs.iter().map(|q| q.start + q.nominal).collect();
    let mut instance = runs.begin(&u)?;
    let mut slot = None;
    instance.save(&mut slot)?;
    instance.step(start, step, false).map_err(|e| *e)?;
    let first = runs.outputs(&mut instance)?;
    if let Some(id) = &slot {
        instance.restore(id)?;
    }
    if !u.is_empty() {
        instance.set_float64(&all.references[0], &u)?;
    }
    instance.step(start, step, false).map_err(|e| *e)?;
    Ok(same(&first, &runs.outputs(&mut instance)?))
}
