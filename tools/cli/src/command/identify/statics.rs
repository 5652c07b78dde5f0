//! `trueup statics`

use std::fmt::Write;

use serde_json::{Map, Value, json};
use trueup_identification::model::SimulatedPlant;
use trueup_identification::quasi_static::{FirstMode, first_mode_of, youngs_modulus};
use trueup_report::number;
use trueup_signals::Case;

use crate::args::Statics;
use crate::error::CliError;
use crate::output::say;

/// What is evaluated.
const SOURCES: &str = "a TOML file with one [[deflection]] table (load, length, areaMoment, deflection) per load, or the case.toml of an arm";

pub(crate) fn run(args: &Statics) -> Result<(), CliError> {
    let file = if args.file.is_dir() { args.file.join("case.toml") } else { args.file.clone() };
    let text = crate::input::text(&file, &format!("give {SOURCES}"))?;
    let table: toml::Table = text.parse().map_err(|e: toml::de::Error| CliError::at(&file, e))?;
    if table.is_empty() {
        return Err(CliError::at(&file, format!("the file is empty; give {SOURCES}")));
    }
    let (json, text) = match table.get("deflection") {
        Some(list) => deflections(list).map_err(|what| CliError::at(&file, what))?,
        None => mode(&file, args.stiffen)?,
    };
    say(&if args.json { format!("{json:#}\n") } else { text })
}

/// Young's modulus, deflection by deflection.
fn deflections(list: &toml::Value) -> Result<(Value, String), String> {
    const KEYS: [&str; 4] = ["load", "length", "areaMoment", "deflection"];
    let list = list.as_array().ok_or("write one [[deflection]] table per load")?;
    let mut text = "Young's modulus, E = F L^3 / (3 J d)\n".to_owned();
    let (mut all, mut sum, mut weight) = (Vec::new(), 0.0, 0.0);
    for (i, one) in list.iter().enumerate() {
        let value = |key: &str| one.get(key).and_then(|v| v.as_float().or(v.as_integer().map(|i| i as f64)));
        let mut at = [0.0; 4];
        for (v, key) in at.iter_mut().zip(KEYS) {
            *v = value(key).ok_or_else(|| {
                format!("[[deflection]] {} lacks the number `{key}`; give load in N, length in m, areaMoment in m4, deflection in m and, if known, deflectionError in m", i + 1)
            })?;
        }
        let error = value("deflectionError").unwrap_or(0.0);
        let (modulus, sd) = youngs_modulus(at[0], at[1], at[2], at[3], error)
            .map_err(|e| format!("[[deflection]] {}: {e}", i + 1))?;
        let _ = writeln!(
            text,
            "  {} N, {} m: {} Pa, standard error {}",
            at[0],
            at[3],
            number(modulus),
            number(sd)
        );
        let w = if sd > 0.0 { sd.powi(-2) } else { 1.0 };
        (sum, weight) = (sum + w * modulus, weight + w);
        all.push(json!({"value": modulus, "unit": "Pa", "standard_error": sd}));
    }
    let mean = sum / weight;
    let _ = writeln!(text, "  together: {} Pa", number(mean));
    Ok((
        json!({"schema": "trueup.statics/1", "deflections": all, "youngsModulus": {"value": mean, "unit": "Pa"}}),
        text,
    ))
}

/// The first mode of a case's arm.
fn mode(file: &std::path::Path, by: f64) -> Result<(Value, String), CliError> {
    let (case, _) = Case::read(file, &[]).map_err(|e| CliError::Failed(e.to_string()))?;
    let at = |e: &dyn std::fmt::Display| CliError::at(file, e.to_string());
    let model = SimulatedPlant::of_case(&case, &[]).map_err(|e| at(&e))?;
    let (case, _) = Case::read(file, &model.variables()).map_err(|e| CliError::Failed(e.to_string()))?;
    let values = model.set(&model.defaults(), &case.parameters).map_err(|e| at(&e))?;
    let (names, found) = first_mode_of(&model, &values, by).map_err(|e| at(&e))?;
    let hertz = found.frequency / std::f64::consts::TAU;
    let mut text = format!(
        "First mode: {} Hz, motors and rigid joints held, the base free\n\n  {:<22}{:>18}{:>26}\n",
        number(hertz),
        "spring",
        "elasticity share",
        format!("rise if {} % stiffer", number(100.0 * by)),
    );
    let mut springs = Map::new();
    for ((name, share), rise) in names.iter().zip(&found.shares).zip(&found.rises) {
        let _ = writeln!(text, "  {name:<22}{:>16.2} %{:>24.3} %", 100.0 * share, 100.0 * rise);
        springs.insert(name.clone(), json!({"share": share, "rise": rise}));
    }
    let within = FirstMode::within_rayleigh(&found.rises, by);
    let _ = writeln!(text, "\nRayleigh's bound on the rises: {}", if within { "kept" } else { "broken" });
    let json = json!({
        "schema": "trueup.statics/1",
        "firstMode": {"value": hertz, "unit": "Hz"},
        "stiffened": by,
        "springs": springs,
        "withinRayleighBound": within,
    });
    Ok((json, text))
}
