//! `[effects]` of a case: what is there for certain.

use toml::de::{DeTable, DeValue};

use super::{Case, KnownEffect};
use crate::finding::FindingKind;
use crate::keys;
use crate::names::element_name;
use crate::read::parameters;
use crate::read::toml::{TomlNode, TomlReader};
use crate::variable::SignalVariable;

impl Case {
    /// Each effect a table, of an arm at several joints a list of tables. Values join [`Case::parameters`], a standard deviation of the
    /// effect becomes one of each of its values.
    pub(super) fn known(&mut self, reader: &mut TomlReader, table: &DeTable, known: &[SignalVariable]) {
        for (key, node) in table.iter() {
            let id = key.get_ref().as_ref();
            match node.get_ref() {
                DeValue::Array(list) => list.iter().for_each(|node| self.one(reader, id, node, known)),
                _ => self.one(reader, id, node, known),
            }
        }
    }

    fn one(&mut self, reader: &mut TomlReader, id: &str, node: &TomlNode, known: &[SignalVariable]) {
        let what = format!("effects.{id}");
        let Some(table) = reader.table(node, &what) else { return };
        let number = |reader: &mut TomlReader, key: &str| table.get(key).and_then(|n| reader.number(n, key));
        let joint = match number(reader, "joint") {
            Some(j) if j.fract() != 0.0 || !(1.0..=1e3).contains(&j) => {
                let span = table.get("joint").map_or(0..0, |n| n.span());
                let mend = "write joint = 1 for the one next to the base";
                return reader.wrong(FindingKind::BadValue, span, format!("`joint` of {what} is {j}"), mend);
            }
            joint => joint.map(|j| j as usize),
        };
        let doubt = match number(reader, "doubt") {
            Some(d) if d < 0.0 => {
                let span = table.get("doubt").map_or(0..0, |n| n.span());
                let mend = "write a share such as 0.1 for 10 %, or 0 for values that are known";
                return reader.wrong(FindingKind::BadValue, span, format!("`doubt` of {what} is {d}"), mend);
            }
            doubt => doubt,
        };
        if self
            .effects
            .iter()
            .any(|e| e.id == id && (e.joint == joint || e.joint.is_none() || joint.is_none()))
        {
            let mend = "name it once, or once for each joint with `joint`";
            return reader.wrong(
                FindingKind::DuplicateName,
                node.span(),
                format!("{what} is named twice"),
                mend,
            );
        }
        let mut own = DeTable::new();
        for (key, node) in table.iter().filter(|(k, _)| !keys::EFFECTS.names().any(|n| n == k.get_ref())) {
            let name = match joint {
                Some(j) if node.get_ref().as_array().is_none() => element_name(key.get_ref(), &[j]).into(),
                _ => key.get_ref().clone(),
            };
            own.insert(toml::Spanned::new(key.span(), name), node.clone());
        }
        let values = parameters(reader, &own, known);
        let given = values.keys().cloned().collect();
        for (name, value) in values {
            if let Some(doubt) = doubt {
                self.uncertain.insert(name.clone(), doubt);
            }
            if self.parameters.insert(name.clone(), value).is_some() {
                let what = format!("`{name}` has a value in [parameters] and in {what}");
                reader.wrong(FindingKind::DuplicateName, node.span(), what, "give it once");
            }
        }
        self.effects.push(KnownEffect { id: id.to_owned(), joint, given });
    }
}
