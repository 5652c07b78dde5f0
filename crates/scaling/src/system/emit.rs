//! A scaled system as TOML.

use std::path::{Component as Part, Path, PathBuf};

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::ScaledSystem;
use crate::error::ScalingError;
use crate::law::AffineScale;
use crate::toml::{Parsed, of, put, scale, value_mut};

/// The text of the system's TOML with the new values in their places, and those that its FMUs have added; of a single FMU
/// (`text` is then empty) a new system. `to` is the file that it will be; `inputs` the name of the scaled inputs, next to it.
///
/// # Errors
/// [`ScalingError::Mistakes`] where the text has no place for a value, with the remedy.
pub fn toml(
    scaled: &ScaledSystem,
    text: &str,
    from: &Path,
    to: &Path,
    inputs: Option<&str>,
) -> Result<String, ScalingError> {
    let mut document = Parsed::of(text, from)?.document.into_mut();
    let system = &scaled.system;
    for (at, component) in system.components.iter().enumerate() {
        let key = if component.name.is_empty() { single(scaled, at) } else { component.name.clone() };
        let table = table_in(document.as_table_mut(), &["components", &key], from)?;
        if text.is_empty() || apart(from, to) {
            table.insert("fmu", toml_edit::value(relative(&component.fmu, to)));
        }
        if let Some(step) = component.step {
            number(table, "step", step);
        }
        let changes = &scaled.changes;
        let old = &component.start[..changes.starts[at].len()];
        for (start, by) in old.iter().zip(&changes.starts[at]) {
            let Some(by) = by else { continue };
            let place = table.get_mut("start").and_then(Item::as_table_like_mut);
            let changed = place.is_some_and(|table| change(table, &start.variable, *by));
            if !changed {
                let message =
                    format!("start of `{}`: write it as a number, or a list of numbers", start.variable);
                let place = start.place.clone();
                return Err(ScalingError::Mistakes(vec![trueup_cosim::InputMistake { place, message }]));
            }
        }
        if !changes.added[at].is_empty() {
            let Some(start) = opened(table, "start") else {
                let message = format!("`start` of `{key}` is no table; write [components.{key}.start]");
                let place = component.place.clone();
                return Err(ScalingError::Mistakes(vec![trueup_cosim::InputMistake { place, message }]));
            };
            for (name, values) in &changes.added[at] {
                start.insert(name, Item::Value(value(values)));
            }
        }
    }
    connections(&mut document, scaled, from)?;
    let run = table_in(document.as_table_mut(), &["run"], from)?;
    for (key, x) in [("start", system.run.start), ("stop", system.run.stop), ("step", system.run.step)] {
        // A run from 0 begins at 0.
        if let Some(x) = x.filter(|x| *x != 0.0 || key != "start" || run.contains_key(key)) {
            number(run, key, x);
        }
    }
    if let Some(name) = inputs {
        match document.get_mut("inputs") {
            Some(item) if item.is_str() => *item = toml_edit::value(name),
            Some(item) => {
                if let Some(table) = item.as_table_like_mut() {
                    table.insert("file", toml_edit::value(name));
                }
            }
            None => {}
        }
    }
    Ok(document.to_string())
}

/// The name of a component that has none: that of its file.
fn single(scaled: &ScaledSystem, at: usize) -> String {
    let fmu = &scaled.system.components[at].fmu;
    let stem = fmu.file_stem().unwrap_or_default().to_string_lossy();
    let stem = stem.split('.').next().unwrap_or_default();
    if stem.is_empty() { "model".into() } else { stem.to_owned() }
}

/// The table at the end of this path, made where there is none.
fn table_in<'t>(
    root: &'t mut Table,
    path: &[&str],
    file: &Path,
) -> Result<&'t mut dyn TableLike, ScalingError> {
    let mut table: &mut dyn TableLike = root;
    for (depth, key) in path.iter().enumerate() {
        let item = table.entry(key).or_insert_with(|| {
            let mut made = Table::new();
            made.set_implicit(depth + 1 < path.len());
            Item::Table(made)
        });
        table = item.as_table_like_mut().ok_or_else(|| {
            ScalingError::at(file, format!("`{}` is no table; write [{}]", path.join("."), path.join(".")))
        })?;
    }
    Ok(table)
}

