//! M, C v and C of a manipulator at given states, for a referee in another language.
//!
//! Standard input, one line each: which joints are flexible (`1 0 0`), the parameters, then one line per
//! state: x (coordinates, then velocities). Standard output, three lines per state: M + J* row by row, C v, and
//! C row by row (the last two over x_0, y_0, q_0, q_1 .. q_n).
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::io::{Read, stdin};
use trueup_models::arm::PlanarManipulator;
use trueup_models::arm::chain::Chain;

fn line(values: impl Iterator<Item = f64>) {
    println!("{}", values.map(|v| format!("{v:e}")).collect::<Vec<_>>().join(" "));
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut text = String::new();
    stdin().read_to_string(&mut text)?;
    let mut rows =
        text.lines().map(|l| l.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>());
    let mut next = || rows.next().unwrap_or(Ok(Vec::new()));
    let flexible: Vec<bool> = next()?.iter().map(|f| *f != 0.0).collect();
    let p = next()?;
    let model = PlanarManipulator::new(&flexible, &[] as &[&str])?;
    let (n, d) = (model.links(), model.dofs());
    loop {
        let x = next()?;
        if x.len() != 2 * d {
            return Ok(());
        }
        let m = model.mass_matrix(&x, &p);
        line((0..d * d).map(|k| m.at(k / d, k % d)));
        let turned = Chain::new(n, &p).turned(&x[..d], &x[d..]);
        let mut bias = vec![0.0; 3 + n];
        turned.bias(&mut bias);
        line(bias.into_iter());
        let c = turned.coriolis();
        line((0..(3 + n) * (3 + n)).map(|k| c[k / (3 + n)][k % (3 + n)]));
    }
}
