//! Prints what this crate makes of signals that it reads: `tests/python/test_signals.py` compares it with SciPy.
//!
//! Standard input: one signal per line, values separated by commas, in the order time, x, y. Standard output: one line per
//! result, its name and its values.

#![allow(clippy::print_stdout)]

use std::io::BufRead;

use trueup_signals::process::{
    Butterworth, autocorrelation, coherence, gradient, ljung_box, nrmse, savitzky_golay, welch,
};

fn print(name: &str, values: &[f64]) {
    let values: Vec<_> = values.iter().map(|v| format!("{v:?}")).collect();
    println!("{name},{}", values.join(","));
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut signals = Vec::new();
    for line in std::io::stdin().lock().lines() {
        let values: Result<Vec<f64>, _> = line?.split(',').map(str::parse).collect();
        signals.push(values?);
    }
    let [t, x, y] = &signals[..] else { return Err("three signals are required".into()) };
    let rate = 100.0;
    for order in 1..=8 {
        for cutoff in [0.5, 7.0, 40.0] {
            let filter = Butterworth::low_pass(order, cutoff, rate).ok_or("no filter")?;
            print(&format!("filtfilt {order} {cutoff}"), &filter.filtfilt(x).ok_or("too short")?);
        }
    }
    for (window, degree, derivative) in [(5, 2, 0), (11, 3, 1), (21, 4, 2), (101, 5, 1), (7, 6, 3)] {
        let name = format!("savgol {window} {degree} {derivative}");
        print(&name, &savitzky_golay(x, window, degree, derivative, 1.0 / rate).ok_or("no window")?);
    }
    print("gradient", &gradient(t, x).ok_or("too short")?);
    for segment in [64, 101, 256] {
        print(&format!("welch {segment}"), &welch(x, rate, segment).ok_or("no spectrum")?.value);
        print(&format!("coherence {segment}"), &coherence(x, y, rate, segment).ok_or("no spectrum")?.value);
    }
    print("frequency 101", &welch(x, rate, 101).ok_or("no spectrum")?.frequency);
    print("autocorrelation", &autocorrelation(x, 40).ok_or("no variation")?);
    for lags in [1, 10, 40] {
        let test = ljung_box(y, lags, 0).ok_or("no variation")?;
        print(&format!("ljung-box {lags}"), &[test.statistic, test.p_value]);
    }
    print("nrmse", &[nrmse(x, y).ok_or("no variation")?]);
    Ok(())
}
