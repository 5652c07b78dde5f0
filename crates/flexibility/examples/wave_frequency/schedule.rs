//! omega_n = share K_p / lambda, within bounds: away from where velocity waves run away, lambda as [`droop`] has it.
//!
//! `known`: posture and payload known. `measured`: lambda from the twists on the way, by encoders without errors. `elbow`: a table over its
//! angle, the worst of the shoulder's, as the controllers follow it; for the payload, or for one as heavy as may be.

use super::Asked;
use super::loops::{N, arm, with_payload};
use super::moves::{GAIN, How, Move, OMEGAS, Outcome, WORSE, control, draw, schedule, spread};
use std::error::Error;
use trueup_flexibility::droop::droop;
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::controller::Strategy;
use trueup_models::controller::adaptation::KNOTS;
use trueup_models::flexible_arm::FlexibleArm;

const SHARES: [f64; 4] = [0.15, 0.2, 0.4, 0.8];
const LEAST: f64 = 20.0;
const MOST: [f64; 3] = [200.0, 400.0, 1000.0];
/// Where the arm may be: shoulder and elbow, rad; heaviest payload, kg.
const RANGE: [[f64; 2]; 2] = [[-0.2, 2.0], [-2.7, 0.3]];
const HEAVIEST: f64 = 10.0;
/// Joint, from 0.
const ELBOW: usize = 2;
/// Angles of the shoulder that are looked at.
const OTHERS: usize = 9;

struct Study<'a> {
    arm: &'a FlexibleArm,
    moves: Vec<Move>,
    base: Vec<Outcome>,
    how: How,
}

/// Less vibration than with P/PI in %, and how far from the goal in mm, move by move.
struct Row {
    less: Vec<f64>,
    error: Vec<f64>,
}

impl Study<'_> {
    fn row(&self, law: impl Fn(&Move) -> Vec<f64>) -> Result<Row, Box<dyn Error>> {
        let mut row = Row { less: vec![], error: vec![] };
        for (m, base) in self.moves.iter().zip(&self.base) {
            let done = m.run(self.arm, &law(m), self.how)?;
            row.less.push(100.0 * (1.0 - done.vibration / base.vibration));
            row.error.push(1e3 * done.error);
        }
        Ok(row)
    }

    fn constant(&self, strategy: Strategy, omega: impl Fn(&Move) -> f64) -> Result<Row, Box<dyn Error>> {
        self.row(|m| control(self.arm, &m.p, strategy, [omega(m); N], None))
    }
}

/// Shares of the bound as omega_n, rad/s.
pub(crate) fn within(share: f64, bound: f64, most: f64) -> f64 {
    (share * GAIN * bound).min(most).max(LEAST)
}

/// Knots over the elbow: angles, and the least bound over the shoulder's angle.
pub(crate) fn table(
    arm: &FlexibleArm,
    payload: f64,
    orbit: bool,
) -> Result<[[f64; KNOTS]; 2], Box<dyn Error>> {
    let p = with_payload(arm, payload, orbit);
    let at = |of: usize, k: usize, count: usize| {
        RANGE[of][0] + (RANGE[of][1] - RANGE[of][0]) * k as f64 / (count - 1) as f64
    };
    let mut found = [[0.0; KNOTS], [f64::INFINITY; KNOTS]];
    for k in 0..KNOTS {
        found[0][k] = at(1, k, KNOTS);
        for shoulder in 0..OTHERS {
            let mut pose = [0.0; N];
            (pose[1], pose[ELBOW]) = (at(0, shoulder, OTHERS), found[0][k]);
            found[1][k] = found[1][k].min(1.0 / droop(&equilibrium(arm, &p, &pose, [0.0; 3])?)?);
        }
    }
    Ok(found)
}

