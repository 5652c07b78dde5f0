//! Makes a benchmark: a sealed folder of trials, and its public part.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{BENCH_FORMAT, BenchNotice, BenchTier, mix};
use crate::cache::GENERATOR;
use crate::error::TrialError;
use crate::{Folders, files};

/// Share of a hold-out recording in which readings are shown: where it begins has to be found from them.
const OPENING: f64 = 0.2;
/// Times of a hold-out recording at which outputs are requested, at most.
const REQUESTED: usize = 200;

/// What to make.
#[derive(Clone, Debug)]
pub struct BenchOrder {
    /// The tiers.
    pub tiers: Vec<BenchTier>,
    /// Cases of each.
    pub cases: usize,
    /// Where all draws begin; `None`: a secret number of 64 bits, kept in `sealed/order.toml`.
    pub seed: Option<u64>,
}

/// `sealed/order.toml`: the same benchmark can be continued.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct SealedOrder {
    tiers: Vec<BenchTier>,
    cases: usize,
    // As text: TOML's integers have a sign.
    seed: String,
}

/// Makes what is not there yet in `directory`; `said` hears the name of each case.
///
/// # Errors
/// Another benchmark is there; a file that cannot be written; a case that no draw makes visible.
pub fn make_bench(
    directory: &Path,
    cache: Option<&Path>,
    order: &BenchOrder,
    mut said: impl FnMut(usize, &str),
) -> Result<BenchNotice, TrialError> {
    let (sealed, public) = (directory.join("sealed"), directory.join("public"));
    files::folder(&sealed)?;
    let seed = kept_seed(&sealed, order)?;
    let to = Folders { directory: &sealed, cache };
    let mut listed: BTreeMap<String, BenchTier> = BTreeMap::new();
    for tier in &order.tiers {
        for (split, count) in mix(order.cases) {
            for index in 0..count {
                let name = to.make(tier.plant(), split, seed, index)?;
                said(listed.len() + 1, &name);
                listed.insert(name, *tier);
            }
        }
    }
    let (mut tiers, mut requested) = (String::from("case,tier\n"), String::from("case,recording,time\n"));
    // In the order of their names, so that the times of the files do not show the splits.
    for (name, tier) in &listed {
        let _ = writeln!(tiers, "{name},{}", tier.name());
        for (recording, time) in publish(&sealed, &public, name, *tier)? {
            let _ = writeln!(requested, "{name},{recording},{time:.5}");
        }
    }
    files::seal(&sealed)?;
    let seals = files::text(&sealed.join("seals.csv"))?;
    files::whole(&public.join("seals.csv"), &seals)?;
    files::whole(&public.join("cases.csv"), &tiers)?;
    files::whole(&public.join("requested.csv"), &requested)?;
    files::whole(&public.join("README.md"), README)?;
    let notice = BenchNotice {
        format: BENCH_FORMAT.into(),
        tiers: order.tiers.clone(),
        cases: order.cases,
        generator: GENERATOR.into(),
        seals: files::hash(seals.as_bytes()),
    };
    let path = public.join("bench.toml");
    files::whole(&path, &toml::to_string(&notice).map_err(|e| TrialError::at(&path, e))?)?;
    Ok(notice)
}

/// The seed that the folder was begun with, else that of the order or a secret one.
fn kept_seed(sealed: &Path, order: &BenchOrder) -> Result<u64, TrialError> {
    let path = sealed.join("order.toml");
    let wrong = |why: String| TrialError::at(&path, why);
    if path.is_file() {
        let there: SealedOrder =
            toml::from_str(&files::text(&path)?).map_err(|e| TrialError::at(&path, e))?;
        let seed: u64 = there.seed.parse().map_err(|e| wrong(format!("seed `{}`: {e}", there.seed)))?;
        if there.tiers != order.tiers || there.cases != order.cases || order.seed.is_some_and(|s| s != seed) {
            return Err(wrong(
                "a benchmark of other tiers, another number of cases or another seed is here; give the same, or another folder"
                    .into(),
            ));
        }
        return Ok(seed);
    }
    let seed = order.seed.unwrap_or_else(rand::random);
    let new = SealedOrder { tiers: order.tiers.clone(), cases: order.cases, seed: seed.to_string() };
    files::whole(&path, &toml::to_string(&new).map_err(|e| TrialError::at(&path, e))?)?;
    Ok(seed)
}

