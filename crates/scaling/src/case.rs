//! Cases: the nominal model, what is known of sensors. Recordings are scaled separately ([`crate::recording`]).

use std::path::Path;

use toml_edit::{Item, Table, TableLike};
use trueup_cosim::InputMistake;
use trueup_signals::{SignalVariable, base_name};

use crate::error::ScalingError;
use crate::law::{AffineScale, ScalingLaw, UnitDimension};
use crate::toml::{Parsed, of, scale};

/// Keys of a case that hold no quantity.
const PLAIN: [&str; 7] = ["model", "train", "holdout", "repeats", "rest", "uncertain", "fit"];

/// The text of a `case.toml` with parameters and sensors scaled. `variables` are the model's; `left_out` are the values of parameters
/// that the case leaves to the model, by element, which are written out.
///
/// # Errors
/// [`ScalingError::Mistakes`]: what has no law, with line, variable and remedy.
pub fn scaled(
    text: &str,
    file: &Path,
    law: &ScalingLaw,
    variables: &[SignalVariable],
    left_out: &[(String, f64)],
) -> Result<String, ScalingError> {
    let parsed = Parsed::of(text, file)?;
    let mut work = CaseScaling { parsed: &parsed, law, variables, mistakes: Vec::new(), found: Vec::new() };
    for (key, item) in parsed.document.as_table().iter() {
        match (key, item.as_table_like()) {
            ("parameters", Some(table)) => work.parameters(table),
            ("channels", Some(table)) => work.channels(table),
            _ if PLAIN.contains(&key) => {}
            _ => work.wrong(
                item,
                format!("`{key}` cannot be scaled; take it out, and put its scaled values back"),
            ),
        }
    }
    let mut added = Vec::new();
    for (name, value) in left_out.iter().filter(|(_, value)| *value != 0.0) {
        match column(law, variables, name) {
            Ok(by) if by.is_one() => {}
            Ok(by) => added.push((name, by.apply(*value))),
            Err(why) => {
                let place = parsed.place(None);
                let message = format!("`{name}`: {why}; the value is the model's own");
                work.mistakes.push(InputMistake { place, message });
            }
        }
    }
    let CaseScaling { mistakes, found, .. } = work;
    if !mistakes.is_empty() {
        return Err(ScalingError::Mistakes(mistakes));
    }
    let mut document = parsed.document.clone().into_mut();
    for (path, by) in found {
        let mut item = Some(document.as_item_mut());
        for key in &path {
            item = item.and_then(Item::as_table_like_mut).and_then(|t| t.get_mut(key));
        }
        if let Some(value) = item.and_then(Item::as_value_mut) {
            scale(value, by);
        }
    }
    if let Some(weights) = document.get_mut("fit").and_then(|fit| fit.get_mut("weight")) {
        times(weights, law);
    }
    if !added.is_empty() {
        let parameters = document.entry("parameters").or_insert_with(|| Item::Table(Table::new()));
        if let Some(table) = parameters.as_table_like_mut() {
            added.iter().for_each(|(name, x)| drop(table.insert(name, Item::Value(of(*x)))));
        }
    }
    Ok(document.to_string())
}

/// How a variable of the model (an array, an element) scales.
///
/// # Errors
/// There is none, or it has no law; in words.
pub fn column(law: &ScalingLaw, variables: &[SignalVariable], name: &str) -> Result<AffineScale, String> {
    let known = variables.iter().find(|v| v.name == name);
    let known = known.or_else(|| variables.iter().find(|v| base_name(&v.name) == name));
    let known = known.ok_or_else(|| "the model has no such variable; take it out".to_owned())?;
    let refused = |why| crate::recording::refused(&known.unit, &why).replace("NAME", name);
    law.of(name, UnitDimension::named(&known.unit)).map_err(refused)
}

/// Times of stretches of `weight` in `[fit]`, in either form of a list of tables.
fn times(weights: &mut Item, law: &ScalingLaw) {
    let one = |stretch: &mut dyn TableLike| {
        for key in ["start", "end"] {
            if let Some(value) = stretch.get_mut(key).and_then(Item::as_value_mut) {
                scale(value, law.time());
            }
        }
    };
    if let Some(tables) = weights.as_array_of_tables_mut() {
        tables.iter_mut().for_each(|table| one(table));
    } else if let Some(list) = weights.as_array_mut() {
        list.iter_mut().filter_map(|v| v.as_inline_table_mut()).for_each(|table| one(table));
    }
}

struct CaseScaling<'a> {
    parsed: &'a Parsed<'a>,
    law: &'a ScalingLaw,
    variables: &'a [SignalVariable],
    mistakes: Vec<InputMistake>,
    /// Where quantities are.
    found: Vec<(Vec<String>, AffineScale)>,
}

impl CaseScaling<'_> {
    fn wrong(&mut self, item: &Item, message: String) {
        let place = self.parsed.place(item.span());
        self.mistakes.push(InputMistake { place, message });
    }

    fn parameters(&mut self, table: &dyn TableLike) {
        for (name, item) in table.iter() {
            let Some(value) = item.as_value().filter(|v| crate::toml::is_numbers(v)) else {
                continue; // a choice
            };
            match column(self.law, self.variables, name) {
                Ok(by) => self.found.push((vec!["parameters".into(), name.into()], by)),
                Err(_) if crate::toml::is_zero(value) => {}
                Err(why) => self.wrong(item, format!("`{name}`: {why}")),
            }
        }
    }

    fn channels(&mut self, table: &dyn TableLike) {
        for (channel, item) in table.iter() {
            for (key, item) in item.as_table_like().into_iter().flat_map(|t| t.iter()) {
                if !item.as_value().is_some_and(crate::toml::is_numbers) {
                    continue;
                }
                let by = match key {
                    "delay" => Ok(self.law.time()),
                    "resolution" | "noise" => column(self.law, self.variables, channel),
                    _ => Err("it cannot be scaled; take it out, and put its scaled value back".into()),
                };
                match by {
                    Ok(by) => self.found.push((vec!["channels".into(), channel.into(), key.into()], by)),
                    Err(why) => self.wrong(item, format!("`{key}` of `{channel}`: {why}")),
                }
            }
        }
    }
}
