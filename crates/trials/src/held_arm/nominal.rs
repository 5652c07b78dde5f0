//! What the nominal model of a case has of an arm.

use super::named::{HeldValue, free_values};
use super::scene::{HeldRecord, HeldScene};
use super::size::ratio;
use super::values::HeldArmValues;
use crate::case::TrialSplit;
use crate::draw::SeededDraw;
use crate::joint::short;

/// The nominal model and what a case declares of it.
#[derive(Clone, Debug)]
pub(super) struct HeldArmNominal {
    pub(super) values: HeldArmValues,
    /// Relative standard deviations by name; of friction: for all of it.
    pub(super) uncertain: Vec<(String, f64)>,
    pub(super) friction: f64,
}

/// Nothing where wrong values do not show.
pub(super) fn nominal(
    split: TrialSplit,
    s: &HeldScene,
    base: &HeldArmValues,
    runs: &[HeldRecord],
    floor: &[f64],
    d: &mut SeededDraw,
) -> Option<HeldArmNominal> {
    let mut own =
        HeldArmNominal { values: *base, uncertain: Vec::new(), friction: d.pick(&[0.05, 0.1, 0.2]) };
    let free = free_values(base);
    if split == TrialSplit::Parameters {
        let mut moved: Vec<(HeldValue, f64)> = Vec::new();
        for _ in 0..1 + d.below(3) {
            let value = d.pick(&free);
            if moved.iter().all(|(k, _)| *k != value) {
                moved.push((value, d.sign() * d.uniform(0.5, 1.0)));
            }
        }
        let target = d.log(2.0, 30.0);
        let (mut size, mut reached) = (0.1, 0.0);
        for _ in 0..6 {
            own.values = *base;
            for (value, m) in &moved {
                value.set(&mut own.values, short(value.get(base) * (1.0 + size * m)));
            }
            reached = ratio(s, base, own.values, &[], runs, floor, &[]);
            if (reached / target).ln().abs() < 0.3 {
                break;
            }
            let factor = ((target * target - 1.0) / (reached * reached - 1.0).max(1e-4)).sqrt();
            size = (size * factor.clamp(0.1, 8.0)).clamp(2e-4, 0.6);
        }
        if !(1.5..60.0).contains(&reached) {
            return None;
        }
        for (value, m) in moved {
            let doubt = short((size * m.abs() / d.uniform(0.5, 2.0)).max(0.005));
            if value.of_friction() {
                own.friction = own.friction.max(doubt);
            } else if d.chance(0.85) {
                own.uncertain.push((value.name(), doubt));
            }
        }
        return Some(own);
    }
    let off = split != TrialSplit::None && d.chance(0.6);
    if off {
        for value in &free {
            let by = if value.of_friction() { own.friction } else { 0.05 };
            value.set(&mut own.values, short(value.get(base) * (1.0 + d.sign() * by * d.uniform(0.2, 1.0))));
        }
    }
    if off || d.chance(0.7) {
        let mut names: Vec<&str> =
            free.iter().filter(|v| !v.of_friction()).map(|value| value.variable()).collect();
        names.dedup();
        names.sort_unstable();
        names.dedup();
        for name in names {
            own.uncertain.push((name.to_owned(), d.pick(&[0.03, 0.05, 0.1])));
        }
    }
    Some(own)
}
