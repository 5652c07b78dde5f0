//! The error of each algorithm against the communication step: closed loops of our FMUs, coupled by the master, next to the
//! same equations in one solver. `TRUEUP_FMUS=DIR cargo bench -p trueup-acceptance --bench accuracy` reads the FMUs that
//! `trueup fmu pack -o DIR` makes, prints the tables of docs/master-accuracy.md and draws its pictures.
#![allow(missing_docs, dead_code)]
#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/closed_loops/loops.rs"]
mod loops;
#[path = "../tests/closed_loops/monolith.rs"]
mod monolith;

use std::path::Path;

use loops::{Case, LOOPS, errors, exact, folder, order, system};
use trueup_cosim::system::Algorithm;
use trueup_cosim::{Master, SeriesMemory, check};
use trueup_report::{Axis, Chart, Style, number};

const ALGORITHMS: [Algorithm; 4] =
    [Algorithm::Jacobi, Algorithm::GaussSeidel, Algorithm::Extrapolate, Algorithm::Iterative];
const HALVINGS: i32 = 6;
const TOLERANCES: [f64; 7] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];

fn main() {
    let Some(fmus) = folder() else { return };
    for case in LOOPS {
        // From short to long, as the charts go.
        let steps: Vec<f64> = (0..HALVINGS).rev().map(|k| case.longest / 2.0_f64.powi(k)).collect();
        let exact = exact(case);
        println!("\n## {} and {}", case.components[0].1, case.components[1].1);
        for version in [2, 3] {
            let fixed = ALGORITHMS.map(|algorithm| {
                let [toml, ssp] =
                    ["toml", "ssd"].map(|f| errors(case, &exact, &fmus, (f, version), algorithm, &steps));
                assert_eq!(toml, ssp, "{}: SSP and TOML differ", case.name);
                toml
            });
            let chosen = TOLERANCES.map(|tolerance| adapted(case, &fmus, version, tolerance));
            tell(version, &steps, &fixed, &chosen);
            if version == 3 {
                draw(case, &steps, &fixed, &chosen);
            }
        }
    }
}

/// What the adaptive algorithm gives.
struct Adapted {
    /// Largest error over the run, as a share of the reference's step.
    error: f64,
    /// Mean step, s.
    step: f64,
    /// Steps that each FMU took, repetitions included.
    taken: u64,
}

/// The loop with the communication step left to the error of the run.
fn adapted(case: &Case, fmus: &Path, version: u32, tolerance: f64) -> Adapted {
    let mut system = system(case, fmus, "toml", version);
    system.run.step = Some(case.longest);
    system.run.algorithm = Some(Algorithm::Adaptive);
    system.run.tolerance = Some(tolerance);
    let mut memory = SeriesMemory::default();
    let mut master = Master::new(check(&system).unwrap()).unwrap();
    let log = master.run(&mut memory).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    let exact = (case.monolith)(case.reference, memory.time());
    let far = memory.column(case.column).unwrap().iter().zip(&exact).map(|(a, b)| (a - b).abs());
    let did = log.adapted.unwrap();
    Adapted {
        error: far.fold(0.0, f64::max) / case.reference,
        step: case.stop / did.accepted as f64,
        taken: did.taken,
    }
}

fn tell(version: u32, steps: &[f64], fixed: &[Vec<f64>], chosen: &[Adapted]) {
    let line = |cells: Vec<String>| println!("| {} |", cells.join(" | "));
    let heads = steps.iter().rev().map(|h| format!("{} ms", number(1e3 * h)));
    println!("\nFMI {version}.0, largest error over the run as a share of the step of the reference:\n");
    line(["algorithm".into()].into_iter().chain(heads).chain(["order".into()]).collect());
    println!("|---|{}", "---|".repeat(steps.len() + 1));
    for (algorithm, errors) in ALGORITHMS.iter().zip(fixed) {
        let cells = errors.iter().rev().map(|e| format!("{e:.1e}"));
        let order = format!("{:.2}", order(steps, errors));
        line([format!("`{algorithm}`")].into_iter().chain(cells).chain([order]).collect());
    }
    println!("\n| `adaptive`, tolerance | error | mean step | steps of each FMU, repetitions included |");
    println!("|---|---|---|---|");
    for (tolerance, Adapted { error, step, taken }) in TOLERANCES.iter().zip(chosen) {
        line(vec![
            format!("{tolerance:.0e}"),
            format!("{error:.1e}"),
            format!("{:.2} ms", 1e3 * step),
            taken.to_string(),
        ]);
    }
}

fn draw(case: &Case, steps: &[f64], fixed: &[Vec<f64>], chosen: &[Adapted]) {
    let title = format!("{} and {}: error against step", case.components[0].1, case.components[1].1);
    let names: Vec<String> =
        ALGORITHMS.iter().zip(fixed).map(|(a, e)| format!("{a}, order {:.2}", order(steps, e))).collect();
    let mut points: Vec<(f64, f64)> = chosen.iter().map(|a| (a.step, a.error)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
    let chart = Chart::new(
        &title,
        Axis::new("communication step", "s").logarithmic(),
        Axis::new("largest error, relative", "").logarithmic(),
    );
    let chart = names.iter().zip(fixed).fold(chart, |c, (n, e)| c.series(n, steps, e, Style::LineAndPoints));
    let chart = chart.series("adaptive, mean step", &x, &y, Style::LineAndPoints);
    let file = format!("{}/../docs/pictures/error-{}.svg", env!("CARGO_MANIFEST_DIR"), case.name);
    std::fs::create_dir_all(std::path::Path::new(&file).parent().unwrap()).unwrap();
    std::fs::write(&file, chart.picture()).unwrap();
    println!("\ndocs/pictures/error-{}.svg", case.name);
}