pub(crate) fn study(asked: &Asked) -> Result<(), Box<dyn Error>> {
    let (count, how) = (asked.moves(), asked.how());
    let strategy = if asked.has("wbc") {
        Strategy::Wbc
    } else if asked.has("washout") {
        Strategy::VwbcWashout
    } else {
        Strategy::Vwbc
    };
    let arm = arm()?;
    let mut study = Study { arm: &arm, moves: draw(&arm, count, how.orbit)?, base: vec![], how };
    let still = |m: &Move| control(&arm, &m.p, Strategy::PPi, [40.0; N], None);
    study.base = study.moves.iter().map(|m| m.run(&arm, &still(m), how)).collect::<Result<_, _>>()?;

    let constants = OMEGAS.iter().map(|w| study.constant(strategy, |_| *w)).collect::<Result<Vec<_>, _>>()?;
    let median = |values: &[f64]| spread(values)[1];
    let best = (0..OMEGAS.len())
        .filter(|k| spread(&constants[*k].less)[0] > -WORSE)
        .max_by(|a, b| median(&constants[*a].less).total_cmp(&median(&constants[*b].less)))
        .unwrap_or(0);
    let best_row = &constants[best];
    // The median gain, the least gain, and the median error.
    let told = |row: &Row| {
        let over: Vec<f64> = row.less.iter().zip(&best_row.less).map(|(a, c)| a - c).collect();
        let [least, median, _] = spread(&over);
        (median, least, spread(&row.error)[1])
    };
    let [least, middle, _] = spread(&best_row.less);
    println!(
        "{strategy:?} {:?}: best constant {} rad/s, {middle:.1} % less than P/PI at the median, {least:.1} at the least, {:.2} mm from the goal",
        asked.words,
        OMEGAS[best],
        median(&best_row.error)
    );
    for (omega, row) in OMEGAS.iter().zip(&constants) {
        let ([least, middle, _], [_, off, most]) = (spread(&row.less), spread(&row.error));
        println!("  {omega:6} rad/s: {middle:8.2} % {least:9.2} %; {off:.2} mm, {most:.2} at most");
    }
    let mut oracle = Row { less: vec![], error: vec![] };
    for m in 0..count {
        let of = |k: &usize| constants[*k].less[m];
        let k = (0..OMEGAS.len()).max_by(|a, b| of(a).total_cmp(&of(b))).unwrap_or(best);
        oracle.less.push(of(&k));
        oracle.error.push(constants[k].error[m]);
    }
    let (gain, _, off) = told(&oracle);
    println!("oracle: {gain:.2} points at the median, {off:.2} mm from the goal");

    println!(
        "law; most; share: points over the best constant at the median, at the least, mm from the goal at the median"
    );
    let law = |name: &str, most: f64, share: f64, row: &Row| {
        let (gain, least, off) = told(row);
        println!("{name:28} {most:6} {share:4} {gain:8.2} {least:9.2} {off:9.2}");
    };
    for most in MOST {
        for share in SHARES {
            law("known", most, share, &study.constant(strategy, |m| within(share, m.bound, most))?);
        }
    }
    for share in SHARES {
        law("measured", MOST[0], share, &study.constant(strategy, |m| within(share, m.seen, MOST[0]))?);
    }
    let adaptive = match strategy {
        Strategy::Wbc => Strategy::WbcAdaptive,
        Strategy::Vwbc => Strategy::VwbcAdaptive,
        // Has no adaptive form.
        _ => return Ok(()),
    };
    let unknown = table(&arm, HEAVIEST, how.orbit)?;
    let tables =
        study.moves.iter().map(|m| table(&arm, m.payload, how.orbit)).collect::<Result<Vec<_>, _>>()?;
    for (name, known) in [("elbow, payload known", true), ("elbow, payload unknown", false)] {
        for most in MOST {
            for share in SHARES {
                let mut row = Row { less: vec![], error: vec![] };
                for ((m, base), own) in study.moves.iter().zip(&study.base).zip(&tables) {
                    let own = if known { own } else { &unknown };
                    let follow = [own[0], own[1].map(|bound| within(share, bound, most))];
                    let mut c = control(&arm, &m.p, adaptive, [LEAST; N], None);
                    schedule(&mut c, ELBOW + 1, &follow, [LEAST, most], m.poses[0][ELBOW]);
                    let done = m.run(&arm, &c, how)?;
                    row.less.push(100.0 * (1.0 - done.vibration / base.vibration));
                    row.error.push(1e3 * done.error);
                }
                law(name, most, share, &row);
            }
        }
    }
    Ok(())
}
