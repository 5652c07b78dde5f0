//! Stages of the innovations engine of cases: `stages FOLDER..` prints a JSON object for each.

use std::rc::Rc;

use serde_json::{Value, json};
use trueup_estimation::innovations::evidence::log_evidence;
use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::intake::{NodeIntake, root_mean_square};
use trueup_estimation::innovations::two_mass::TwoMassPlant;
use trueup_signals::Case;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    for folder in std::env::args().skip(1) {
        println!("{}", stages(&folder)?);
    }
    Ok(())
}

fn stages(folder: &str) -> Result<Value, Box<dyn std::error::Error>> {
    let (loaded, _) = Case::load(std::path::Path::new(folder), |_| Ok(Vec::new()))?;
    let plant = TwoMassPlant::of(&loaded.case, root_mean_square(&loaded, "motorCurrent"));
    let intake = Rc::new(NodeIntake::new(&loaded, &plant)?);
    let mut frame = InnovationsFrame::new(&intake, Rc::new(plant), None)?;
    let intake: Vec<Value> = frame.runs.iter().enumerate().map(|(k, r)| {
        let n = frame.channels();
        let sum = |c: usize, f: &dyn Fn(usize) -> f64| (0..r.nodes).map(|t| f(n * t + c)).sum::<f64>();
        let each = |f: &dyn Fn(usize) -> f64| (0..n).map(|c| sum(c, f)).collect::<Vec<_>>();
        let u = &frame.intake.recordings[k].means[0];
        json!({
            "N": r.nodes, "dt": r.dt, "readings": each(&|k| r.count[k]), "counted": each(&|k| f64::from(u8::from(r.counted[k]))),
            "y_sum": each(&|k| r.readings[k]), "tau_sum": each(&|k| r.moments[k][0]),
            "current_sum": u.iter().sum::<f64>(), "current_squares": u.iter().map(|x| x * x).sum::<f64>(),
            "x0": r.first, "P0": r.first_variance,
        })
    }).collect();
    let begun = std::time::Instant::now();
    frame.settle(false)?;
    let records: Vec<Value> = frame.runs.iter().map(|r| json!({
        "stick": r.signs.mode.iter().filter(|m| **m == 1).count(), "sign_sum": r.signs.sign.iter().sum::<f64>(),
        "mean_sign_sum": r.signs.mean.iter().sum::<f64>(), "extra_sum": r.signs.unknown.iter().sum::<f64>(),
        "misplaced": r.signs.misplaced.iter().filter(|m| **m).count(),
    })).collect();
    let modes = json!({ "rest": frame.rest, "white": frame.white, "scale": frame.scale, "release": frame.release, "q": frame.q,
        "L": frame.evidence, "records": records, "seconds": begun.elapsed().as_secs_f64() });
    let q = frame.q.clone();
    let r = &frame.runs[0];
    let g = frame.gains(0, &q, false)?;
    let nodes = [0, 1, 100, r.nodes / 2, r.nodes - 1];
    let (n, size) = (frame.channels(), 6);
    let pick = |all: &[f64], width: usize| {
        nodes.iter().map(|t| all[width * t..width * (t + 1)].to_vec()).collect::<Vec<_>>()
    };
    let log: f64 = (0..g.variance.len()).filter(|k| r.counted[*k]).map(|k| g.variance[k].ln()).sum();
    let gains = json!({ "A": g.input.steps.iter().map(|s| s.a.clone()).collect::<Vec<_>>(), "H": pick(&g.input.rows.h, n * size), "K": pick(&g.gain, n * size), "S": pick(&g.variance, n), "R": pick(&g.input.variance, n), "log_S_sum": [log] });
    let begun = std::time::Instant::now();
    let par = frame.fit(&|_| Vec::new(), &q, 8, true)?;
    let parameters = json!({ "L": par.evidence, "q": par.q, "theta": par.theta, "rss": par.squares, "count": par.count, "seconds": begun.elapsed().as_secs_f64() });
    frame.reset(&q)?;
    let r = &frame.runs[0];
    let at = [0, 1, 2, r.nodes / 2];
    let some = |all: &[f64], width: usize| {
        at.iter().map(|t| all[width * t..width * (t + 1)].to_vec()).collect::<Vec<_>>()
    };
    let frozen = json!({ "x": some(&r.states, size), "score": some(&r.scores, 2 + n) });
    let (packed, priors) = frame.packed(&[]);
    let passed = frame.pass(&packed, &[], &q)?;
    let base = json!({ "count": passed.base.count, "log_S_sum": passed.base.log_variance, "G00": passed.base.product(0, 0), "L": log_evidence(&passed.base, &priors).log });
    Ok(
        json!({ "case": folder, "intake": intake, "modes": modes, "gains": gains, "parameters_L": parameters, "frozen": frozen, "base": base }),
    )
}
