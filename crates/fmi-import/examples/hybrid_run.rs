//! Runs an FMU for Model Exchange as a plant and prints its events and its last states.
//!
//! ```text
//! hybrid_run FILE.fmu STOP TOLERANCE < REQUEST
//! ```
//!
//! Lines of the request: `p NAME VALUE` for parameters, then `u TIME NAME VALUE ...` for inputs that are held from this time on, others
//! at their start values. Lines of the answer: `event TIME`, `state NAME VALUE`.

#![allow(clippy::print_stdout, clippy::print_stderr)]

#[path = "../tests/hybrid_run.rs"]
mod run;

use std::error::Error;
use std::io::Read as _;

use trueup_fmi_import::{HybridFmu, UnpackedFmu};
use trueup_plant::Plant as _;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, stop, tolerance] = arguments.as_slice() else {
        return Err("usage: hybrid_run FILE.fmu STOP TOLERANCE < REQUEST".into());
    };
    let plant = HybridFmu::new(&UnpackedFmu::open(file)?, 0.0)?;
    let table = plant.table();
    let mut p: Vec<f64> = table.parameters.iter().map(|q| q.start).collect();
    let (mut inputs, mut text) = (Vec::new(), String::new());
    std::io::stdin().read_to_string(&mut text)?;
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["p", name, value] => {
                let k = table.parameter(name).ok_or_else(|| format!("there is no parameter {name}"))?;
                p[k] = value.parse()?;
            }
            ["u", time, values @ ..] if values.len() % 2 == 0 => {
                let mut u: Vec<f64> = table.inputs.iter().map(|q| q.start).collect();
                for pair in values.chunks(2) {
                    let k = table.input(pair[0]).ok_or_else(|| format!("there is no input {}", pair[0]))?;
                    u[k] = pair[1].parse()?;
                }
                inputs.push((time.parse()?, u));
            }
            _ => return Err(format!("not a line of a request: {line}").into()),
        }
    }
    let done = run::run(&plant, &p, &inputs, stop.parse()?, tolerance.parse()?)?;
    done.events.iter().for_each(|t| println!("event {t:?}"));
    table.states.iter().zip(&done.x).for_each(|(q, x)| println!("state {} {x:?}", q.name));
    Ok(())
}
