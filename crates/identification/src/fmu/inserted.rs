//! What acts through the inputs of an FMU in addition to what was recorded.

use std::fmt::Debug;
use std::sync::atomic::AtomicU8;
use std::sync::{Arc, Mutex};

use trueup_fmi_import::{AnyInstance, ImportError};

use super::{FmuSubject, REFUSED};
use crate::model::CoordinateIndices;

/// Relative tolerance of the integrator: a law between ports costs more than an FMU.
const TOLERANCE: f64 = 1e-7;

/// A law between outputs and inputs.
pub trait InsertedLaw: Debug + Send + Sync {
    /// Adds to the inputs what acts at this time since the begin of the run (s), where the outputs are these.
    fn add(&self, time: f64, outputs: &[f64], inputs: &mut [f64]);
}

/// A law with the outputs that it needs, by index.
#[derive(Clone, Debug)]
pub struct InsertedForces {
    /// Which outputs.
    pub outputs: Vec<usize>,
    /// The law.
    pub law: Arc<dyn InsertedLaw>,
}

impl FmuSubject {
    /// The same with coordinates that are known otherwise than by their names, as `ports.toml` has them.
    #[must_use]
    pub fn with_coordinates(self, known: Vec<CoordinateIndices>) -> Self {
        let initial = known.iter().flat_map(|c| [c.angle, c.velocity]).collect();
        Self { known: Some(known), initial, ..self }
    }
    /// The same FMU with forces through its inputs, its instances its own.
    #[must_use]
    pub fn with_inserted(&self, inserted: InsertedForces) -> Self {
        Self {
            fmu: Arc::clone(&self.fmu),
            name: self.name.clone(),
            parameters: self.parameters.clone(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            parameter_places: self.parameter_places.clone(),
            input_places: self.input_places.clone(),
            output_places: self.output_places.clone(),
            choices: self.choices.clone(),
            chosen: self.chosen.clone(),
            states: self.states.clone(),
            initial: self.initial.clone(),
            along: AtomicU8::new(REFUSED),
            tolerance: TOLERANCE,
            known: self.known.clone(),
            inserted: Some(inserted),
            idle: Mutex::default(),
        }
    }
}

/// The same on an instance: reference and length of the variable of each output, and which element it is.
pub(super) struct InsertedHere {
    outputs: Vec<(u32, usize, usize)>,
    values: Vec<f64>,
    law: Arc<dyn InsertedLaw>,
    begin: f64,
}

impl InsertedHere {
    pub(super) fn of(subject: &FmuSubject, begin: f64) -> Option<Self> {
        let inserted = subject.inserted.as_ref()?;
        let place = |output: &usize| {
            let place = subject.output_place(*output)?;
            Some((place.reference, place.elements.len(), output - place.elements.start))
        };
        let outputs: Vec<_> = inserted.outputs.iter().filter_map(place).collect();
        Some(Self { values: vec![0.0; outputs.len()], outputs, law: inserted.law.clone(), begin })
    }

    /// Adds to the inputs what acts where the instance is.
    pub(super) fn add(
        &mut self,
        instance: &mut AnyInstance,
        time: f64,
        inputs: &mut [f64],
    ) -> Result<(), ImportError> {
        for ((reference, elements, at), value) in self.outputs.iter().zip(&mut self.values) {
            let mut all = vec![0.0; *elements];
            instance.get_float64(&[*reference], &mut all)?;
            *value = all[*at];
        }
        self.law.add(time - self.begin, &self.values, inputs);
        Ok(())
    }
}
