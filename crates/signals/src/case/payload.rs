//! `[payload]` of a case: a body that a link of an arm carries.

use toml::de::{DeTable, DeValue};

use super::{Case, ParameterValue};
use crate::finding::FindingKind;
use crate::keys;
use crate::read::toml::{TomlNode, TomlReader};

/// A figure of a payload.
struct PayloadFigure {
    key: &'static str,
    /// Its numbers as the case names them.
    names: &'static [&'static str],
    /// The least of them.
    least: f64,
    /// How it is written where it is to be estimated, and in which unit.
    example: &'static str,
    unit: &'static str,
}

const FIGURES: [PayloadFigure; 3] = [
    PayloadFigure {
        key: "mass",
        names: &["payload.mass"],
        least: 0.0,
        example: "{ value = 0.0, doubt = 2.0 }",
        unit: "kg",
    },
    PayloadFigure {
        key: "centerOfMass",
        names: &["payload.centerOfMass[1]", "payload.centerOfMass[2]"],
        least: f64::NEG_INFINITY,
        example: "{ value = [0.4, 0.0], doubt = 0.05 }",
        unit: "m, along and across the link",
    },
    PayloadFigure {
        key: "inertia",
        names: &["payload.inertia"],
        least: 0.0,
        example: "{ value = 0.0, doubt = 0.1 }",
        unit: "kg.m2",
    },
];

impl PayloadFigure {
    fn mend(&self) -> String {
        format!("write {} = {} in {}, or the known value", self.key, self.example, self.unit)
    }
}

impl Case {
    /// Values join [`Case::parameters`] under names that begin with `payload.`, standard deviations [`Case::uncertain`], in SI.
    pub(super) fn carries(&mut self, reader: &mut TomlReader, node: &TomlNode) {
        let what = keys::PAYLOAD.of;
        let Some(table) = reader.table(node, what) else { return };
        reader.known(table, what, keys::PAYLOAD);
        if self.model != "PlanarManipulator" {
            let mend = "it is for PlanarManipulator; add what a joint moves to loadInertia";
            return reader.wrong(
                FindingKind::BadValue,
                node.span(),
                format!("{} has no [payload]", self.model),
                mend,
            );
        }
        let missing = |key: &str| table.get(key).is_none();
        for key in ["link", "mass"].into_iter().filter(|k| missing(k)) {
            let mend = "write link = 3 (from 1) and mass = { value = 0.0, doubt = 2.0 } in kg";
            reader.wrong(FindingKind::BadValue, node.span(), format!("[payload] has no `{key}`"), mend);
        }
        self.payload = table.get("link").and_then(|n| {
            let link = reader.number(n, "link")?;
            if link.fract() == 0.0 && (1.0..=1e3).contains(&link) {
                return Some(link as usize);
            }
            let mend = "write link = 1 for the one next to the base";
            reader.wrong(FindingKind::BadValue, n.span(), format!("`link` of [payload] is {link}"), mend);
            None
        });
        for figure in &FIGURES {
            let key = figure.key;
            let Some(node) = table.get(key) else { continue };
            let Some((values, doubt)) = figure_of(reader, node, figure) else { continue };
            for (name, value) in figure.names.iter().zip(values) {
                if value < figure.least {
                    let what = format!("`{key}` of [payload] is {value}");
                    reader.wrong(FindingKind::BadValue, node.span(), what, "it cannot be below 0");
                }
                self.parameters.insert((*name).to_owned(), ParameterValue::Number(value));
                if let Some(doubt) = doubt {
                    self.uncertain.insert((*name).to_owned(), doubt);
                }
            }
        }
    }
}

/// Numbers, or a table of a value and its `doubt`.
fn figure_of(
    reader: &mut TomlReader,
    node: &TomlNode,
    figure: &PayloadFigure,
) -> Option<(Vec<f64>, Option<f64>)> {
    let (key, count) = (figure.key, figure.names.len());
    if let Some(text) = node.get_ref().as_str() {
        let what = format!(
            "`{key}` of [payload] is {text:?}: neither a number nor a table of a value and its `doubt`"
        );
        reader.wrong(FindingKind::BadValue, node.span(), what, figure.mend());
        return None;
    }
    let table: Option<&DeTable> = node.get_ref().as_table();
    let (value, doubt, what) = match table {
        Some(table) => {
            reader.known(table, &format!("{key} of [payload]"), keys::PAYLOAD_FIGURE);
            (table.get("value").unwrap_or(node), table.get("doubt"), "value")
        }
        None => (node, None, key),
    };
    let doubt = match doubt {
        Some(n) => {
            let doubt = reader.number(n, "doubt")?;
            if doubt < 0.0 {
                let what = format!("`doubt` of {key} of [payload] is {doubt}");
                reader.wrong(FindingKind::BadValue, n.span(), what, "it cannot be below 0");
            }
            Some(doubt)
        }
        None => None,
    };
    let values: Vec<f64> = match value.get_ref() {
        DeValue::Array(list) => list.iter().map(|n| reader.number(n, what)).collect::<Option<Vec<f64>>>()?,
        DeValue::Table(_) => vec![0.0; count],
        _ => vec![reader.number(value, what)?],
    };
    if values.len() == count {
        return Some((values, doubt));
    }
    let wrong = format!("`{key}` of [payload] has {} numbers, not {count}", values.len());
    reader.wrong(FindingKind::BadValue, node.span(), wrong, figure.mend());
    None
}
