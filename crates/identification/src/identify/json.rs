//! The machine-readable result.

use super::{FitFigure, FoundParameter, Identified};
use serde_json::{Map, Value, json};

/// A finite number, or null.
fn number(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn one(f: &FoundParameter) -> Value {
    let e = &f.estimate;
    let end = |v: Option<f64>| v.map_or(Value::Null, number);
    let mut all = json!({
        "value": number(e.value),
        "unit": f.unit,
        "standard_error": end(e.standard_error),
        "ci95": [end(e.ci95[0]), end(e.ci95[1])],
        "cramer_rao": end(e.cramer_rao),
        "nominal": number(f.nominal),
    });
    if let Some(doubt) = f.doubt {
        all["prior"] = number(doubt);
    }
    if let Some(reason) = &e.reason {
        all["reason"] = json!(reason);
    }
    all
}

fn named(list: &[FoundParameter]) -> Value {
    Value::Object(list.iter().map(|f| (f.estimate.name.clone(), one(f))).collect())
}

fn figures(list: &[FitFigure]) -> Value {
    let one = |f: &FitFigure| {
        let value =
            json!({"nrmse": f.nrmse.map_or(Value::Null, number), "rms": number(f.rms), "unit": f.unit});
        (f.channel.clone(), value)
    };
    Value::Object(list.iter().map(one).collect())
}

/// All of it but the [design](super::Designed), which is given on request.
pub fn json(r: &Identified) -> Value {
    let names: Vec<&str> =
        r.parameters.iter().chain(&r.uncertain).map(|f| f.estimate.name.as_str()).collect();
    let nuisance: Map<String, Value> =
        r.nuisance.iter().map(|(run, list)| (run.clone(), named(list))).collect();
    let residuals: Vec<Value> = (r.channels.iter())
        .map(|c| {
            json!({
                "recording": r.names[0].get(c.run),
                "channel": c.channel,
                "above_noise_floor": number(c.above_floor),
                "lag1_correlation": number(c.lag1),
                "whiteness_probability": number(c.whiteness),
            })
        })
        .collect();
    let correlation: Vec<Vec<Value>> =
        r.correlation.row_iter().map(|row| row.iter().map(|v| number(*v)).collect()).collect();
    let leverage: Map<String, Value> = (names.iter().zip(r.leverage.values.row_iter()))
        .map(|(name, row)| {
            let each = r.leverage.known.iter().zip(row.iter());
            ((*name).to_owned(), Value::Object(each.map(|(k, v)| (k.clone(), number(*v))).collect()))
        })
        .collect();
    let starts: Vec<Value> = (r.starts.iter())
        .map(|s| json!({"from": s.from, "cost": s.cost.map_or(Value::Null, number), "chosen": s.chosen}))
        .collect();
    let without = if r.without.is_empty() { Value::Null } else { figures(&r.without) };
    json!({
        "schema": "trueup.identification/1",
        "model": r.model,
        "fmu": r.fmu,
        "method": r.method.to_string(),
        "parameters": named(&r.parameters),
        "uncertain": named(&r.uncertain),
        "nuisance": nuisance,
        "fit": figures(&r.fit),
        "fit_on": if r.held_out { "holdout" } else { "train" },
        "nominal_fit": figures(&r.before),
        "fit_without_effects": without,
        "residuals": residuals,
        "correlation": {"names": names, "matrix": correlation},
        "rank": {"determined": r.rank.0, "unknowns": r.rank.1, "condition": number(r.condition)},
        "leverage": leverage,
        "starts": starts,
        "stop": r.stop,
        "iterations": r.iterations,
        "notes": r.notes,
        "pack": r.pack,
    })
}
