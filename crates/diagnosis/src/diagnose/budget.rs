//! What the gap before consists of: each part by what the reported model misses without it.
//!
//! One part after the other, the first one takes what both would explain, and a budget so made contradicts the verdict where
//! refitted parameters imitate an effect. Here each part is taken out of the whole model, the others staying as they are.

use crate::engine::hypothesis::{Hypothesis, joint_of};
use crate::engine::replay::{CompleteModel, ReplayedReadings};
use crate::engine::search::CaseSearch;
use crate::outcome::{ErrorPart, HeldOutGap, NOISE, PARAMETERS, TOGETHER, UNEXPLAINED};

/// A part with the overall gap of the reported model without it.
struct RemovedPart {
    part: String,
    component: Option<String>,
    joint: Option<usize>,
    gap: f64,
}

impl CompleteModel {
    /// The same without the causes that `stays` does not keep, everything else as it is; `values`: its own parameters too.
    fn without(
        &self,
        search: &CaseSearch<'_>,
        stays: impl Fn(&Hypothesis) -> bool,
        values: bool,
    ) -> Option<Self> {
        let set: Vec<Hypothesis> = self.stated.set.iter().filter(|h| stays(h)).cloned().collect();
        let stated = search.state(&set).ok()?;
        let mut theta = self.stated.begins_like(&stated, &self.theta);
        let own = stated.begin.first().copied().unwrap_or(stated.unknowns.len());
        for (x, u) in theta.iter_mut().zip(&stated.unknowns).take(if values { 0 } else { own }) {
            *x = u.coordinate();
        }
        Some(Self { stated, theta })
    }
}

/// The parts of the overall gap before. `gap`: overall gap of a simulation of the compared recordings.
pub(super) fn parts(
    search: &CaseSearch<'_>,
    after: &CompleteModel,
    overall: &HeldOutGap,
    replayed: &dyn Fn(&CompleteModel) -> Option<ReplayedReadings>,
    gap: &dyn Fn(&ReplayedReadings) -> Option<f64>,
) -> Vec<ErrorPart> {
    let of = |model: Option<CompleteModel>| gap(&replayed(&model?)?).filter(|g| g.is_finite());
    let plant = search.case.subject.plant;
    let effects = || after.stated.set.iter();
    let mut removed: Vec<RemovedPart> = Vec::new();
    for h in effects() {
        if let Some(gap) = of(after.without(search, |other| other != h, true)) {
            let (part, component) = (h.id.clone(), Some(h.component.clone()));
            removed.push(RemovedPart { part, component, joint: joint_of(h, plant), gap });
        }
    }
    // Without effects this is the nominal model.
    let nominal = if effects().next().is_none() {
        Some(overall.before)
    } else {
        of(after.without(search, |_| true, false))
    };
    removed.extend(nominal.map(|gap| RemovedPart {
        part: PARAMETERS.into(),
        component: None,
        joint: None,
        gap,
    }));
    shared(removed, overall)
}

/// Shares of the square of the gap before: what the reported model gains is divided in proportion to the squares that each part
/// adds when it is missing.
fn shared(removed: Vec<RemovedPart>, overall: &HeldOutGap) -> Vec<ErrorPart> {
    let [before, after, floor] = [overall.before, overall.after, overall.floor].map(|x| x * x);
    if !before.is_normal() {
        return Vec::new();
    }
    // What does worse than the nominal model explains nothing of its gap.
    let left = after.min(before);
    let noise = floor.min(left);
    let added = |p: &RemovedPart| (p.gap * p.gap - left).max(0.0);
    let all: f64 = removed.iter().map(added).sum();
    let gained = (before - left) / before;
    let part = |part: &str, share| ErrorPart {
        part: part.into(),
        component: None,
        joint: None,
        gap_without: None,
        share,
    };
    let mut parts: Vec<ErrorPart> = Vec::new();
    for p in removed {
        let share = if all > 0.0 { gained * added(&p) / all } else { 0.0 };
        let RemovedPart { part, component, joint, gap } = p;
        parts.push(ErrorPart { part, component, joint, gap_without: Some(gap), share });
    }
    if all <= 0.0 && gained > 0.0 {
        parts.push(part(TOGETHER, gained));
    }
    parts.push(part(NOISE, noise / before));
    parts.push(part(UNEXPLAINED, (left - noise) / before));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn gaps(before: f64, after: f64, floor: f64) -> HeldOutGap {
        HeldOutGap { before, tuned: before, after, floor, ..Default::default() }
    }

    fn removed(gaps: &[f64]) -> Vec<RemovedPart> {
        let one =
            |gap: &f64| RemovedPart { part: "backlash".into(), component: None, joint: None, gap: *gap };
        gaps.iter().map(one).collect()
    }

    #[test]
    fn shares_are_the_whole_whatever_the_figures() {
        let seed = 66;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..500 {
            let mut figure = || 10f64.powf(rng.random_range(-4.0..1.0));
            let overall = gaps(figure(), figure(), figure());
            let without: Vec<f64> = (0..3).map(|_| figure()).collect();
            let parts = shared(removed(&without), &overall);
            let sum: f64 = parts.iter().map(|p| p.share).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{overall:?} {without:?}: {sum}");
            assert!(parts.iter().all(|p| p.share >= 0.0), "{overall:?} {without:?}");
            // What the model misses most without has the largest share.
            let own = &parts[..without.len()];
            let order = |a: usize, b: usize| without[a] < without[b] && own[a].share > own[b].share;
            assert!(!(0..3).any(|a| (0..3).any(|b| order(a, b))), "{overall:?} {without:?}");
        }
        assert!(shared(removed(&[1.0]), &gaps(0.0, 0.0, 0.0)).is_empty());
    }

    /// Refitted parameters that imitate an effect get no share of it: without the effect the model misses as much as before.
    #[test]
    fn parameters_that_imitate_an_effect_do_not_take_its_share() {
        let parts = shared(removed(&[0.2, 0.01]), &gaps(0.2, 0.01, 0.01));
        assert!(parts[0].share > 0.99 && parts[1].share == 0.0, "{parts:?}");
        // Nothing that is removed alone makes it worse: the parts have one share.
        let parts = shared(removed(&[0.01, 0.01]), &gaps(0.2, 0.01, 0.01));
        assert_eq!(parts[2].part, TOGETHER);
        assert!(parts[2].share > 0.99);
    }
}
