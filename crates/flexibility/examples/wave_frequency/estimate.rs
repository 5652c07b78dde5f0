//! omega_n as the controllers estimate it.

use super::Asked;
use super::loops::{N, arm};
use super::moves::{GAIN, Move, OMEGAS, Outcome, WORSE, control, draw, spread};
use std::error::Error;
use trueup_models::controller::{Strategy, parameter};

const RATIOS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// By how much a move may end further from its goal and count as having arrived like another, m.
const ARRIVED: f64 = 1e-3;

pub(crate) fn study(asked: &Asked) -> Result<(), Box<dyn Error>> {
    let (count, how) = (asked.moves(), asked.how());
    let arm = arm()?;
    let moves = draw(&arm, count, how.orbit)?;
    let run =
        |m: &Move, strategy, omega, ratio| m.run(&arm, &control(&arm, &m.p, strategy, omega, ratio), how);
    let base = moves.iter().map(|m| run(m, Strategy::PPi, [40.0; N], None)).collect::<Result<Vec<_>, _>>()?;
    let millimetres = |of: fn(&Outcome) -> f64, all: &[Outcome]| {
        spread(&all.iter().map(|o| 1e3 * of(o)).collect::<Vec<_>>())
    };
    let [least, median, most] = millimetres(|o| o.vibration, &base);
    let [slow, _, fast] = spread(&moves.iter().map(|m| m.first).collect::<Vec<_>>());
    println!(
        "{count} moves, {} sensors, {}, {}; first modes of {slow:.1} to {fast:.1} rad/s. P/PI: {median:.3} mm at the median ({least:.3} to {most:.3}), {:.3} mm from the goal",
        if how.sensors { "quantised" } else { "ideal" },
        if how.orbit { "no weight" } else { "on the ground" },
        if how.dry { "stick-slip" } else { "linear" },
        millimetres(|o| o.error, &base)[1],
    );
    let less = |all: &[Outcome]| -> Vec<f64> {
        all.iter().zip(&base).map(|(o, b)| 100.0 * (1.0 - o.vibration / b.vibration)).collect()
    };
    // Half of what wave-based control launches comes back only later: P/PI with half the gain starts as slowly.
    let halved = moves
        .iter()
        .map(|m| {
            let mut c = control(&arm, &m.p, Strategy::PPi, [40.0; N], None);
            c[parameter::POSITION_GAIN * N..][..N].fill(0.5 * GAIN);
            m.run(&arm, &c, how)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let [least, median, _] = spread(&less(&halved));
    println!("P/PI with half the gain: {median:.2} % less at the median, {least:.2} at the least");
    for (constant, adaptive) in
        [(Strategy::Vwbc, Strategy::VwbcAdaptive), (Strategy::Wbc, Strategy::WbcAdaptive)]
    {
        println!(
            "{constant:?}: omega_n, less vibration than P/PI in % (median, least), from the goal in mm (median)"
        );
        let (mut table, mut ends) = (Vec::new(), Vec::new());
        for omega in OMEGAS {
            let all =
                moves.iter().map(|m| run(m, constant, [omega; N], None)).collect::<Result<Vec<_>, _>>()?;
            let row = less(&all);
            let [least, median, _] = spread(&row);
            println!("  {omega:6} {median:8.2} {least:8.2} {:10.3}", millimetres(|o| o.error, &all)[1]);
            table.push(row);
            ends.push(all.iter().map(|o| o.error).collect::<Vec<_>>());
        }
        let median_of = |k: &usize| spread(&table[*k])[1];
        let highest = (0..OMEGAS.len()).max_by(|a, b| median_of(a).total_cmp(&median_of(b))).unwrap_or(0);
        // One that may be set once: it makes no move much worse than P/PI does.
        let best = (0..OMEGAS.len())
            .filter(|k| spread(&table[*k])[0] > -WORSE)
            .max_by(|a, b| median_of(a).total_cmp(&median_of(b)))
            .unwrap_or(0);
        let over =
            |row: &[f64]| spread(&row.iter().zip(&table[best]).map(|(a, c)| a - c).collect::<Vec<_>>());
        let oracle: Vec<f64> =
            (0..count).map(|m| table.iter().map(|r| r[m]).fold(f64::NEG_INFINITY, f64::max)).collect();
        let [_, median, most] = over(&oracle);
        println!(
            "  highest median at {} rad/s; best constant that makes no move worse than P/PI by {WORSE} %: {} rad/s; the best one of every move gains {median:.2} points at the median, {most:.2} at most",
            OMEGAS[highest], OMEGAS[best]
        );
        // What does not arrive vibrates less, and is no better for it.
        let arriving: Vec<f64> = (0..count)
            .map(|m| {
                let there = (0..OMEGAS.len()).filter(|k| ends[*k][m] <= ends[best][m] + ARRIVED);
                there.map(|k| table[k][m]).fold(f64::NEG_INFINITY, f64::max)
            })
            .collect();
        let [_, median, most] = over(&arriving);
        println!(
            "  the best one of those that end no further from the goal than that constant, but for {} mm: {median:.2} points, {most:.2} at most",
            1e3 * ARRIVED
        );
        println!(
            "  {adaptive:?}: ratio, then for the first run and one that starts with what it learnt: less than P/PI in %, points over the best constant (median, least), joint 2's omega_n"
        );
        for ratio in RATIOS {
            let within = |w: f64| w.clamp(2.0 * ratio, 100.0 * ratio);
            let mut starts = vec![[within(OMEGAS[best]); N]; count];
            print!("  {ratio:6}");
            for _ in 0..2 {
                let all = moves
                    .iter()
                    .zip(&starts)
                    .map(|(m, start)| run(m, adaptive, *start, Some(ratio)))
                    .collect::<Result<Vec<_>, _>>()?;
                // What it uses is between its bounds.
                starts = all.iter().map(|o| o.used.map(within)).collect();
                let row = less(&all);
                let ([least, median, _], of) = (over(&row), spread(&row)[1]);
                let omega = spread(&starts.iter().map(|w| w[1]).collect::<Vec<_>>())[1];
                print!(" | {of:7.2} {median:7.2} {least:8.2} {omega:6.1}");
            }
            println!();
        }
    }
    Ok(())
}
