//! The page of a benchmark: one column an entry.

use std::fmt::Write as _;
use std::path::Path;

use super::scores::{CaseScore, WINDOWS};
use crate::case::TrialSplit;
use crate::error::TrialError;
use crate::files;
use crate::judge::score::{Share, calibration};

/// A reading is predicted where the gap is at most so many times the floor.
const NEAR: f64 = 2.0;

/// An entry with its scores.
#[derive(Clone, Debug)]
pub struct ScoredEntry {
    /// Name of the entry: that of its file.
    pub name: String,
    /// Scores by case.
    pub cases: Vec<CaseScore>,
}

/// Writes the page, and `<page>.csv` with the scores of every case.
///
/// # Errors
/// A file that cannot be written.
pub fn write_bench_card(page: &Path, entries: &[ScoredEntry]) -> Result<(), TrialError> {
    #[derive(serde::Serialize)]
    struct EntryRow<'a> {
        entry: &'a str,
        case: &'a str,
        tier: &'a str,
        split: &'a str,
        truth: &'a str,
        verdict: &'a str,
        right: bool,
        confidence: f64,
        log_score: f64,
        brier: f64,
        covered: usize,
        intervals: usize,
        gap: Option<f64>,
        floor: Option<f64>,
        windows: &'a str,
        processor_seconds: Option<f64>,
    }
    let rows: Vec<EntryRow<'_>> = entries
        .iter()
        .flat_map(|e| {
            e.cases.iter().map(|c| EntryRow {
                entry: &e.name,
                case: &c.case,
                tier: c.tier.name(),
                split: c.split.name(),
                truth: &c.truth,
                verdict: &c.verdict,
                right: c.right,
                confidence: c.confidence,
                log_score: c.log_score,
                brier: c.brier,
                covered: c.covered,
                intervals: c.intervals,
                gap: c.gap,
                floor: c.floor,
                windows: &c.windows,
                processor_seconds: c.processor_seconds,
            })
        })
        .collect();
    let table = page.with_extension("csv");
    files::whole(&table, &crate::judge::table::csv(&rows, &table)?)?;
    files::whole(page, &bench_markdown(entries))
}

/// The page as Markdown.
pub fn bench_markdown(entries: &[ScoredEntry]) -> String {
    let mut t = String::from(
        "# Benchmark of the sim-to-real gap\n\n\
         Shares with 95 % Wilson intervals, means with 95 % intervals of a normal distribution. Log score: mean ln p of the true\n\
         answer, 0 is perfect. Brier score: 0 is perfect, 2 the worst. Gap: RMS of the error of predicted hold-out readings over\n\
         their standard deviation.\n\n",
    );
    let _ = writeln!(t, "| | {} |", join(entries, |e| e.name.clone()));
    let _ = writeln!(t, "|---|{}", "---|".repeat(entries.len()));
    let mut line = |what: &str, figure: &dyn Fn(&[CaseScore]) -> String| {
        let _ = writeln!(t, "| {what} | {} |", join(entries, |e| figure(&e.cases)));
    };
    line("cases", &|c| c.len().to_string());
    line("right verdicts", &|c| share(c.iter().map(|s| s.right)));
    for split in TrialSplit::ALL {
        if entries.iter().any(|e| e.cases.iter().any(|s| s.split == split)) {
            line(&format!("- {}", split.name()), &|c| {
                share(c.iter().filter(|s| s.split == split).map(|s| s.right))
            });
        }
    }
    line("log score, nats", &|c| mean(c.iter().map(|s| s.log_score)));
    line("Brier score", &|c| mean(c.iter().map(|s| s.brier)));
    line("calibration error of the verdict", &|c| {
        let claims: Vec<(f64, bool)> = c.iter().map(|s| (s.confidence, s.right)).collect();
        calibration(&claims).map_or_else(|| "-".into(), |x| format!("{x:.3}"))
    });
    for percent in [25, 50, 75] {
        line(&format!("right among the {percent} % with most confidence"), &|c| {
            share(confident(c).into_iter().take((c.len() * percent).div_ceil(100)))
        });
    }
    line("area under the abstention curve (error)", &|c| {
        area(&confident(c)).map_or_else(|| "-".into(), |x| format!("{x:.3}"))
    });
    line("95 % intervals that cover", &|c| {
        share_of(c.iter().map(|s| s.covered).sum(), c.iter().map(|s| s.intervals).sum())
    });
    line("gap of predicted readings: median, 90 %", &|c| {
        let gaps = sorted(c.iter().filter_map(|s| s.gap));
        quantile(&gaps, 0.5)
            .zip(quantile(&gaps, 0.9))
            .map_or_else(|| "not predicted".into(), |(a, b)| format!("{a:.4}, {b:.4} ({} cases)", gaps.len()))
    });
    line("- over each fifth of the time, median", &|c| {
        let part = |k: usize| {
            let all = sorted(c.iter().filter_map(|s| s.windows.split('+').nth(k)?.parse().ok()));
            quantile(&all, 0.5).map(|x| format!("{x:.4}"))
        };
        let parts: Option<Vec<String>> = (0..WINDOWS).map(part).collect();
        parts.map_or_else(|| "-".into(), |p| p.join(", "))
    });
    line("- within twice the floor", &|c| share(c.iter().filter_map(|s| Some(s.gap? <= NEAR * s.floor?))));
    line("processor seconds: median, 95 %, all", &|c| {
        let s = sorted(c.iter().filter_map(|s| s.processor_seconds));
        quantile(&s, 0.5).zip(quantile(&s, 0.95)).map_or_else(
            || "not reported".into(),
            |(a, b)| format!("{a:.1}, {b:.1}, {:.0}", s.iter().sum::<f64>()),
        )
    });
    t
}