/// A table below this one, as lines of its own.
fn opened<'t>(table: &'t mut dyn TableLike, key: &str) -> Option<&'t mut dyn TableLike> {
    let inline = table.get_mut(key).and_then(Item::as_inline_table_mut).map(std::mem::take);
    if let Some(inline) = inline {
        table.insert(key, Item::Table(inline.into_table()));
    }
    table.entry(key).or_insert_with(|| Item::Table(Table::new())).as_table_like_mut()
}

/// Scales the value of this name; one without quotes (`spring.stiffness`) is a table in a table.
fn change(table: &mut dyn TableLike, name: &str, by: AffineScale) -> bool {
    if let Some(item) = table.get_mut(name) {
        return match item.as_table_like_mut() {
            Some(inner) => value_mut(inner, "value").is_some_and(|v| scale(v, by)),
            None => item.as_value_mut().is_some_and(|v| scale(v, by)),
        };
    }
    let dots = name.match_indices('.').map(|(at, _)| at).collect::<Vec<_>>();
    dots.into_iter().any(|at| {
        let inner = table.get_mut(&name[..at]).and_then(Item::as_table_like_mut);
        inner.is_some_and(|inner| change(inner, &name[at + 1..], by))
    })
}

fn value(values: &[f64]) -> Value {
    match values {
        [one] => of(*one),
        several => Value::Array(several.iter().map(|x| of(*x)).collect::<Array>()),
    }
}

fn number(table: &mut dyn TableLike, key: &str, x: f64) {
    match value_mut(table, key) {
        Some(value) => put(value, x),
        None => drop(table.insert(key, Item::Value(of(x)))),
    }
}

fn connections(document: &mut DocumentMut, scaled: &ScaledSystem, file: &Path) -> Result<(), ScalingError> {
    if scaled.changes.links.iter().all(Option::is_none) {
        return Ok(());
    }
    let Some(list) = document.get_mut("connections").and_then(Item::as_array_mut) else {
        return Err(ScalingError::at(file, "`connections` is a list: connections = [\"...\", \"...\"]"));
    };
    for (at, changed) in scaled.changes.links.iter().enumerate() {
        let (Some((factor, offset)), Some(value)) = (changed, list.get_mut(at)) else { continue };
        let connection = &scaled.system.connections[at];
        if value.as_inline_table().is_none() {
            let mut table = InlineTable::new();
            table.insert("from", connection.from.to_string().into());
            table.insert("to", connection.to.to_string().into());
            let decor = value.decor().clone();
            *value = Value::InlineTable(table);
            *value.decor_mut() = decor;
        }
        if let Some(table) = value.as_inline_table_mut() {
            for (key, x, usual) in [("factor", *factor, 1.0), ("offset", *offset, 0.0)] {
                if x != usual || table.contains_key(key) {
                    table.insert(key, of(x));
                }
            }
        }
    }
    Ok(())
}

/// They are in different folders.
fn apart(from: &Path, to: &Path) -> bool {
    folder(from) != folder(to)
}

fn folder(file: &Path) -> PathBuf {
    let whole = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    plain(whole.parent().unwrap_or(Path::new("")))
}

/// Without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Part::ParentDir => drop(plain.pop()),
            Part::CurDir => {}
            other => plain.push(other),
        }
    }
    plain
}

/// The path of a file as it is written in another one.
fn relative(path: &Path, in_file: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let (whole, folder) = (plain(&whole), folder(in_file));
    let common = whole.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| Part::ParentDir);
    let rest: PathBuf = up.chain(whole.components().skip(common)).collect();
    rest.to_string_lossy().replace('\\', "/")
}
