//! Tables of quantities: TOML whose numbers have their unit next to them, `mass = { value = 7900, unit = "kg" }`.

use std::path::Path;

use toml_edit::{Item, TableLike, Value};
use trueup_cosim::InputMistake;

use crate::error::ScalingError;
use crate::law::{ScalingLaw, UnitDimension};
use crate::toml::{Parsed, is_numbers, number, scale, value_mut};

/// The same text with all quantities scaled.
///
/// # Errors
/// [`ScalingError::Mistakes`]: a number without a unit, a unit that is not known or has no law; each with its line and the remedy.
pub fn scaled(text: &str, file: &Path, law: &ScalingLaw) -> Result<String, ScalingError> {
    let parsed = Parsed::of(text, file)?;
    let mut found = ScaledTable { parsed: &parsed, law, mistakes: Vec::new(), paths: Vec::new() };
    found.table(parsed.document.as_table(), &mut Vec::new());
    let ScaledTable { mistakes, paths, .. } = found;
    if !mistakes.is_empty() {
        return Err(ScalingError::Mistakes(mistakes));
    }
    let mut document = parsed.document.clone().into_mut();
    for (path, by) in paths {
        let mut table: Option<&mut dyn TableLike> = Some(document.as_table_mut());
        for key in &path {
            table = table.and_then(|t| t.get_mut(key)).and_then(Item::as_table_like_mut);
        }
        if let Some(value) = table.and_then(|t| value_mut(t, "value")) {
            scale(value, by);
        }
    }
    Ok(document.to_string())
}

struct ScaledTable<'a> {
    parsed: &'a Parsed<'a>,
    law: &'a ScalingLaw,
    mistakes: Vec<InputMistake>,
    /// Where quantities are.
    paths: Vec<(Vec<String>, crate::law::AffineScale)>,
}

impl ScaledTable<'_> {
    fn wrong(&mut self, item: &Item, message: String) {
        let place = self.parsed.place(item.span());
        self.mistakes.push(InputMistake { place, message });
    }

    fn table(&mut self, table: &dyn TableLike, path: &mut Vec<String>) {
        for (key, item) in table.iter() {
            path.push(key.to_owned());
            match item.as_table_like() {
                Some(inner) if inner.contains_key("value") => self.quantity(item, inner, path),
                Some(inner) => self.table(inner, path),
                None if item.is_array_of_tables() || item.as_value().is_some_and(has_number) => {
                    let mend = "write { value = 7900, unit = \"kg\" }, or unit = \"1\" for a plain number";
                    self.wrong(
                        item,
                        format!("`{}` has no unit, so its scale is not defined; {mend}", path.join(".")),
                    );
                }
                None => {}
            }
            path.pop();
        }
    }

    fn quantity(&mut self, item: &Item, table: &dyn TableLike, path: &[String]) {
        let name = path.join(".");
        let numbers = table.get("value").and_then(Item::as_value).is_some_and(is_numbers);
        let unit = table.get("unit").and_then(Item::as_str);
        let (true, Some(unit)) = (numbers, unit) else {
            let mend = "write { value = 7900, unit = \"kg\" }";
            return self.wrong(item, format!("`{name}` is no quantity; {mend}"));
        };
        let dimension = UnitDimension::named(unit);
        match self.law.of(&name, dimension) {
            Ok(by) => self.paths.push((path.to_vec(), by)),
            Err(why) => self.wrong(item, format!("`{name}` in {unit}: {why}")),
        }
    }
}

fn has_number(value: &Value) -> bool {
    match value.as_array() {
        Some(list) => list.iter().any(has_number),
        None => number(value).is_some(),
    }
}
