//! Channels as places of laws.

use crate::innovations::along::PlantAlong;
use crate::innovations::shape::LawShape;

/// A form at each channel whose errors show.
pub(super) fn shapes(
    along: &PlantAlong<'_>,
    form: &'static str,
    values: &[(&'static str, f64)],
) -> Vec<LawShape> {
    let compared = along.channels.iter().enumerate().filter(|(_, c)| c.compared);
    compared.map(|(k, c)| LawShape::new(c.place, form, values).of(&[k])).collect()
}

/// Channels of a shape; empty where none of them was recorded.
pub(super) fn channels(along: &PlantAlong<'_>, shape: &LawShape) -> Vec<usize> {
    if !shape.channels.is_empty() {
        return shape.channels.clone();
    }
    along.channels.iter().position(|c| c.place == shape.place).into_iter().collect()
}
