//! The instance, shared with the intermediate update; sizes of arrays.

use std::collections::HashMap;
use std::ops::Deref;
use std::sync::{Mutex, PoisonError};

use trueup_fmi_description::description::ArrayDimension;

use crate::core::{Core, call};
use crate::error::ImportError;
use crate::table::table3::LibraryFunctions;

pub(crate) struct InstanceInner {
    core: Core<LibraryFunctions>,
    /// Dimensions of the arrays.
    arrays: HashMap<u32, Vec<ArrayDimension>>,
    /// Their numbers of elements, as far as known.
    sizes: Mutex<HashMap<u32, usize>>,
}

// SAFETY: shared only between an instance and its own intermediate update, which runs inside the instance's
// call on the same thread.
unsafe impl Send for InstanceInner {}
// SAFETY: as above.
unsafe impl Sync for InstanceInner {}

impl Deref for InstanceInner {
    type Target = Core<LibraryFunctions>;

    fn deref(&self) -> &Self::Target {
        &self.core
    }
}

impl InstanceInner {
    pub(super) fn new(core: Core<LibraryFunctions>) -> Self {
        let arrays =
            core.fmu.description().variables.iter().filter(|variable| !variable.dimensions.is_empty());
        let arrays = arrays.map(|variable| (variable.value_reference, variable.dimensions.clone())).collect();
        Self { arrays, core, sizes: Mutex::default() }
    }

    /// Number of values of these variables: one per scalar, all elements of an array.
    pub(super) fn count(&self, references: &[u32]) -> Result<usize, ImportError> {
        if self.arrays.is_empty() {
            return Ok(references.len());
        }
        let mut sizes = self.sizes.lock().unwrap_or_else(PoisonError::into_inner);
        let mut count = 0_usize;
        for reference in references {
            let Some(dimensions) = self.arrays.get(reference) else {
                count = count.saturating_add(1);
                continue;
            };
            if let Some(size) = sizes.get(reference) {
                count = count.saturating_add(*size);
                continue;
            }
            let mut size = 1_usize;
            for dimension in dimensions {
                let length = match *dimension {
                    ArrayDimension::Fixed(length) => length,
                    ArrayDimension::Variable(parameter) => {
                        let mut length = 0_u64;
                        call!(self.core, fmi3GetUInt64, &raw const parameter, 1, &raw mut length, 1)?;
                        length
                    }
                };
                size = size.saturating_mul(usize::try_from(length).unwrap_or(usize::MAX));
            }
            sizes.insert(*reference, size);
            count = count.saturating_add(size);
        }
        Ok(count)
    }

    /// Sizes may have changed.
    pub(super) fn forget_sizes(&self) {
        self.sizes.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}
