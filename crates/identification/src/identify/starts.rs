//! Where a search begins: the case's values, staged guesses by regression, and values to either side.

use super::error::IdentifyError;
use super::method::IdentifyMethod;
use super::unknowns::CommonUnknown;
use crate::fit::OutputErrorFit;
use crate::model::SimulatedPlant;
use crate::predict::{InputMap, PredictionPlan, predict};
use crate::regress::{KnownParameters, RegressError, Regressed, Regression, regress};
use crate::run::IdentificationRun;
use crate::unknown::{FitTarget, FitUnknown, Scale};
use trueup_models::joint::parameter as p;
use trueup_signals::base_name;

/// What the regressions estimate, in their order.
pub(super) const REGRESSED: [&str; 4] = ["stiffness", "damping", "coulombFriction", "viscousFriction"];
const INDICES: [usize; 4] = [p::STIFFNESS, p::DAMPING, p::COULOMB_FRICTION, p::VISCOUS_FRICTION];
/// Low-pass of the filtered regression, Hz.
const CUTOFF: f64 = 8.0;

/// A start.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchStart {
    /// Where its values come from.
    pub from: String,
    /// Parameter index and value; what is not named starts as the case has it.
    pub values: Vec<(usize, f64)>,
    /// Cost that the first stage of the search reached from there; `None`: not simulated.
    pub cost: Option<f64>,
    /// The solution came from here.
    pub chosen: bool,
}

impl SearchStart {
    /// As coordinates of these unknowns.
    pub(super) fn coordinates(&self, unknowns: &[FitUnknown]) -> Vec<f64> {
        let value = |u: &FitUnknown| match u.target {
            FitTarget::Parameter(i) if u.run.is_none() => {
                self.values.iter().find(|v| v.0 == i).map_or(u.start, |v| v.1.clamp(u.lower, u.upper))
            }
            _ => u.start,
        };
        unknowns.iter().map(|u| u.scale.coordinate(value(u))).collect()
    }
}

/// K_eq, D_eq, tau_c, D_m of a joint by least squares.
pub(super) fn regression(
    model: &SimulatedPlant,
    nominal: &[f64],
    runs: &[IdentificationRun],
    method: IdentifyMethod,
) -> Result<Regressed, IdentifyError> {
    let known = KnownParameters {
        motor_inertia: nominal[p::MOTOR_INERTIA],
        torque_constant: nominal[p::TORQUE_CONSTANT],
        gear_ratio: nominal[p::GEAR_RATIO],
    };
    let plain = |kind| regress(runs, None, &known, kind);
    match method {
        IdentifyMethod::LsLiteral => Ok(plain(Regression::Literal)?),
        IdentifyMethod::Ls => Ok(plain(Regression::Aligned)?),
        IdentifyMethod::Filtered => Ok(plain(Regression::Filtered(CUTOFF))?),
        _ => Ok(instruments(model, nominal, runs, &known)?),
    }
}

/// Instrumental variables: columns of the model simulated with the last estimate, three times over.
fn instruments(
    model: &SimulatedPlant,
    nominal: &[f64],
    runs: &[IdentificationRun],
    known: &KnownParameters,
) -> Result<Regressed, RegressError> {
    let mut found = regress(runs, None, known, Regression::Filtered(CUTOFF))?;
    for _ in 0..3 {
        let mut q = nominal.to_vec();
        for (k, i) in INDICES.iter().enumerate() {
            // What is absurd would not simulate.
            let v = found.values[k];
            q[*i] = if v > 0.1 * nominal[*i] && v < 10.0 * nominal[*i] { v } else { nominal[*i] };
        }
        let mut simulated = runs.to_vec();
        for run in &mut simulated {
            let first = |name: &str| run.channels.iter().find(|c| c.name == name).map(|c| c.y[0]);
            let (Some(motor), Some(load)) = (first("motorAngle"), first("loadAngle")) else { continue };
            q[p::INITIAL_MOTOR_ANGLE] = motor;
            q[p::INITIAL_LOAD_ANGLE] = load;
            let plan = PredictionPlan::new(run, model.sizes().inputs);
            let Ok(shown) = predict(model.plant(), &plan, &q, &InputMap::default(), false) else {
                return Ok(found);
            };
            for (c, channel) in run.channels.iter_mut().enumerate() {
                channel.y.copy_from_slice(&shown.y[plan.channels()[c]..plan.channels()[c + 1]]);
            }
        }
        found = regress(runs, Some(&simulated), known, Regression::Filtered(CUTOFF))?;
    }
    Ok(found)
}

