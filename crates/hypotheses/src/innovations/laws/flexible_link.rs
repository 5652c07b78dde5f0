//! A link bends: a share of its inertia is a tip on a spring, or it has a hinge within.

use std::f64::consts::PI;

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::operator::{resonance, resonator};
use crate::innovations::place::ShownBy;
use crate::innovations::shape::{LawShape, geometric};
use crate::innovations::spectrum::OrderPeaks;

/// Pole of frequency `f` in Hz and damping ratio `z`. Form `pole`: the amplitude is m / (1 - m), m the tip's share of the inertia. Form
/// `hinge` at the share `at` of a link's length: see [`HingeAlong`](crate::innovations::mechanics::HingeAlong).
pub(super) enum FlexibleLinkColumns {
    /// A tip on the load.
    Joint,
    /// A hinge in a link.
    Arm,
}

const POLES: (f64, f64, usize) = (1.2, 40.0, 30);
/// The same of a hinge, and where it is looked for.
const HINGES: ((f64, f64, usize), [f64; 2]) = ((0.6, 8.0, 9), [0.3, 0.6]);

/// The hinge is no coordinate of the trajectory. Held, it carries the torque n_0; let loose it moves as
/// u'' = -(M^-1)_ee n_0 - 2 zeta w u' - w^2 u, with forces -M_ie u'' on the other coordinates, and moves the tip by J_e u.
fn hinge(along: &PlantAlong<'_>, shape: &LawShape) -> Option<FilterColumn> {
    let (w, zeta) = (2.0 * PI * shape.value("f"), shape.value("z"));
    let mut column = FilterColumn::new();
    for (k, r) in along.runs.iter().enumerate() {
        let h = along.mechanics?.hinge(k, shape.joint(), shape.value("at"))?;
        // (COL-17)
        let drive: Vec<f64> = h.torque.iter().zip(&h.mobility).map(|(n, w)| n * w).collect();
        let (acceleration, deflection) = resonance(&drive, &r.steps, w, zeta);
        let mut part = ColumnPart::default();
        for (i, inertia) in h.inertia.iter().enumerate() {
            let force = inertia.iter().zip(&acceleration).map(|(m, a)| -m * a).collect();
            part.forces.extend(ColumnPart::force(i, force).forces);
        }
        for (c, channel) in along.channels.iter().enumerate() {
            if let ShownBy::Tip(axis) = channel.shows {
                let error = h.tip[axis].iter().zip(&deflection).map(|(j, u)| j * u).collect();
                part.readings.extend(ColumnPart::reading(c, error).readings);
            }
        }
        column.push(part);
    }
    Some(column)
}

impl EffectLaw for FlexibleLinkColumns {
    fn id(&self) -> &'static str {
        "flexible-link"
    }
    fn is_structure(&self) -> bool {
        true
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        match self {
            Self::Joint => along.at_springs(|_| {
                let pole = |f| LawShape::new("load", "pole", &[("f", f), ("z", 0.05)]);
                geometric(POLES).map(pole).collect()
            }),
            Self::Arm => {
                let mut all = Vec::new();
                for k in 0..along.joints.len() {
                    for at in HINGES.1 {
                        let values = |f| [("f", f), ("z", 0.02), ("at", at)];
                        let hinge = |f| LawShape::new("load", "hinge", &values(f)).at(&[k]);
                        all.extend(geometric(HINGES.0).map(hinge));
                    }
                }
                all
            }
        }
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        if shape.form == "hinge" {
            return Some(LawTerms::of_fixed_size(hinge(along, shape)?, 0.5));
        }
        let (w, zeta) = (2.0 * PI * shape.value("f"), shape.value("z"));
        let column = along.on_link_by_run(shape.joint(), |k, m| {
            let step = along.runs[k].steps[0];
            resonator(&m.torque, step, w, zeta).iter().map(|u| -u).collect()
        });
        Some(LawTerms::new(vec![(column, 0.3, 0.5)], &[0]))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        let again = match self {
            Self::Joint => 0.3,
            Self::Arm => 0.4,
        };
        [("f", 0.06), ("z", 0.6), ("f", 0.06 * again)].map(|(n, s)| Refinement::relative(n, s)).to_vec()
    }
    fn bounded(&self, _: &PlantAlong<'_>, shape: &LawShape, name: &str, value: f64) -> f64 {
        if name == "z" && shape.form == "pole" { value.max(0.004) } else { value }
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        if fit.shape.form == "hinge" {
            return Vec::new();
        }
        // Of a pole that is free the amplitude is m / (1 - m), and its frequency is that of the held tip over sqrt(1 - m).
        let held = fit.amplitudes.is_empty();
        let size = fit.amplitude(0).max(1e-3);
        let share = if held { fit.number("m") } else { size / (1.0 + size) };
        let hertz = if held { fit.number("f") } else { fit.number("f") * (1.0 - share).sqrt() };
        let load = fit.place().link_inertia;
        let (tip, w) = (share * load, 2.0 * PI * hertz);
        vec![
            LawValue::new("tipInertia", tip),
            LawValue::new("linkStiffness", tip * w * w),
            LawValue::new("linkDamping", 2.0 * fit.number("z") * tip * w),
            LawValue::new("loadInertia", (1.0 - share) * load),
        ]
    }
}
