//! Blind trials: recordings whose cause is sealed, and the scorecard of a diagnosis that has not seen it.
//!
//! The generator shares neither code nor formulas with the effect library: plants written from the papers, an
//! integrator and laws of its own. Whoever diagnoses sees `cases/`; only [`score`](fn@score) opens `keys/`.

mod arm;
mod card;
mod case;
mod draw;
mod error;
mod files;
mod joint;
mod motion;
mod run;
mod said;
mod score;
mod sense;
mod slip;
mod tune;

use std::path::Path;

pub use card::{markdown, write_card};
pub use case::{Key, Plant, Split};
pub use error::Error;
pub use run::{Ran, run};
pub use score::{Aim, Card, Line, Share, score};

/// What to generate.
#[derive(Clone, Copy, Debug)]
pub struct Order {
    /// The plant.
    pub plant: Plant,
    /// What the cases are about.
    pub split: Split,
    /// How many in all shards together.
    pub count: usize,
    /// Where all draws begin.
    pub seed: u64,
    /// (i, n): every n-th case, from the i-th (1-based) on.
    pub shard: (usize, usize),
}

/// Generates cases below `directory`; one that is there already stays. `said` hears the name of each.
///
/// # Errors
/// A file that cannot be written; a case that no draw makes visible.
pub fn generate(directory: &Path, order: &Order, mut said: impl FnMut(usize, &str)) -> Result<(), Error> {
    let (i, n) = order.shard;
    for index in (0..order.count).filter(|k| k % n == i - 1) {
        let known = files::name_of(order.plant, order.split, order.seed, index);
        if !directory.join("cases").join(&known).is_dir() {
            let case = match order.plant {
                Plant::Joint => joint::generate(order.split, order.seed, index)?,
                Plant::Manipulator => arm::generate(order.split, order.seed, index)?,
            };
            files::write(directory, case)?;
        }
        said(index, &known);
    }
    files::seal(directory)
}
