//! A message as fields by path.

use prost_reflect::{DynamicMessage, ReflectMessage, Value as ProtobufValue};
use serde_json::Value;

/// More elements are an image or a cloud of points, no signals.
pub(super) const LONGEST: usize = 256;
/// Deeper messages are refused.
pub(super) const DEEPEST: usize = 32;

/// Names of the parts of a time: s and ns.
const TIMES: [[&str; 2]; 4] = [["sec", "nanosec"], ["seconds", "nanos"], ["sec", "nsec"], ["secs", "nsecs"]];

/// Numbers and texts by their paths: `header.stamp.sec`, `position[3]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct FlatMessage {
    pub(super) numbers: Vec<(String, f64)>,
    pub(super) texts: Vec<(String, String)>,
    /// Arrays that are left out.
    pub(super) long: Vec<String>,
}

impl FlatMessage {
    /// Takes a time out, in ns; `None`: there is none, or it was not set.
    pub(super) fn take_time(&mut self, path: &str) -> Option<i64> {
        for [seconds, rest] in TIMES {
            let at = |part: &str| self.numbers.iter().position(|(p, _)| *p == format!("{path}.{part}"));
            if let (Some(s), Some(ns)) = (at(seconds), at(rest)) {
                let [whole, parts] = [s, ns].map(|i| self.numbers[i].1 as i64);
                self.numbers.retain(|(p, _)| p.rsplit_once('.').is_none_or(|(base, _)| base != path));
                return whole.checked_mul(1_000_000_000)?.checked_add(parts).filter(|t| *t != 0);
            }
        }
        None
    }
}

/// `a.b` of `a` and `b`.
pub(super) fn joined(path: &str, field: &str) -> String {
    if path.is_empty() { field.to_owned() } else { format!("{path}.{field}") }
}

pub(super) fn json(value: &Value, fields: &mut FlatMessage) {
    one_json("", value, fields, 0);
}

fn one_json(path: &str, value: &Value, fields: &mut FlatMessage, depth: usize) {
    match value {
        Value::Null => {}
        Value::Bool(b) => fields.numbers.push((path.into(), f64::from(u8::from(*b)))),
        Value::Number(x) => fields.numbers.push((path.into(), x.as_f64().unwrap_or(f64::NAN))),
        Value::String(text) => fields.texts.push((path.into(), text.clone())),
        Value::Array(list) if list.len() > LONGEST => fields.long.push(path.into()),
        Value::Array(list) if depth < DEEPEST => {
            for (k, value) in list.iter().enumerate() {
                one_json(&format!("{path}[{}]", k + 1), value, fields, depth + 1);
            }
        }
        Value::Object(object) if depth < DEEPEST => {
            object.iter().for_each(|(name, value)| one_json(&joined(path, name), value, fields, depth + 1));
        }
        Value::Array(_) | Value::Object(_) => fields.long.push(path.into()),
    }
}

pub(super) fn protobuf(message: &DynamicMessage, fields: &mut FlatMessage) {
    of_message("", message, fields, 0);
}

fn of_message(path: &str, message: &DynamicMessage, fields: &mut FlatMessage, depth: usize) {
    for field in message.descriptor().fields() {
        // A number that was not written is 0; a message that was not written is not there.
        if !field.supports_presence() || message.has_field(&field) {
            let value = message.get_field(&field);
            one_protobuf(&joined(path, field.name()), value.as_ref(), fields, depth);
        }
    }
}

fn one_protobuf(path: &str, value: &ProtobufValue, fields: &mut FlatMessage, depth: usize) {
    let number = match value {
        ProtobufValue::Bool(b) => f64::from(u8::from(*b)),
        ProtobufValue::I32(x) | ProtobufValue::EnumNumber(x) => (*x).into(),
        ProtobufValue::I64(x) => *x as f64,
        ProtobufValue::U32(x) => (*x).into(),
        ProtobufValue::U64(x) => *x as f64,
        ProtobufValue::F32(x) => (*x).into(),
        ProtobufValue::F64(x) => *x,
        ProtobufValue::String(text) => return fields.texts.push((path.into(), text.clone())),
        ProtobufValue::Message(message) if depth < DEEPEST => {
            return of_message(path, message, fields, depth + 1);
        }
        ProtobufValue::List(list) if list.len() <= LONGEST && depth < DEEPEST => {
            for (k, value) in list.iter().enumerate() {
                one_protobuf(&format!("{path}[{}]", k + 1), value, fields, depth + 1);
            }
            return;
        }
        _ => return fields.long.push(path.into()),
    };
    fields.numbers.push((path.into(), number));
}
