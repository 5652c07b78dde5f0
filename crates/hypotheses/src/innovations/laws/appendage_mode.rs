//! Something on a free base swings: a solar array, a boom, fuel.

use std::f64::consts::PI;

use trueup_estimation::innovations::column::ColumnPart;

use crate::innovations::along::{PlantAlong, on_coordinates};
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::operator::resonance;
use crate::innovations::shape::{LawShape, geometric};
use crate::innovations::spectrum::OrderPeaks;

/// Pole of frequency `f` in Hz and damping ratio `z`. The base's acceleration in its own axes drives it; what swings reacts with a
/// symmetric 3 x 3 matrix of masses. The amplitudes are its entries (1,1), (1,2), (2,2), (1,3), (2,3), (3,3).
pub(super) struct AppendageModeColumns;

/// Shares of the base's mass and inertia that are the units of the masses.
const UNITS: [f64; 2] = [0.05, 0.1];
/// Prior means and standard deviations of the amplitudes.
const PRIORS: [[f64; 2]; 6] = [[0.1, 0.5], [0.0, 0.5], [0.1, 0.5], [0.0, 0.5], [0.0, 0.5], [0.3, 0.8]];
/// Frequencies that are looked for, Hz.
const POLES: (f64, f64, usize) = (0.35, 14.0, 26);

impl EffectLaw for AppendageModeColumns {
    fn id(&self) -> &'static str {
        "appendage-mode"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let poles = along.base.iter().flat_map(|_| geometric(POLES));
        poles.map(|f| LawShape::new("base", "pole", &[("f", f), ("z", 0.012)])).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let base = along.base.as_ref()?;
        let (w, zeta) = (2.0 * PI * shape.value("f"), shape.value("z"));
        let unit = [UNITS[0] * base.mass, UNITS[0] * base.mass, UNITS[1] * base.inertia].map(f64::sqrt);
        let pairs = (0..3).flat_map(|i| (0..=i).map(move |k| [i, k]));
        let mut columns: Vec<Vec<ColumnPart>> = vec![Vec::new(); PRIORS.len()];
        for r in &along.runs {
            let attitude = &r.within(base.coordinates[2]).position;
            let axes: Vec<[f64; 2]> = attitude.iter().map(|a| a.sin_cos().into()).collect();
            let [x, y, turn] = base.coordinates.map(|c| r.acceleration_within(c));
            let in_axes = |f: &dyn Fn(usize, [f64; 2]) -> f64| -> Vec<f64> {
                axes.iter().enumerate().map(|(i, a)| f(i, *a)).collect()
            };
            let driven = [
                in_axes(&|i, [sin, cos]| cos * x[i] + sin * y[i]),
                in_axes(&|i, [sin, cos]| -sin * x[i] + cos * y[i]),
                turn,
            ];
            let parts = r.part_lengths();
            // (COL-18)
            let swings = driven.map(|a| resonance(&a, &parts, w, zeta).0);
            for ([i, k], column) in pairs.clone().zip(&mut columns) {
                let mut force = [(); 3].map(|()| vec![0.0; axes.len()]);
                let both = if i == k { vec![[i, k]] } else { vec![[i, k], [k, i]] };
                for [on, by] in both {
                    let mass = unit[on] * unit[by];
                    force[on].iter_mut().zip(&swings[by]).for_each(|(f, s)| *f = -mass * s);
                }
                let back = [
                    in_axes(&|t, [sin, cos]| cos * force[0][t] - sin * force[1][t]),
                    in_axes(&|t, [sin, cos]| sin * force[0][t] + cos * force[1][t]),
                    force[2].clone(),
                ];
                column.push(on_coordinates(r, base.coordinates, back));
            }
        }
        let terms = columns.into_iter().zip(PRIORS).map(|(c, [mean, sd])| (c, mean, sd));
        Some(LawTerms::new(terms.collect(), &[5]))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        [("f", 0.06), ("z", 0.6), ("f", 0.06 * 0.4)].map(|(n, s)| Refinement::relative(n, s)).to_vec()
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let Some(base) = &fit.along.base else { return Vec::new() };
        // The base's inertia was that of all; the effect's is that of the stiff part.
        let inertia = UNITS[1] * base.inertia * fit.amplitude(5);
        vec![
            LawValue::new("appendageInertia", inertia),
            LawValue::new("appendageFrequency", 2.0 * PI * fit.number("f")),
            LawValue::new("appendageDampingRatio", fit.number("z")),
            LawValue::new("baseInertia", (base.inertia - inertia).max(0.1 * base.inertia)),
        ]
    }
}