fn join(entries: &[ScoredEntry], figure: impl Fn(&ScoredEntry) -> String) -> String {
    entries.iter().map(figure).collect::<Vec<_>>().join(" | ")
}

fn share(hits: impl Iterator<Item = bool>) -> String {
    let s = hits.fold((0, 0), |(hits, of), hit| (hits + usize::from(hit), of + 1));
    share_of(s.0, s.1)
}

fn share_of(hits: usize, of: usize) -> String {
    let s = Share { hits, of };
    s.rate().zip(s.interval()).map_or_else(
        || "-".into(),
        |(rate, [low, high])| {
            format!("{:.1} % ({hits}/{of}; {:.1} to {:.1} %)", 100.0 * rate, 100.0 * low, 100.0 * high)
        },
    )
}

/// Mean with the 95 % interval of a normal distribution.
fn mean(values: impl Iterator<Item = f64>) -> String {
    let all: Vec<f64> = values.collect();
    let n = all.len() as f64;
    if all.is_empty() {
        return "-".into();
    }
    let mean = all.iter().sum::<f64>() / n;
    let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    format!("{mean:.3} ± {:.3}", 1.96 * (variance / n).sqrt())
}

/// Right or not, most confident first; of equal confidence in the order of the cases' names, which have no meaning.
fn confident(cases: &[CaseScore]) -> Vec<bool> {
    let mut all: Vec<&CaseScore> = cases.iter().collect();
    all.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    all.iter().map(|s| s.right).collect()
}

/// Mean over all k of the share of errors among the k most confident.
fn area(right: &[bool]) -> Option<f64> {
    let mut errors = 0.0;
    let sum: f64 = right
        .iter()
        .enumerate()
        .map(|(k, right)| {
            errors += f64::from(u8::from(!right));
            errors / (k + 1) as f64
        })
        .sum();
    (!right.is_empty()).then(|| sum / right.len() as f64)
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Nearest rank.
fn quantile(sorted: &[f64], p: f64) -> Option<f64> {
    let rank = (p * sorted.len() as f64).ceil().max(1.0) as usize;
    sorted.get(rank - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_is_the_mean_error_of_the_most_confident() {
        assert_eq!(area(&[true, true]), Some(0.0));
        assert_eq!(area(&[false, false]), Some(1.0));
        // 0, 1/2, 1/3.
        assert!((area(&[true, false, true]).unwrap() - (0.5 + 1.0 / 3.0) / 3.0).abs() < 1e-15);
        assert_eq!((quantile(&[1.0, 2.0, 3.0, 4.0], 0.5), quantile(&[7.0], 0.95)), (Some(2.0), Some(7.0)));
    }
}
