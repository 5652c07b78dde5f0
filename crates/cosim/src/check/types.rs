//! Which values may be handed on as which.

use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::description::{Description, DescriptionVariable, Item, VariableType};

/// A variable with what describes it.
#[derive(Clone, Copy)]
pub(super) struct Typed<'a> {
    pub(super) d: &'a Description,
    pub(super) v: &'a DescriptionVariable,
}

impl<'a> Typed<'a> {
    pub(super) fn name(self) -> &'static str {
        self.v.kind.name(self.d.version)
    }

    /// Items of its enumeration; empty if it is none or does not say.
    pub(super) fn items(self) -> &'a [Item] {
        match (self.v.kind, self.v.declared_type.as_deref()) {
            (VariableType::Enumeration, Some(name)) => {
                self.d.declared_type(name).map_or(&[][..], |t| &t.items)
            }
            _ => &[],
        }
    }

    /// Number of an entry of a map: an integer, an item's name, a Boolean.
    pub(super) fn number(self, text: &str) -> Option<i64> {
        let text = text.trim();
        match self.v.kind {
            VariableType::Boolean => match text {
                "true" | "1" => Some(1),
                "false" | "0" => Some(0),
                _ => None,
            },
            VariableType::Enumeration => {
                let items = self.items();
                let item = items.iter().find(|i| i.name == text).map(|i| i.value);
                item.or_else(|| {
                    text.parse().ok().filter(|n| items.is_empty() || items.iter().any(|i| i.value == *n))
                })
            }
            kind => {
                let (low, high) = range(kind, self.d.version)?;
                text.parse::<i64>().ok().filter(|n| (low..=high).contains(&i128::from(*n)))
            }
        }
    }
}

/// The integers that a type holds.
fn range(kind: VariableType, version: FmiVersion) -> Option<(i128, i128)> {
    let signed = |bits: u32| Some((-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1));
    let unsigned = |bits: u32| Some((0, (1_i128 << bits) - 1));
    match kind {
        VariableType::Int8 => signed(8),
        VariableType::Int16 => signed(16),
        VariableType::Int32 => signed(32),
        VariableType::Int64 => signed(64),
        VariableType::UInt8 => unsigned(8),
        VariableType::UInt16 => unsigned(16),
        VariableType::UInt32 => unsigned(32),
        VariableType::UInt64 => unsigned(64),
        VariableType::Boolean => Some((0, 1)),
        VariableType::Enumeration => signed(if version == FmiVersion::V2 { 32 } else { 64 }),
        // Whole numbers that a mantissa holds, one by one.
        VariableType::Float32 => Some((-(1 << 24), 1 << 24)),
        VariableType::Float64 => Some((-(1 << 53), 1 << 53)),
        VariableType::String | VariableType::Binary | VariableType::Clock => None,
    }
}

/// What a connection does to values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ValueConversion {
    /// As they are.
    Plain,
    /// Converted, without loss.
    Converted,
    /// An integer as the number of an item.
    Item,
}

/// May every value of `from` be handed on to `to`? `mapped`: a table replaces values.
pub(super) fn hand_on(from: Typed, to: Typed, mapped: bool) -> Result<ValueConversion, String> {
    let (a, b) = (from.v.kind, to.v.kind);
    let refuse = |why: &str| Err(format!("{} cannot be handed on as {}: {why}", from.name(), to.name()));
    if matches!(a, VariableType::Binary | VariableType::Clock)
        || matches!(b, VariableType::Binary | VariableType::Clock)
    {
        return refuse("binaries and clocks cannot be connected here");
    }
    if mapped {
        let counted = |kind: VariableType| !kind.is_float() && kind != VariableType::String;
        return match (counted(a), counted(b)) {
            (true, true) => Ok(if a == b { ValueConversion::Plain } else { ValueConversion::Converted }),
            _ => refuse("a map replaces integers, Booleans and items of enumerations only"),
        };
    }
    match (a, b) {
        (VariableType::Enumeration, VariableType::Enumeration) => {
            let (ours, theirs) = (from.items(), to.items());
            let differs = |item: &&Item| !theirs.iter().any(|i| i.value == item.value && i.name == item.name);
            match ours.iter().find(differs).filter(|_| !theirs.is_empty()) {
                Some(item) => Err(format!(
                    "the enumerations differ: `{}` = {} is no item of the input; give a map",
                    item.name, item.value
                )),
                None => Ok(ValueConversion::Plain),
            }
        }
        (VariableType::String, VariableType::String) => Ok(ValueConversion::Plain),
        (VariableType::String, _) | (_, VariableType::String) => refuse("one is text"),
        (_, VariableType::Enumeration) if a.is_float() || a == VariableType::Boolean => {
            refuse("not every number is an item; give a map")
        }
        (_, VariableType::Boolean) if a != b => refuse("not every number is true or false; give a map"),
        (VariableType::Float64, VariableType::Float32) => refuse("digits would be lost"),
        _ if a == b => Ok(ValueConversion::Plain),
        _ if a.is_float() && b.is_float() => Ok(ValueConversion::Converted),
        _ if a.is_float() => refuse("fractions would be lost"),
        _ => match (range(a, from.d.version), range(b, to.d.version)) {
            (Some(a), Some(range)) if a.0 >= range.0 && a.1 <= range.1 => {
                Ok(if b == VariableType::Enumeration {
                    ValueConversion::Item
                } else {
                    ValueConversion::Converted
                })
            }
            _ => refuse("not every value fits"),
        },
    }
}
