//! What the C boundary costs: the packed FMUs' functions against the same work called natively, and against
//! Reference FMUs in the same loop. Candidates take turns in rounds; minimum and median per call, and the ratio.
//!
//! `TRUEUP_FMUS`: folder of packed FMUs (else `TRUEUP_BIN` packs them); `TRUEUP_REFERENCE_FMUS`: folder with
//! `2.0/*.fmu` and `3.0/*.fmu`.

#![allow(missing_docs, unreachable_pub, clippy::expect_used, clippy::panic, clippy::print_stdout)]
#![allow(clippy::unwrap_used, clippy::print_stderr)]

#[path = "../tests/hostile/fmu.rs"]
mod fmu;
mod importer;
mod native;

use fmu::{Fmu, packed, skipped};
use importer::Importer;
use native::native;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

const ROUNDS: usize = 200;

/// One side of a comparison: does a piece of work `n` times.
struct Candidate<'a> {
    name: String,
    work: Box<dyn FnMut(usize) + 'a>,
}

/// Takes turns; prints nanoseconds per call and the ratio to the first one.
fn compare(what: &str, calls: usize, mut candidates: Vec<Candidate>) {
    let mut times = vec![Vec::with_capacity(ROUNDS); candidates.len()];
    for round in 0..=ROUNDS {
        for (k, c) in candidates.iter_mut().enumerate() {
            let start = Instant::now();
            (c.work)(calls);
            // The first round warms up.
            if round > 0 {
                times[k].push(start.elapsed().as_secs_f64() * 1e9 / calls as f64);
            }
        }
    }
    times.iter_mut().for_each(|t| t.sort_by(f64::total_cmp));
    let [least, middle] = [times[0][0], times[0][ROUNDS / 2]];
    for (c, t) in candidates.iter().zip(&times) {
        let (min, median) = (t[0], t[ROUNDS / 2]);
        println!(
            "| {what} | {} | {min:.0} | {median:.0} | {:.2} | {:.2} |",
            c.name,
            min / least,
            median / middle
        );
    }
}

/// Inputs that move the model, and that change from call to call.
fn input(k: usize) -> f64 {
    1e-3 * ((k % 17) as f64 - 8.0)
}

fn model_exchange<'a>(name: &str, fmu: &'a Fmu) -> Candidate<'a> {
    let mut i = Importer::model_exchange(fmu);
    let mut t = 0.0;
    let work = move |n: usize| {
        for k in 0..n {
            t += 1e-9;
            black_box(i.evaluate(t, input(k)));
        }
    };
    Candidate { name: name.to_owned(), work: Box::new(work) }
}

fn co_simulation<'a>(name: &str, fmu: &'a Fmu, h: f64) -> Candidate<'a> {
    let mut i = Importer::co_simulation(fmu);
    let work = move |n: usize| {
        for k in 0..n {
            black_box(i.step(h, input(k)));
        }
    };
    Candidate { name: name.to_owned(), work: Box::new(work) }
}

/// Steps alone: no input set, no output read.
fn do_step<'a>(name: &str, fmu: &'a Fmu, h: f64) -> Candidate<'a> {
    let mut i = Importer::co_simulation(fmu);
    let work = move |n: usize| (0..n).for_each(|_| i.advance(h));
    Candidate { name: name.to_owned(), work: Box::new(work) }
}

fn main() {
    // `cargo test` runs benchmarks too, once and without --bench.
    if !std::env::args().any(|a| a == "--bench") {
        return;
    }
    let files = packed();
    if files.is_empty() {
        skipped("neither TRUEUP_FMUS nor TRUEUP_BIN is set: no FMU to measure");
        return;
    }
    println!("| work | called | min ns | median ns | ratio of min | ratio of median |");
    println!("|---|---|---|---|---|---|");
    for model in ["SpatialFreeFlyer", "PlanarManipulator", "TwoMassJoint"] {
        let load = |version: u32| {
            let ending = format!("{model}.fmi{version}.fmu");
            Fmu::load(files.iter().find(|f| f.ends_with(&ending)).unwrap_or_else(|| panic!("no {ending}")))
        };
        let (two, three) = (load(2), load(3));
        let mut model_alone = native(model);
        let mut t = 0.0;
        let rates = move |n: usize| {
            for k in 0..n {
                t += 1e-9;
                black_box(model_alone.evaluate(t, input(k)));
            }
        };
        let native_rates = Candidate { name: "native".to_owned(), work: Box::new(rates) };
        let what = format!("{model}: derivatives");
        compare(
            &what,
            2000,
            vec![native_rates, model_exchange("FMI 2.0", &two), model_exchange("FMI 3.0", &three)],
        );
        let mut model_alone = native(model);
        let steps = move |n: usize| {
            for k in 0..n {
                black_box(model_alone.step(1e-3, input(k)));
            }
        };
        let native_steps = Candidate { name: "native".to_owned(), work: Box::new(steps) };
        let what = format!("{model}: step of 1 ms");
        compare(
            &what,
            200,
            vec![native_steps, co_simulation("FMI 2.0", &two, 1e-3), co_simulation("FMI 3.0", &three, 1e-3)],
        );
        let mut model_alone = native(model);
        let steps = move |n: usize| (0..n).for_each(|_| model_alone.advance(1e-3));
        let native_steps = Candidate { name: "native".to_owned(), work: Box::new(steps) };
        let what = format!("{model}: doStep of 1 ms alone");
        compare(
            &what,
            200,
            vec![native_steps, do_step("FMI 2.0", &two, 1e-3), do_step("FMI 3.0", &three, 1e-3)],
        );
    }
    reference_fmus(&files);
}

/// The plants against Reference FMUs: different work, the same loop.
fn reference_fmus(files: &[std::path::PathBuf]) {
    let Some(folder) = std::env::var_os("TRUEUP_REFERENCE_FMUS") else {
        skipped("TRUEUP_REFERENCE_FMUS is not set: no Reference FMU to measure against");
        return;
    };
    for (version, sub) in [(2, "2.0"), (3, "3.0")] {
        let ours = format!("TwoMassJoint.fmi{version}.fmu");
        let ours = Fmu::load(files.iter().find(|f| f.ends_with(&ours)).expect("packed"));
        let theirs = ["VanDerPol", "Dahlquist"]
            .map(|n| Fmu::load(&Path::new(&folder).join(sub).join(format!("{n}.fmu"))));
        let all = || theirs.iter().chain([&ours]);
        let name = |f: &Fmu| format!("{} ({} states)", f.name, f.states);
        let me = all().map(|f| model_exchange(&name(f), f)).collect();
        compare(&format!("FMI {sub}: derivatives"), 2000, me);
        let cs = all().map(|f| co_simulation(&name(f), f, 0.1)).collect();
        compare(&format!("FMI {sub}: step of 100 ms"), 20, cs);
    }
}
