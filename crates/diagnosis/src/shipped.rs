//! What a model that is shipped has, against what is reported: a file that contradicts its own page gets no name.

use crate::diagnose::AugmentedModel;
use crate::outcome::{ClaimedAmount, Diagnosis};

/// A value that is shipped is the one that is reported, to what its text may lose.
const SAME: f64 = 1e-9;

/// A value of a model that is not the one reported.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Contradiction {
    /// It is reported and not in the model.
    #[error("{0} is reported, and the augmented model has no start value of it")]
    Missing(String),
    /// It is another one.
    #[error("{name} is {shipped} in the augmented model, reported is {reported}")]
    Differs {
        /// FMU variable.
        name: String,
        /// In the model.
        shipped: f64,
        /// In `diagnosis.json`.
        reported: f64,
    },
    /// It is outside the interval that is reported with it.
    #[error("{name} is {shipped} in the augmented model, outside the interval reported, {low} to {high}")]
    Outside {
        /// FMU variable.
        name: String,
        /// In the model.
        shipped: f64,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
}

/// Compares start values that a model is packed with (FMU variable, value) with every value that `diagnosis.json` has of them.
///
/// # Errors
/// The first value that is missing or another one.
pub fn check(
    d: &Diagnosis,
    augmented: &AugmentedModel,
    start: &[(String, f64)],
) -> Result<(), Contradiction> {
    let claims = d
        .effects
        .iter()
        .filter(|e| augmented.claims.iter().any(|c| (&c.0, &c.1, c.2) == (&e.id, &e.component, e.joint)));
    for e in claims {
        let index = e.component.split_once('[').and_then(|c| c.1.trim_end_matches(']').parse().ok());
        for (name, amount) in &e.parameters {
            let indexed = index.or(e.joint).map(|k: usize| format!("{name}[{k}]"));
            let own = indexed.filter(|n| start.iter().any(|s| s.0 == *n)).unwrap_or_else(|| name.clone());
            compare(&own, amount, start)?;
        }
    }
    for (name, amount) in d.parameters.iter().filter(|(name, _)| augmented.has(name)) {
        compare(name, amount, start)?;
    }
    Ok(())
}

impl AugmentedModel {
    /// A parameter is one of the model: gains, offsets and delays of channels are not, nor is a payload, which it has in one
    /// with the link that carries it.
    fn has(&self, name: &str) -> bool {
        let carries = |link: usize| {
            let of = |v: &str| {
                name.starts_with(&format!("{v}[{link}]")) || name.starts_with(&format!("{v}[{link},"))
            };
            ["linkMass", "linkInertia", "linkCenterOfMass"].iter().any(|v| of(v))
        };
        let channel = name.contains('.') || name.contains(' ');
        !channel && !name.starts_with("payload") && !self.payload.is_some_and(|link| carries(link + 1))
    }
}

fn compare(name: &str, amount: &ClaimedAmount, start: &[(String, f64)]) -> Result<(), Contradiction> {
    let own = start.iter().find(|s| s.0 == name);
    let shipped = own.ok_or_else(|| Contradiction::Missing(name.to_owned()))?.1;
    let reported = amount.value;
    let name = name.to_owned();
    if (shipped - reported).abs() > SAME * reported.abs() || !shipped.is_finite() {
        return Err(Contradiction::Differs { name, shipped, reported });
    }
    let low = amount.ci95[0].unwrap_or(f64::NEG_INFINITY);
    let high = amount.ci95[1].unwrap_or(f64::INFINITY);
    let by = SAME * reported.abs();
    if shipped < low - by || shipped > high + by {
        return Err(Contradiction::Outside { name, shipped, low, high });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn amount(value: f64, ci95: [Option<f64>; 2]) -> ClaimedAmount {
        ClaimedAmount { value, unit: "1".into(), ci95, ..Default::default() }
    }

    /// Values near the one reported, and intervals about it, drawn: shipped is what is the same and inside.
    #[test]
    fn a_value_that_is_another_one_or_outside_is_not_shipped() {
        let seed = 62;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..500 {
            let value: f64 = 10f64.powf(rng.random_range(-8.0..8.0)) * if rng.random() { 1.0 } else { -1.0 };
            let [below, above] = [0.0, 0.0].map(|_: f64| rng.random_range(1e-3..0.5) * value.abs());
            let own = amount(value, [Some(value - below), Some(value + above)]);
            let compared = |x: f64| compare("k", &own, &[("k".to_owned(), x)]);
            assert_eq!(compared(value), Ok(()));
            let factor: f64 = rng.random_range(1.001..9.0);
            assert!(
                matches!(compared(value * factor), Err(Contradiction::Differs { .. })),
                "{value} {factor}"
            );
            assert!(matches!(compared(f64::NAN), Err(Contradiction::Differs { .. })));
            let near = amount(value, [Some(value + below), None]);
            let compared = compare("k", &near, &[("k".to_owned(), value)]);
            assert!(matches!(compared, Err(Contradiction::Outside { .. })), "{value} {below}");
            let missing = compare("k", &own, &[("j".to_owned(), value)]);
            assert_eq!(missing, Err(Contradiction::Missing("k".to_owned())));
        }
        assert_eq!(compare("k", &amount(2.0, [None, None]), &[("k".to_owned(), 2.0)]), Ok(()));
    }
}
