//! Which values may be handed on as which.

use trueup_fmi_description::Version;
use trueup_fmi_description::description::{Description, Item, Type, Variable};

/// A variable with what describes it.
#[derive(Clone, Copy)]
pub(super) struct Typed<'a> {
    pub(super) d: &'a Description,
    pub(super) v: &'a Variable,
}

impl<'a> Typed<'a> {
    pub(super) fn name(self) -> &'static str {
        self.v.kind.name(self.d.version)
    }

    /// Items of its enumeration; empty if it is none or does not say.
    pub(super) fn items(self) -> &'a [Item] {
        match (self.v.kind, self.v.declared_type.as_deref()) {
            (Type::Enumeration, Some(name)) => self.d.declared_type(name).map_or(&[][..], |t| &t.items),
            _ => &[],
        }
    }

    /// Number of what a map says: an integer, an item's name, a Boolean.
    pub(super) fn number(self, text: &str) -> Option<i64> {
        let text = text.trim();
        match self.v.kind {
            Type::Boolean => match text {
                "true" | "1" => Some(1),
                "false" | "0" => Some(0),
                _ => None,
            },
            Type::Enumeration => {
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
fn range(kind: Type, version: Version) -> Option<(i128, i128)> {
    let signed = |bits: u32| Some((-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1));
    let unsigned = |bits: u32| Some((0, (1_i128 << bits) - 1));
    match kind {
        Type::Int8 => signed(8),
        Type::Int16 => signed(16),
        Type::Int32 => signed(32),
        Type::Int64 => signed(64),
        Type::UInt8 => unsigned(8),
        Type::UInt16 => unsigned(16),
        Type::UInt32 => unsigned(32),
        Type::UInt64 => unsigned(64),
        Type::Boolean => Some((0, 1)),
        Type::Enumeration => signed(if version == Version::V2 { 32 } else { 64 }),
        // Whole numbers that a mantissa holds, one by one.
        Type::Float32 => Some((-(1 << 24), 1 << 24)),
        Type::Float64 => Some((-(1 << 53), 1 << 53)),
        Type::String | Type::Binary | Type::Clock => None,
    }
}

/// What a connection does to values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hand {
    /// As they are.
    Plain,
    /// Converted, without loss.
    Converted,
    /// An integer as the number of an item.
    Item,
}

/// May every value of `from` be handed on to `to`? `mapped`: a table replaces values.
pub(super) fn hand_on(from: Typed, to: Typed, mapped: bool) -> Result<Hand, String> {
    let (a, b) = (from.v.kind, to.v.kind);
    let refuse = |why: &str| Err(format!("{} cannot be handed on as {}: {why}", from.name(), to.name()));
    if matches!(a, Type::Binary | Type::Clock) || matches!(b, Type::Binary | Type::Clock) {
        return refuse("binaries and clocks cannot be connected here");
    }
    if mapped {
        let counted = |kind: Type| !kind.is_float() && kind != Type::String;
        return match (counted(a), counted(b)) {
            (true, true) => Ok(if a == b { Hand::Plain } else { Hand::Converted }),
            _ => refuse("a map replaces integers, Booleans and items of enumerations only"),
        };
    }
    match (a, b) {
        (Type::Enumeration, Type::Enumeration) => {
            let (ours, theirs) = (from.items(), to.items());
            let differs = |item: &&Item| !theirs.iter().any(|i| i.value == item.value && i.name == item.name);
            match ours.iter().find(differs).filter(|_| !theirs.is_empty()) {
                Some(item) => Err(format!(
                    "the enumerations differ: `{}` = {} is no item of the input; give a map",
                    item.name, item.value
                )),
                None => Ok(Hand::Plain),
            }
        }
        (Type::String, Type::String) => Ok(Hand::Plain),
        (Type::String, _) | (_, Type::String) => refuse("one is text"),
        (_, Type::Enumeration) if a.is_float() || a == Type::Boolean => {
            refuse("not every number is an item; give a map")
        }
        (_, Type::Boolean) if a != b => refuse("not every number is true or false; give a map"),
        (Type::Float64, Type::Float32) => refuse("digits would be lost"),
        _ if a == b => Ok(Hand::Plain),
        _ if a.is_float() && b.is_float() => Ok(Hand::Converted),
        _ if a.is_float() => refuse("fractions would be lost"),
        _ => match (range(a, from.d.version), range(b, to.d.version)) {
            (Some(a), Some(range)) if a.0 >= range.0 && a.1 <= range.1 => {
                Ok(if b == Type::Enumeration { Hand::Item } else { Hand::Converted })
            }
            _ => refuse("not every value fits"),
        },
    }
}
