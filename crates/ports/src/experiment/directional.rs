//! The FMU's own directional derivatives, compared with differences.

use std::sync::Arc;

use trueup_fmi_import::{AnyInstance, ImportError, UnpackedFmu};

use super::SensitivityRows;
use crate::quantity::FmuQuantities;

/// Differences of width 6e-6 do not resolve derivatives below that.
const NOISE: f64 = 1e-9;
/// A row that differs by more, relative to its largest element, is another one: differences of smooth equations reach 1e-6.
const SAME: f64 = 1e-3;

/// What a difference of that width makes of the second derivative of equations of size 1 at an end of their range.
const CURVATURE: f64 = 1e-5;

/// Rows of derivatives of rates and outputs by the states at the FMU's start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalComparison {
    /// The largest difference of a row, relative to the row's largest element.
    pub worst: f64,
    /// Rows that differ.
    pub differing: usize,
    /// Rows that are not 0.
    pub rows: usize,
}

/// `differences`: of the rates, and of the outputs in SI.
pub(super) fn error(
    fmu: &Arc<UnpackedFmu>,
    all: &FmuQuantities,
    differences: [&SensitivityRows; 2],
) -> Result<DirectionalComparison, ImportError> {
    let d = fmu.description();
    let rates: Vec<_> = d.structure.derivatives.iter().filter_map(|u| d.resolve(u.reference)).collect();
    let variable = |at: &usize| d.variables.get(*at).map(|v| v.value_reference);
    let state = |at: &usize| d.variables.get(d.resolve(d.variables.get(*at)?.derivative?)?);
    let mut unknowns: Vec<u32> = rates.iter().filter_map(variable).collect();
    unknowns.extend(&all.references[1]);
    let knowns: Vec<u32> = rates.iter().filter_map(state).map(|v| v.value_reference).collect();
    let (n, outputs) = (differences[0].len(), all.outputs.len());
    let mut instance: AnyInstance = super::state::started(fmu)?;
    let rows: Vec<(&Vec<f64>, f64)> = (differences[0].iter().map(|row| (row, 1.0)))
        .chain(differences[1].iter().zip(&all.outputs).map(|(row, q)| (row, q.factor)))
        .collect();
    let mut errors = vec![0.0_f64; n + outputs];
    let mut largest = errors.clone();
    for i in 0..n {
        let (mut seed, mut column) = (vec![0.0; n], vec![0.0; n + outputs]);
        seed[i] = 1.0;
        instance.directional(&unknowns, &knowns, &seed, &mut column)?;
        for (k, (row, factor)) in rows.iter().enumerate() {
            let own = factor * column[k];
            errors[k] = errors[k].max((own - row[i]).abs());
            largest[k] = largest[k].max(own.abs()).max(row[i].abs());
        }
    }
    let mut found = DirectionalComparison { worst: 0.0, differing: 0, rows: 0 };
    for (error, largest) in errors.iter().zip(&largest).filter(|(_, largest)| **largest > NOISE) {
        let relative = error / largest;
        found.rows += 1;
        found.differing += usize::from(!(relative <= SAME || *error <= CURVATURE));
        found.worst = found.worst.max(relative);
    }
    Ok(found)
}
