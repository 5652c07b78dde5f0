//! Accelerations, M, C v and momenta of a robot on a free base at given states, for a referee in another language.
//!
//! Standard input, one line each: the parent of each body, its joint (0 revolute, 1 prismatic), the bodies of the tips, the
//! parameters, then two lines per state: the states, the inputs. Standard output, four lines per state: rates of the states,
//! M row by row, C v, and linear and angular momentum with the kinetic energy.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::io::{Read, stdin};
use trueup_models::space::layout::Outputs;
use trueup_models::space::tree::{JointType, Tree};
use trueup_models::space::{MAX_DOFS, RobotStructure, SpatialFreeFlyer};
use trueup_numerics::hybrid::{At, Hybrid};

fn line(values: &[f64]) {
    println!("{}", values.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(" "));
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut text = String::new();
    stdin().read_to_string(&mut text)?;
    let mut rows =
        text.lines().map(|l| l.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>());
    let mut next = || rows.next().unwrap_or(Ok(Vec::new()));
    let parent: Vec<usize> = next()?.iter().map(|v| *v as usize).collect();
    let kind = |v: &f64| if *v == 0.0 { JointType::Revolute } else { JointType::Prismatic };
    let joint = next()?.iter().map(kind).collect();
    let tips = next()?.iter().map(|v| *v as usize).collect();
    let flexible = vec![false; parent.len()];
    let structure =
        RobotStructure { tree: Tree { parent, joint }, flexible, tips, ..RobotStructure::default() };
    let output = Outputs::new(&structure);
    let model = SpatialFreeFlyer::new(structure)?;
    let (p, sizes) = (next()?, model.sizes());
    assert_eq!(p.len(), sizes.parameters);
    loop {
        let x = next()?;
        if x.len() != sizes.states {
            return Ok(());
        }
        let u = next()?;
        let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] };
        let (mut dx, mut y) = (vec![0.0; sizes.states], vec![0.0; sizes.outputs]);
        model.rates(at, &mut dx);
        line(&dx);
        let mut m = vec![0.0; MAX_DOFS * MAX_DOFS];
        let size = model.mass_matrix(&at, &mut m);
        line(&m[..size * size]);
        let mut bias = vec![0.0; MAX_DOFS];
        model.bias(&at, &mut bias);
        line(&bias[..size]);
        model.outputs(at, &mut y);
        line(&[&y[output.linear_momentum..][..6], &y[output.kinetic_energy..][..1]].concat());
    }
}
