//! By how much estimates move with what is assumed known.

use nalgebra::DMatrix;

use super::searched::SearchableModel;
use crate::estimate;
use crate::fit::OutputErrorFit;
use crate::lsq::LeastSquares;
use crate::output_error::OutputError;
use crate::subject::IdentificationSubject;
use crate::unknown::{FitTarget, FitUnknown};
use trueup_signals::base_name;

/// d(estimate)/estimate over d(known)/known; of a sensor's zero, over one step of its reading.
#[derive(Clone, Debug, Default)]
pub struct Leverage {
    /// What is assumed known.
    pub known: Vec<String>,
    /// One row per parameter and uncertain one, one column per known.
    pub values: DMatrix<f64>,
}

/// What is assumed known of a joint and of an arm, if it is not fitted.
const JOINT: [&str; 4] = ["motorInertia", "torqueConstant", "gearRatio", "loadInertia"];
const ARM: [&str; 7] =
    ["baseMass", "baseInertia", "linkMass", "linkInertia", "linkLength", "motorInertia", "jointStiffness"];

pub(super) fn of(
    model: &dyn SearchableModel,
    nominal: &[f64],
    problem: &OutputError,
    fit: &OutputErrorFit,
    order: &[usize],
) -> Leverage {
    let mut extra: Vec<FitUnknown> = Vec::new();
    let fitted = |t: FitTarget| problem.unknowns().iter().any(|u| u.target == t);
    let names: &[&str] = if model.parameter("loadInertia").is_some() { &JOINT } else { &ARM };
    for q in names.iter().flat_map(|n| model.named(n)) {
        let Some(i) = model.parameter(&q.name) else { continue };
        if nominal[i] > 0.0 && !fitted(FitTarget::Parameter(i)) {
            extra.push(FitUnknown::positive(&q.name, i, nominal[i]));
        }
    }
    let mut seen = Vec::new();
    for c in problem.runs().iter().flat_map(|r| &r.channels) {
        let target = FitTarget::Offset(c.output);
        // One of an array has none.
        let angle = model.outputs()[c.output].is_joint_angle() && base_name(&c.name) == c.name;
        if angle && !fitted(target) && !seen.contains(&c.output) {
            seen.push(c.output);
            let step = if c.resolution > 0.0 { c.resolution } else { c.sigma };
            extra.push(FitUnknown::free(&format!("{} zero, one step", c.name), target, None, step));
        }
    }
    let known: Vec<String> = extra.iter().map(|u| u.name.clone()).collect();
    let none = Leverage { values: DMatrix::zeros(order.len(), 0), known: Vec::new() };
    let count = fit.theta.len();
    let mut theta = fit.theta.clone();
    theta.extend(extra.iter().map(|u| u.scale.coordinate(u.start)));
    let unknowns = [problem.unknowns(), &extra].concat();
    let mut wider = OutputError::new(model, nominal, problem.runs(), unknowns);
    let weighed = (0..problem.runs().len()).any(|r| problem.carried(r).is_some());
    if weighed && wider.carry_noise(&theta).is_err() {
        return none;
    }
    let Some(mut j) = wider.evaluate(&theta, true).ok().and_then(|e| e.jacobian) else { return none };
    // As the solver has it: what has no derivative here stays where it is.
    for mut column in j.column_iter_mut().filter(|c| !c.norm_squared().is_finite()) {
        column.fill(0.0);
    }
    let own = j.columns(0, count).into_owned();
    let all = estimate::leverage(&own, &j.columns(count, extra.len()).into_owned());
    let (periodic, waves) = periodic(model, &wider, j.nrows());
    let turns = estimate::leverage(&own, &waves);
    let size = |k: usize| {
        let (value, slope) = problem.unknowns()[k].scale.value(fit.theta[k]);
        slope / value
    };
    let known = known.into_iter().chain(periodic).collect::<Vec<_>>();
    let values = DMatrix::from_fn(order.len(), known.len(), |i, c| {
        let wave = |k: usize| turns[(order[i], 2 * (c - extra.len()) + k)];
        // Of a wave of unknown phase the worst.
        let moved = if c < extra.len() { all[(order[i], c)] } else { wave(0).hypot(wave(1)) };
        moved * size(order[i])
    });
    Leverage { known, values }
}

/// Errors of one step that come again with every turn of an angle sensor, sine and cosine: names, columns.
fn periodic(
    model: &dyn IdentificationSubject,
    problem: &OutputError,
    rows: usize,
) -> (Vec<String>, DMatrix<f64>) {
    let mut names: Vec<String> = Vec::new();
    let channels = problem.runs().iter().flat_map(|r| &r.channels);
    let angles = channels.filter(|c| model.outputs()[c.output].is_joint_angle());
    for c in angles {
        let name = format!("{} per turn, one step", c.name);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let mut all = DMatrix::zeros(rows, 2 * names.len());
    for (r, run) in problem.runs().iter().enumerate() {
        let begin = problem.residuals_of(r);
        let mut row = begin.start;
        for c in &run.channels {
            let step = if c.resolution > 0.0 { c.resolution } else { c.sigma };
            let at = names.iter().position(|n| *n == format!("{} per turn, one step", c.name));
            for (k, y) in c.y.iter().enumerate() {
                if let Some(at) = at {
                    let (sin, cos) = y.sin_cos();
                    all[(row + k, 2 * at)] = step * sin / c.deviation(k);
                    all[(row + k, 2 * at + 1)] = step * cos / c.deviation(k);
                }
            }
            row += c.y.len();
        }
        for mut column in all.column_iter_mut() {
            problem.whiten(r, &mut column.as_mut_slice()[begin.clone()]);
        }
    }
    (names, all)
}
