//! JSON Schema (2020-12) from tables of keys.

use serde_json::{Map, Value, json};

use crate::keys::{COLUMN, CaseFileKey, KeyValue, Keys};

/// Of a file whose root has these keys.
pub fn schema(title: &str, keys: &Keys) -> Value {
    let mut root = table(keys);
    if let Value::Object(root) = &mut root {
        root.insert("$schema".into(), json!("https://json-schema.org/draft/2020-12/schema"));
        root.insert("title".into(), json!(title));
    }
    root
}

/// A key without which nothing is read has this default.
const REQUIRED: &str = "must be given";

/// These keys and no other.
fn table(keys: &Keys) -> Value {
    let mut own = json!({ "type": "object", "properties": properties(keys), "additionalProperties": false });
    let required: Vec<&str> = keys.list.iter().filter(|k| k.default == REQUIRED).map(|k| k.name).collect();
    if let (Value::Object(own), false) = (&mut own, required.is_empty()) {
        own.insert("required".into(), json!(required));
    }
    own
}

fn properties(keys: &Keys) -> Map<String, Value> {
    keys.list.iter().map(|key| (key.name.to_owned(), property(key))).collect()
}

fn property(key: &CaseFileKey) -> Value {
    let unit = if key.unit.is_empty() { String::new() } else { format!(" [{}]", key.unit) };
    let default = if key.default.is_empty() { String::new() } else { format!("; default: {}", key.default) };
    let mut own = form(&key.value);
    if let Value::Object(own) = &mut own {
        own.insert("description".into(), json!(format!("{}{unit}{default}", key.meaning)));
    }
    own
}

fn any_of(forms: &[KeyValue]) -> Value {
    json!({ "anyOf": forms.iter().map(form).collect::<Vec<_>>() })
}

/// Numbers, and arrays of these forms in arrays, as deep as a matrix is.
fn nested(scalars: &[&str]) -> Value {
    let one = json!({ "type": scalars });
    let list = json!({ "type": "array", "items": one });
    json!({ "anyOf": [one, list, { "type": "array", "items": list }] })
}

fn form(value: &KeyValue) -> Value {
    match value {
        KeyValue::Text => json!({ "type": "string" }),
        KeyValue::Texts => json!({ "type": "array", "items": { "type": "string" } }),
        KeyValue::TextGroups => {
            json!({ "type": "array", "items": { "type": "array", "items": { "type": "string" }, "minItems": 2 } })
        }
        KeyValue::Number => json!({ "type": "number" }),
        KeyValue::Numbers => json!({ "type": "array", "items": { "type": "number" } }),
        KeyValue::Integer => json!({ "type": "integer" }),
        KeyValue::Flag => json!({ "type": "boolean" }),
        KeyValue::Never => json!({ "const": false }),
        KeyValue::OneOf(texts) => json!({ "enum": texts }),
        KeyValue::Either(forms) => any_of(forms),
        KeyValue::Table(keys) => table(keys),
        KeyValue::List(forms) => json!({ "type": "array", "items": any_of(forms) }),
        KeyValue::Anything => json!({ "type": "object" }),
        KeyValue::Entries(keys) => json!({
            "type": "object",
            "properties": properties(keys),
            "additionalProperties": nested(&["number", "boolean", "string"]),
        }),
        KeyValue::EntryLists(keys) => json!({ "type": "array", "items": form(&KeyValue::Entries(keys)) }),
        KeyValue::Named(forms) => json!({ "type": "object", "additionalProperties": any_of(forms) }),
        KeyValue::Columns => {
            let column = any_of(COLUMN);
            let file = json!({ "type": "object", "additionalProperties": column });
            json!({ "type": "object", "additionalProperties": { "anyOf": [column, file] } })
        }
        KeyValue::Values => {
            json!({ "type": "object", "additionalProperties": nested(&["number", "boolean", "string"]) })
        }
        KeyValue::Deviations => json!({ "type": "object", "additionalProperties": nested(&["number"]) }),
    }
}
