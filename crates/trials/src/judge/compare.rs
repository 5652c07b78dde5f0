//! Two programs on the same cases, paired.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use statrs::distribution::{Binomial, DiscreteCDF};

use super::corpus;
use super::table::{Answers, CaseRow};
use crate::case::TrialPlant;
use crate::error::TrialError;

/// The same cases by two programs.
#[derive(Clone, Debug)]
pub struct PairedComparison {
    /// The cases that both have answered: by A, by B.
    pub pairs: Vec<(CaseRow, CaseRow)>,
    /// Cases that only A has answered, and only B.
    pub only: [Vec<String>; 2],
    /// The cases were chosen by how they came out: these figures rank no program.
    pub chosen: bool,
}

/// How two programs came out on cases that both answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairedCounts {
    /// Right by both.
    pub both: usize,
    /// Right by A alone.
    pub only_a: usize,
    /// Right by B alone.
    pub only_b: usize,
    /// Right by neither.
    pub neither: usize,
}

impl PairedCounts {
    /// McNemar's exact test (1947), two-sided: of the discordant cases as many are expected on either side, so that the
    /// smaller number is binomial with 1/2. 1 where no case is discordant.
    pub fn p_value(self) -> f64 {
        let discordant = (self.only_a + self.only_b) as u64;
        let fewer = self.only_a.min(self.only_b) as u64;
        Binomial::new(0.5, discordant).map_or(1.0, |b| (2.0 * b.cdf(fewer)).min(1.0))
    }
}

/// The cases of two folders in pairs.
///
/// # Errors
/// A folder that cannot be read; a case of the same name with another key: its generator was another one.
pub fn compare(a: &Answers, b: &Answers) -> Result<PairedComparison, TrialError> {
    let by_name = |answers: &Answers| -> Result<BTreeMap<String, CaseRow>, TrialError> {
        Ok(answers.rows()?.into_iter().map(|r| (r.case.clone(), r)).collect())
    };
    let (of_a, mut of_b) = (by_name(a)?, by_name(b)?);
    let chosen = [a, b].iter().any(|x| x.trials.join(corpus::FILE).is_file());
    let (mut pairs, mut only_a) = (Vec::new(), Vec::new());
    for (name, row) in of_a {
        match of_b.remove(&name) {
            Some(other) if other.seal == row.seal => pairs.push((row, other)),
            Some(_) => {
                let why = format!(
                    "case {name} has another key in {}: it was made by another generator; generate both folders with one program",
                    a.trials.display()
                );
                return Err(TrialError::at(&b.trials, why));
            }
            None => only_a.push(name),
        }
    }
    Ok(PairedComparison { pairs, only: [only_a, of_b.into_keys().collect()], chosen })
}

impl PairedComparison {
    /// Of one plant.
    pub fn counts(&self, plant: TrialPlant) -> PairedCounts {
        let mut counts = PairedCounts::default();
        for (a, b) in self.pairs.iter().filter(|(a, _)| a.plant == plant) {
            *match (a.right, b.right) {
                (true, true) => &mut counts.both,
                (true, false) => &mut counts.only_a,
                (false, true) => &mut counts.only_b,
                (false, false) => &mut counts.neither,
            } += 1;
        }
        counts
    }

    /// As a table for people, plant by plant.
    pub fn text(&self) -> String {
        let mut t = String::new();
        for plant in TrialPlant::ALL {
            if self.pairs.iter().any(|(a, _)| a.plant == plant) {
                self.plant(plant, &mut t);
            }
        }
        for (name, list) in ["A", "B"].iter().zip(&self.only) {
            if !list.is_empty() {
                let _ = writeln!(t, "{} cases have an answer of {name} alone and do not count", list.len());
            }
        }
        t
    }

