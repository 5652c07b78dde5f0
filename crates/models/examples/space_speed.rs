//! How long one evaluation of a robot's rates takes, ns: the fastest of 40 batches. `space_speed CASE`, CASE being `chaser`,
//! `chaser-panels` (with those of S1's arm), `12`, `24` (bodies in a row), `rigid`, `panels` (S1's arm without and with two
//! panels), `dual` (the chaser over duals of eight lanes). As in the engines torques and forces act on joints and base, none at
//! thrusters and tips. `space_speed robot CASE` prints the robot, one body a line, for an engine to build it.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use trueup_models::space::design::{DesignLink, RobotDesign};
use trueup_models::space::layout::{Inputs, States};
use trueup_models::space::{SpatialFreeFlyer, presets};
use trueup_numerics::hybrid::{At, Hybrid};
use trueup_numerics::{Dual, Scalar};

/// So many bodies in a row, alternately turned.
fn row(n: usize) -> RobotDesign {
    let mut d = presets::chaser();
    let like = d.links[1].clone();
    let link = |k: usize| DesignLink {
        parent: k,
        position: [0.5, 0.0, 0.0],
        axis: if k.is_multiple_of(2) { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] },
        ..like.clone()
    };
    d.links = (0..n).map(link).collect();
    d.tips[0].body = n;
    d
}

fn robot(case: &str) -> Result<RobotDesign, String> {
    Ok(match case {
        "chaser" | "dual" => presets::chaser(),
        "rigid" => RobotDesign { appendages: Vec::new(), ..presets::table_1_with_panels() },
        "chaser-panels" => {
            RobotDesign { appendages: presets::table_1_with_panels().appendages, ..presets::chaser() }
        }
        "panels" => presets::table_1_with_panels(),
        other => row(other.parse().map_err(|_| format!("there is no case {other}"))?),
    })
}

fn time<T: Scalar>(design: &RobotDesign) -> Result<f64, String> {
    let s = design.structure();
    let model = SpatialFreeFlyer::new(s.clone())?;
    let (at, sizes) = (States::new(&s), model.sizes());
    let constant = |v: &f64| T::constant(*v);
    let p: Vec<T> = design.parameters().iter().map(constant).collect();
    let mut x: Vec<T> = (0..sizes.states).map(|k| T::constant(0.3 * (k as f64).sin())).collect();
    x[at.base_quaternion] = T::one();
    let mut u: Vec<T> = (0..sizes.inputs).map(|k| T::constant((k as f64).cos())).collect();
    let inputs = Inputs::new(&s);
    u[inputs.thruster_force..inputs.base_force].fill(T::zero());
    u[inputs.tip_force..].fill(T::zero());
    let mut dx = vec![T::zero(); sizes.states];
    let mut best = f64::INFINITY;
    for _ in 0..40 {
        let begin = Instant::now();
        let count = 5000;
        for _ in 0..count {
            x[at.joint_angle] += T::constant(1e-9);
            model.rates(At { t: T::zero(), x: black_box(&x), u: &u, p: &p, modes: &[] }, &mut dx);
            black_box(&dx);
        }
        best = best.min(begin.elapsed().as_secs_f64() / f64::from(count) * 1e9);
    }
    Ok(best)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["robot", case] => {
            let d = robot(case)?;
            let line = |v: &[f64]| println!("{}", v.iter().map(|v| format!("{v:e} ")).collect::<String>());
            line(&[&[d.base_mass], d.base_inertia.as_flattened()].concat());
            for l in &d.links {
                let of_body =
                    [&[l.parent as f64, l.mass], &l.center_of_mass[..], l.inertia.as_flattened()].concat();
                line(&[&of_body[..], &l.position, &l.axis].concat());
            }
        }
        ["dual"] => println!("{:.1}", time::<Dual<8>>(&robot("dual")?)?),
        [case] => println!("{:.1}", time::<f64>(&robot(case)?)?),
        _ => return Err("usage: space_speed [robot] CASE".into()),
    }
    Ok(())
}
