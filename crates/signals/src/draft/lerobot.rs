//! Names of columns in a LeRobot data set: `meta/info.json` has those of the elements of its lists.

use std::path::Path;

use serde_json::Value;

use crate::names::base_name;
use crate::read::ReadTable;

/// How deep readings are below the folder that has `meta`.
const DEEP: usize = 4;

/// Gives elements of lists their names: `observation.state[1]` is `shoulder.pos`.
pub(super) fn label(file: &Path, table: &mut ReadTable) {
    let info = file.ancestors().skip(1).take(DEEP).map(|folder| folder.join("meta").join("info.json"));
    let text = info.filter_map(|file| std::fs::read_to_string(file).ok()).next();
    let Some(info) = text.and_then(|text| serde_json::from_str::<Value>(&text).ok()) else { return };
    for column in table.columns.iter_mut().filter(|c| c.label.is_none()) {
        let base = base_name(&column.name);
        let index: Option<usize> = column.name[base.len()..].trim_matches(['[', ']']).parse().ok();
        let names = &info["features"][base]["names"];
        // A list, or a list under a word for what it lists.
        let names =
            names.as_array().or_else(|| names.as_object().and_then(|o| o.values().next()?.as_array()));
        let name = index.and_then(|k| names?.get(k.checked_sub(1)?)?.as_str());
        column.label = name.map(str::to_owned);
    }
}
