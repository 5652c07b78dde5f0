//! Hostile importers: random and hand-written sequences of calls on the C functions of the packed FMUs.
//!
//! After every call: the process lives; the status is one that the standard has for it, and not Fatal; what was
//! read with OK is finite; a refusal was logged with the function's name; what cannot be right was refused. After
//! every sequence each instance is reset and makes the legal run, bit for bit as a fresh one.
//!
//! - `TRUEUP_HOSTILE_SEQUENCES`: how many (20000);
//! - `TRUEUP_HOSTILE_FIRST`: number of the first one (0): a sequence that failed is repeated by its number;
//! - `TRUEUP_HOSTILE_TRACE`: prints every call before it is made.

#![allow(unsafe_code)] // calls of C functions
#![allow(missing_docs, clippy::expect_used, clippy::panic, clippy::unwrap_used, clippy::print_stderr)]
// A program of its own: nothing is reachable from outside.
#![allow(unreachable_pub, clippy::missing_safety_doc)]

mod attack;
mod by_hand;
mod callback;
mod data;
mod fmu;
mod random;
mod rest;
mod run;
mod subject;

use data::Pool;
use fmu::{Fmu, pack, packed, skipped};
use random::Random;
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::Ordering::Relaxed;
use subject::{CALLS, REFUSED, Subject, UPDATES, WAYS, Way};

/// Random calls per sequence.
const LENGTH: usize = 40;

const EFFECTS: &[&[&str]] = &[
    &["TwoMassJoint", "--effect", "backlash", "--effect", "stribeck-friction", "--effect", "flexible-link"],
    &["TwoMassJoint", "--effect", "transmission-hysteresis", "--effect", "gravity-torque"],
    &["PlanarManipulator", "--effect", "motor-friction", "--effect", "nonlinear-stiffness"],
    &["PlanarManipulator", "--effect", "table-tilt", "--effect", "base-drag", "--effect", "flexible-link"],
];

/// All FMUs under attack, loaded once.
fn fmus() -> &'static [Fmu] {
    static FMUS: OnceLock<Vec<Fmu>> = OnceLock::new();
    FMUS.get_or_init(|| {
        let mut files = packed();
        if files.is_empty() {
            skipped("neither TRUEUP_FMUS nor TRUEUP_BIN is set, so there is no FMU to attack; run ./test");
            return Vec::new();
        }
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fmus-with-effects");
        let _ = std::fs::remove_dir_all(&folder);
        if EFFECTS.iter().all(|arguments| pack(arguments, &folder)) {
            files.extend(fmu::files(&folder));
        } else {
            skipped("TRUEUP_BIN is not set: no FMU with effects is attacked");
        }
        files.iter().map(|f| Fmu::load(f)).collect()
    })
}

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |n| n.parse().unwrap_or_else(|e| panic!("{name} = {n}: {e}")))
}

fn ways(fmu: &Fmu) -> &'static [Way] {
    if fmu.is_fmi3() { &WAYS } else { &WAYS[..2] }
}

/// The legal run of a fresh instance, by FMU and way.
fn references(fmus: &[Fmu]) -> Vec<Vec<Vec<u64>>> {
    let run = |fmu, way| Subject::new(fmu, way, true, 0, "fresh".to_owned()).standard();
    fmus.iter().map(|fmu| ways(fmu).iter().map(|way| run(fmu, *way)).collect()).collect()
}

fn sequence(number: u64, fmus: &[Fmu], references: &[Vec<Vec<u64>>]) {
    let mut r = Random::new(number);
    let mut pool = Pool::default();
    // Mostly two instances, often of the same FMU, so that they can be confused.
    let first = r.below(fmus.len());
    let mut subjects = Vec::new();
    for k in 0..r.pick(&[1, 2, 2, 3]) {
        let f = if k == 0 || r.once_in(2) { first } else { r.below(fmus.len()) };
        let w = r.below(ways(&fmus[f]).len());
        let logs = !r.once_in(10);
        let seed = r.next();
        let context = format!("sequence {number}, instance {k}");
        subjects.push((Subject::new(&fmus[f], ways(&fmus[f])[w], logs, seed, context), f, w));
    }
    for _ in 0..LENGTH {
        let k = r.below(subjects.len());
        attack::attack(&mut subjects[k].0, &mut r, &mut pool);
    }
    for (s, f, w) in &mut subjects {
        if s.reset() != 0 {
            s.fail("refuses to be reset");
        }
        if s.standard() != references[*f][*w] {
            s.fail("after a reset it does not run as a fresh instance");
        }
        if r.once_in(20) {
            s.free();
            attack::after_free(s);
        }
    }
}

#[test]
fn random_sequences() {
    let fmus = fmus();
    if fmus.is_empty() {
        return;
    }
    subject::TRACE.store(std::env::var_os("TRUEUP_HOSTILE_TRACE").is_some(), Relaxed);
    let (first, count) = (number("TRUEUP_HOSTILE_FIRST", 0), number("TRUEUP_HOSTILE_SEQUENCES", 20_000));
    let references = references(fmus);
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get() as u64).min(count);
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|k| {
                let (references, range) = (&references, (first + k..first + count).step_by(threads as usize));
                scope.spawn(move || range.for_each(|n| sequence(n, fmus, references)))
            })
            .collect();
        workers.into_iter().for_each(|w| w.join().unwrap_or_else(|e| std::panic::resume_unwind(e)));
    });
    use std::io::Write as _;
    let _ = writeln!(
        std::io::stderr(),
        "hostile: {count} sequences on {} FMUs, {threads} threads: {} calls, {} refused, {} intermediate updates",
        fmus.len(),
        CALLS.load(Relaxed),
        REFUSED.load(Relaxed),
        UPDATES.load(Relaxed),
    );
}