/// Distinct starts, the case's own first.
pub(super) fn find(
    model: &SimulatedPlant,
    nominal: &[f64],
    runs: &[IdentificationRun],
    fitted: &[CommonUnknown],
) -> Vec<SearchStart> {
    let start = |from: &str, values: Vec<(usize, f64)>| SearchStart {
        from: from.into(),
        values,
        cost: None,
        chosen: false,
    };
    let own = |f: &CommonUnknown| match f.unknown.target {
        FitTarget::Parameter(i) => Some((i, f.unknown.start)),
        _ => None,
    };
    let base: Vec<(usize, f64)> = fitted.iter().filter_map(own).collect();
    let at = |i: usize| base.iter().find(|v| v.0 == i).map(|v| v.1);
    // At or below the Coulomb level the static one does nothing: begin above it.
    let lifted = |mut values: Vec<(usize, f64)>| {
        if model.joint().is_some() {
            let of = |values: &[(usize, f64)], i: usize| values.iter().find(|v| v.0 == i).map(|v| v.1);
            let coulomb = of(&values, p::COULOMB_FRICTION).unwrap_or(nominal[p::COULOMB_FRICTION]);
            if let Some(v) = values.iter_mut().find(|v| v.0 == p::STATIC_FRICTION) {
                v.1 = v.1.max(1.15 * coulomb);
            }
        }
        values
    };
    let mut all = vec![start("the case", base.clone())];
    let changed = |factors: &[(usize, f64)]| {
        let values = base.iter().map(|(i, v)| {
            let factor = factors.iter().find(|f| f.0 == *i).map_or(1.0, |f| f.1);
            (*i, v * factor)
        });
        lifted(values.collect())
    };
    if model.joint().is_some() {
        let has = |i: usize| at(i).is_some();
        if has(p::STATIC_FRICTION) {
            all.push(start("the case, static friction above Coulomb", changed(&[])));
        }
        if model.joint().is_some_and(|j| j.flexible()) {
            for method in [IdentifyMethod::Filtered, IdentifyMethod::Iv] {
                let Ok(r) = regression(model, nominal, runs, method) else { continue };
                let mut values = base.clone();
                let mut used = false;
                for (k, i) in INDICES.iter().enumerate() {
                    let Some(v) = values.iter_mut().find(|v| v.0 == *i) else { continue };
                    let sane = r.values[k] > 0.03 * v.1 && r.values[k] < 30.0 * v.1;
                    if sane {
                        v.1 = r.values[k];
                        used = true;
                    }
                }
                if used {
                    all.push(start(&format!("least squares ({method})"), lifted(values)));
                }
            }
            if has(p::STIFFNESS) {
                all.push(start("stiffness 3 times the case's", changed(&[(p::STIFFNESS, 3.0)])));
                all.push(start("stiffness a third of the case's", changed(&[(p::STIFFNESS, 0.33)])));
            }
        }
        if has(p::COULOMB_FRICTION) {
            all.push(start(
                "half the case's friction",
                changed(&[(p::COULOMB_FRICTION, 0.5), (p::VISCOUS_FRICTION, 0.5), (p::STATIC_FRICTION, 0.5)]),
            ));
            all.push(start(
                "twice the case's friction",
                changed(&[(p::COULOMB_FRICTION, 2.0), (p::VISCOUS_FRICTION, 2.0), (p::STATIC_FRICTION, 2.0)]),
            ));
        }
    } else {
        for (from, factor) in [("springs 3 times the case's", 3.0), ("springs a third of the case's", 0.33)] {
            let springs: Vec<(usize, f64)> = (base.iter())
                .filter(|(i, _)| base_name(&model.parameters()[*i].name) == "jointStiffness")
                .map(|(i, _)| (*i, factor))
                .collect();
            if !springs.is_empty() {
                all.push(start(from, changed(&springs)));
            }
        }
    }
    all
}

/// The case's values, and twice and half of what is searched by its logarithm: for a model of which no more is known.
pub(super) fn around(fitted: &[CommonUnknown]) -> Vec<SearchStart> {
    let at = |from: &str, factor: f64| {
        let value = |f: &CommonUnknown| match f.unknown.target {
            FitTarget::Parameter(i) if f.unknown.scale == Scale::Log => Some((i, f.unknown.start * factor)),
            FitTarget::Parameter(i) => Some((i, f.unknown.start)),
            _ => None,
        };
        SearchStart {
            from: from.into(),
            values: fitted.iter().filter_map(value).collect(),
            cost: None,
            chosen: false,
        }
    };
    let mut all =
        vec![at("the case", 1.0), at("1.5 times the case's", 1.5), at("two thirds of the case's", 0.67)];
    if all[0].values == all[1].values {
        all.truncate(1);
    }
    all
}

/// Below the Coulomb level the static one does nothing and no slope leads out of there: from a solution that ended so,
/// further starts with it above.
pub(super) fn above_coulomb(
    model: &SimulatedPlant,
    unknowns: &[FitUnknown],
    fit: &OutputErrorFit,
) -> Vec<Vec<f64>> {
    let at =
        unknowns.iter().position(|u| u.run.is_none() && u.target == FitTarget::Parameter(p::STATIC_FRICTION));
    let (Some(k), Some(_)) = (at, model.joint()) else { return Vec::new() };
    let coulomb = fit.parameters[p::COULOMB_FRICTION];
    if fit.values[k] > coulomb {
        return Vec::new();
    }
    let lifted = |factor: f64| {
        let mut theta = fit.theta.clone();
        theta[k] = unknowns[k].scale.coordinate(factor * coulomb);
        theta
    };
    [vec![fit.theta.clone()], [1.05, 1.2, 1.5, 2.5].map(lifted).to_vec()].concat()
}

/// What became of each, the chosen one first.
pub(super) fn outcome(mut starts: Vec<SearchStart>, fit: &OutputErrorFit) -> Vec<SearchStart> {
    for (k, start) in starts.iter_mut().enumerate() {
        start.cost = fit.origins.costs.get(k).copied().filter(|c| c.is_finite());
        start.chosen = k == fit.origins.start;
    }
    if fit.origins.start < starts.len() {
        let chosen = starts.remove(fit.origins.start);
        starts.insert(0, chosen);
    }
    starts
}
