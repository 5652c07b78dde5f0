//! A page of everything that a page can hold: `cargo run -p trueup-report --example page > page.html`.
#![allow(clippy::print_stdout)]

use trueup_report::{Axis, Chart, Page, Style};

fn main() {
    let t: Vec<f64> = (0..100_001).map(|k| 1e-4 * f64::from(k)).collect();
    let wave = |f: f64, d: f64| t.iter().map(|t| (-d * t).exp() * (f * t).sin()).collect::<Vec<_>>();
    let (a, b) = (wave(12.0, 0.3), wave(9.0, 0.6));
    let coarse: Vec<f64> = (0..21).map(|k| 0.5 * f64::from(k)).collect();
    let measured: Vec<f64> = coarse.iter().map(|t| (-0.3 * t).exp() * (12.0 * t).sin() + 0.02).collect();
    let stuck: Vec<f64> = coarse.iter().map(|t| f64::from(u8::from((t * 2.0) as i32 % 3 == 0))).collect();
    let mut page = Page::new(
        "Everything a page can hold",
        "Lines over time, samples, steps, an order of convergence, a table.",
    );
    page.section("Over time", "Both charts zoom together: drag to zoom, double click to see all.");
    page.chart(
        &Chart::over_time("Two decaying waves and samples of one", "rad")
            .line("12 rad/s", &t, &a)
            .line("9 rad/s", &t, &b)
            .series("measured <12 rad/s>", &coarse, &measured, Style::Points)
            .band(2.0, 3.5),
    );
    page.chart(&Chart::over_time("Sticking", "").series("sticking", &coarse, &stuck, Style::Step));
    page.section("Convergence", "");
    let h = [1e-4, 1e-3, 1e-2, 1e-1];
    let (first, second) = (h.map(|h| 0.3 * h), h.map(|h| 0.5 * h * h));
    let axis = |label: &str, unit: &str| Axis::new(label, unit).logarithmic();
    page.chart(
        &Chart::new("Error against step", axis("step", "s"), axis("largest error", "rad"))
            .series("first order", &h, &first, Style::LineAndPoints)
            .series("second order", &h, &second, Style::LineAndPoints),
    );
    let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
    page.table(
        &["algorithm", "order", "error at 0.01 s"],
        &[row(["Jacobi", "1.00", "3.3e-3"]), row(["extrapolation", "2.00", "5.3e-5"])],
    );
    println!("{}", page.finish());
}