    fn plant(&self, plant: TrialPlant, t: &mut String) {
        let counts = self.counts(plant);
        let PairedCounts { both, only_a, only_b, neither } = counts;
        let of = both + only_a + only_b + neither;
        let _ = writeln!(t, "{}: {of} cases by both", plant.name());
        let _ = writeln!(t, "{:10} {:>8} {:>8}", "", "B right", "B wrong");
        let _ = writeln!(t, "{:10} {both:>8} {only_a:>8}", "A right");
        let _ = writeln!(t, "{:10} {only_b:>8} {neither:>8}", "A wrong");
        if self.chosen {
            t.push_str(
                "these cases were chosen by how they came out: they show what changes, not which program is better\n",
            );
        } else {
            let p = counts.p_value();
            let _ = writeln!(t, "McNemar's exact test of {} discordant cases: p = {p:.3}", only_a + only_b);
        }
        self.time(plant, t);
        for (title, wanted) in [("right by A alone", (true, false)), ("right by B alone", (false, true))] {
            let list: Vec<_> =
                self.pairs.iter().filter(|(a, b)| a.plant == plant && (a.right, b.right) == wanted).collect();
            if list.is_empty() {
                continue;
            }
            let _ = writeln!(t, "{title}:");
            for (a, b) in list {
                let truth = if a.truth.is_empty() { &a.wanted } else { &a.truth };
                let _ = writeln!(
                    t,
                    "  {} {} {truth}, {}, ratio {:.1}: A {}; B {}",
                    a.case,
                    a.split.name(),
                    a.drive,
                    a.ratio,
                    answer(a),
                    answer(b)
                );
            }
        }
        t.push('\n');
    }

    /// Processor time, where both are known.
    fn time(&self, plant: TrialPlant, t: &mut String) {
        let known = |(a, b): &(CaseRow, CaseRow)| Some((a.processor_seconds?, b.processor_seconds?));
        let list: Vec<(f64, f64)> =
            self.pairs.iter().filter(|p| p.0.plant == plant).filter_map(known).collect();
        let sums = list.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
        let ratio = list.iter().filter(|p| p.0 > 0.0).map(|p| p.1 / p.0).collect();
        if let (Some([a, ..]), Some([b, ..]), Some([middle, low, high])) = (
            spread(list.iter().map(|p| p.0).collect()),
            spread(list.iter().map(|p| p.1).collect()),
            spread(ratio),
        ) {
            let _ = writeln!(
                t,
                "processor seconds of {} cases: A {:.1} in all, median {a:.1}; B {:.1} in all, median {b:.1}; \
                 B/A median {middle:.2}, from {low:.2} to {high:.2}",
                list.len(),
                sums.0,
                sums.1
            );
        }
    }
}

fn answer(row: &CaseRow) -> String {
    match row.claims.as_str() {
        "" => row.verdict.clone(),
        claims => format!("{} {claims}", row.verdict),
    }
}

/// Median, smallest and largest.
fn spread(mut list: Vec<f64>) -> Option<[f64; 3]> {
    list.sort_by(f64::total_cmp);
    let n = list.len();
    (n > 0).then(|| [0.5 * (list[(n - 1) / 2] + list[n / 2]), list[0], list[n - 1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exact_test_is_the_binomial_one() {
        let p = |only_a, only_b| PairedCounts { both: 7, only_a, only_b, neither: 3 }.p_value();
        // 2 (1 + 5) / 2^5; 2 (1 + 10 + 45 + 120) / 2^10 by hand.
        assert!((p(1, 4) - 0.375).abs() < 1e-12, "{}", p(1, 4));
        assert!((p(7, 3) - 0.343_75).abs() < 1e-12);
        assert!((p(0, 6) - 0.031_25).abs() < 1e-12);
        assert_eq!((p(0, 0), p(3, 3)), (1.0, 1.0));
    }

    #[test]
    fn a_spread_is_median_and_ends() {
        assert_eq!(spread(vec![3.0, 1.0, 2.0, 10.0]), Some([2.5, 1.0, 10.0]));
        assert_eq!(spread(Vec::new()), None);
    }
}