/// Copies a case, without the readings of its hold-out recordings after their openings. Gives the times that are requested.
fn publish(
    sealed: &Path,
    public: &Path,
    name: &str,
    tier: BenchTier,
) -> Result<Vec<(String, f64)>, TrialError> {
    let (from, cases) = (sealed.join("cases").join(name), public.join("cases"));
    files::folder(&cases)?;
    let part = files::fresh(&cases, name)?;
    let mut requested = Vec::new();
    for file in files::list(&from)? {
        let (source, target) = (from.join(&file), part.join(&file));
        if file.starts_with("holdout") {
            let (text, times) = masked(&files::text(&source)?, tier);
            files::whole(&target, &text)?;
            requested.extend(times.into_iter().map(|t| (file.clone(), t)));
        } else {
            fs::copy(&source, &target).map_err(|e| TrialError::at(&target, e))?;
        }
    }
    files::settle(&part, &cases.join(name))?;
    Ok(requested)
}

/// A recording whose readings are empty after its opening, and times after that, at most [`REQUESTED`], spread evenly over its rows.
fn masked(text: &str, tier: BenchTier) -> (String, Vec<f64>) {
    let mut lines = text.lines();
    let header = lines.next().unwrap_or_default();
    let shown: Vec<bool> = header.split(',').map(|c| c == "time" || tier.is_input(c)).collect();
    let rows: Vec<&str> = lines.collect();
    let time = |row: &str| row.split(',').next().and_then(|t| t.parse::<f64>().ok()).unwrap_or(f64::NAN);
    let (first, last) = (rows.first().map_or(0.0, |r| time(r)), rows.last().map_or(0.0, |r| time(r)));
    let end = first + OPENING * (last - first);
    let mut out = format!("{header}\n");
    let mut hidden = Vec::new();
    for row in &rows {
        if time(row) <= end {
            out += row;
        } else {
            hidden.push(time(row));
            let cells: Vec<&str> =
                row.split(',').zip(&shown).map(|(cell, shown)| if *shown { cell } else { "" }).collect();
            out += &cells.join(",");
        }
        out.push('\n');
    }
    let step = hidden.len().div_ceil(REQUESTED).max(1);
    let times = hidden.into_iter().skip(step - 1).step_by(step).collect();
    (out, times)
}

/// What an entrant reads.
const README: &str = "# A sealed benchmark of the sim-to-real gap

Each folder of `cases` has a model (`case.toml`), recordings to fit, and hold-out recordings whose readings end after a fifth of
their length. Is something missing from the model, and what? An entry is one CSV with the columns

    case,item,name,place,recording,time,value,low,high

| item | name | further |
|---|---|---|
| verdict | no-gap, parameters, effects, ambiguous, unknown | once for each case |
| answer | no-gap, parameters, unknown, an effect's id, or two joined by `+` | value: its probability; a case's sum is at most 1 |
| effect | an effect's id that the verdict claims, likeliest first | place: component, or `component/joint`; value: its probability |
| parameter | a parameter of the model, or `id.parameter` of an effect | value, and low and high of its 95 % interval |
| output | a reading of a hold-out recording | recording, time (of requested.csv), value as predicted |
| cost | | value: processor seconds |

Only `verdict` is required. `trueup fmu list` has the effects' ids. Check an entry and get a receipt with its hash, before the keys
are out, with `trueup bench submit . entry.csv -o receipt.toml`; score it when they are with `trueup bench score`.
`bench.toml` has the hash of `seals.csv`, which has that of every key.
";
