//! What a wave frequency that follows posture and payload gains on DELIAN: for each move the best constant one against the best
//! one for all moves, and the frequency that the controllers estimate from their encoders, or take from a schedule.
//!
//! Moves of the shoulder's and the elbow's pitch between random postures with payloads of 0 to 10 kg. The plant is linear about
//! the posture where the move ends, without dry friction, or (`dry`) the arm itself with stick-slip in its motors; the controllers are
//! those of the FMU, sampled at 1 kHz. Vibration: root mean square of the tip's way less its mean over one period of the first
//! mode, in 6 s; `late`: after the first second.
//! `cargo run --release -p trueup-flexibility --example wave_frequency -- [MOVES] [ideal|sensors] [ground|orbit] [all|late] [linear|dry]`,
//! and behind it `schedule [vwbc|wbc|washout]`.
#![allow(clippy::print_stdout)]

mod dry;
mod estimate;
#[path = "../loops/mod.rs"]
mod loops;
mod moves;
mod schedule;

use std::error::Error;

/// What is requested.
struct Asked {
    words: Vec<String>,
}

impl Asked {
    fn has(&self, word: &str) -> bool {
        self.words.iter().any(|w| w == word)
    }
    fn how(&self) -> moves::How {
        let has = |word| self.has(word);
        moves::How { sensors: has("sensors"), orbit: has("orbit"), late: has("late"), dry: has("dry") }
    }
    fn moves(&self) -> usize {
        self.words.iter().find_map(|w| w.parse().ok()).unwrap_or(50).max(1)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let asked = Asked { words: std::env::args().skip(1).collect() };
    if asked.has("schedule") { schedule::study(&asked) } else { estimate::study(&asked) }
}
