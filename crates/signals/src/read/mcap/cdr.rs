//! ROS 2 messages: their definitions (`ros2msg`) and their bytes (CDR).

use std::collections::HashMap;

use super::flat::{DEEPEST, FlatMessage, LONGEST, joined};

/// The definition of a message and of all that it contains.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RosType {
    name: String,
    types: HashMap<String, Vec<RosField>>,
}

#[derive(Clone, Debug, PartialEq)]
struct RosField {
    name: String,
    kind: FieldKind,
    many: Many,
}

#[derive(Clone, Debug, PartialEq)]
enum FieldKind {
    Number(NumberKind),
    Text,
    Message(String),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum NumberKind {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Many {
    One,
    Fixed(usize),
    /// As many as the message counts.
    Counted,
}

impl NumberKind {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Self::Bool,
            "int8" => Self::I8,
            "byte" | "char" | "uint8" => Self::U8,
            "int16" => Self::I16,
            "uint16" => Self::U16,
            "int32" => Self::I32,
            "uint32" => Self::U32,
            "int64" => Self::I64,
            "uint64" => Self::U64,
            "float32" => Self::F32,
            "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::Bool | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// `sensor_msgs/msg/JointState` and `sensor_msgs/JointState` are one.
fn plain(name: &str) -> String {
    name.replace("/msg/", "/")
}

impl RosType {
    /// Reads a definition with those of the messages that it contains behind it.
    ///
    /// # Errors
    /// What is not understood.
    pub(super) fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut all = Self { name: plain(name), types: HashMap::new() };
        let (mut own, mut fields) = (all.name.clone(), Vec::new());
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or("").trim();
            if line.starts_with("====") {
                all.types.insert(std::mem::take(&mut own), std::mem::take(&mut fields));
            } else if let Some(next) = line.strip_prefix("MSG:") {
                own = plain(next.trim());
            } else if !line.is_empty() {
                fields.extend(field(line, &own)?);
            }
        }
        all.types.insert(own, fields);
        all.complete()?;
        Ok(all)
    }

    /// Every message that a field names is defined.
    fn complete(&self) -> Result<(), String> {
        for field in self.types.values().flatten() {
            if let FieldKind::Message(name) = &field.kind
                && !self.types.contains_key(name)
            {
                return Err(format!("its definition lacks that of `{name}`"));
            }
        }
        Ok(())
    }

    /// The fields of a message.
    ///
    /// # Errors
    /// The bytes are not what the definition gives.
    pub(super) fn flatten(&self, bytes: &[u8], fields: &mut FlatMessage) -> Result<(), String> {
        let little = match bytes {
            [0, 0, _, _, ..] => false,
            [0, 1, _, _, ..] => true,
            _ => return Err("its CDR is of a kind that is not read (only plain CDR is)".into()),
        };
        let mut reader = CdrReader { bytes: &bytes[4..], at: 0, little };
        self.message(&self.name, "", &mut reader, fields, 0)
    }

    fn message(
        &self,
        name: &str,
        path: &str,
        reader: &mut CdrReader,
        fields: &mut FlatMessage,
        depth: usize,
    ) -> Result<(), String> {
        if depth > DEEPEST {
            return Err(format!("`{path}` is nested too deeply"));
        }
        let own = self.types.get(name).map_or(&[][..], Vec::as_slice);
        if own.is_empty() {
            // What has no member has a byte instead.
            reader.number(NumberKind::U8)?;
        }
        for field in own {
            let path = joined(path, &field.name);
            let count = match field.many {
                Many::One => {
                    self.one(&field.kind, path, reader, fields, depth)?;
                    continue;
                }
                Many::Fixed(n) => n,
                Many::Counted => reader.count()?,
            };
            if let (FieldKind::Number(kind), true) = (&field.kind, count > LONGEST) {
                reader.skip(*kind, count)?;
                fields.long.push(path);
                continue;
            }
            let mut ignored = FlatMessage::default();
            for k in 0..count {
                let into = if k < LONGEST { &mut *fields } else { &mut ignored };
                self.one(&field.kind, format!("{path}[{}]", k + 1), reader, into, depth)?;
                ignored = FlatMessage::default();
            }
            if count > LONGEST {
                fields.long.push(path);
            }
        }
        Ok(())
    }

    fn one(
        &self,
        kind: &FieldKind,
        path: String,
        reader: &mut CdrReader,
        fields: &mut FlatMessage,
        depth: usize,
    ) -> Result<(), String> {
        match kind {
            FieldKind::Number(kind) => fields.numbers.push((path, reader.number(*kind)?)),
            FieldKind::Text => fields.texts.push((path, reader.text()?)),
            FieldKind::Message(name) => self.message(name, &path, reader, fields, depth + 1)?,
        }
        Ok(())
    }
}

/// `float64[<=3] position`; a constant is none.
fn field(line: &str, of: &str) -> Result<Option<RosField>, String> {
    let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(|| format!("`{line}` is no field"))?;
    let rest = rest.trim();
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
    if rest[end..].trim_start().starts_with('=') {
        return Ok(None);
    }
    let name = rest[..end].to_owned();
    let (kind, many) = match kind.strip_suffix(']').and_then(|k| k.split_once('[')) {
        None => (kind, Many::One),
        Some((kind, size)) if size.is_empty() || size.starts_with("<=") => (kind, Many::Counted),
        Some((kind, size)) => {
            (kind, Many::Fixed(size.parse().map_err(|_| format!("`{line}` has no size that can be read"))?))
        }
    };
    let text = kind == "string" || kind.starts_with("string<=");
    let kind = match NumberKind::named(kind) {
        Some(number) => FieldKind::Number(number),
        None if text => FieldKind::Text,
        None if kind.starts_with("wstring") => return Err("texts of wide characters are not read".into()),
        None if kind.contains('/') => FieldKind::Message(plain(kind)),
        None if kind == "Header" => FieldKind::Message("std_msgs/Header".into()),
        // Of the same package.
        None => {
            FieldKind::Message(format!("{}/{kind}", of.rsplit_once('/').map_or("", |(package, _)| package)))
        }
    };
    Ok(Some(RosField { name, kind, many }))
}

struct CdrReader<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
}

impl CdrReader<'_> {
    fn take(&mut self, size: usize, count: usize) -> Result<&[u8], String> {
        let begin = self.at.next_multiple_of(size);
        let end = size.checked_mul(count).and_then(|n| begin.checked_add(n));
        let found = end.and_then(|end| self.bytes.get(begin..end));
        let found = found.ok_or("it is shorter than its definition")?;
        self.at = begin + found.len();
        Ok(found)
    }

    fn number(&mut self, kind: NumberKind) -> Result<f64, String> {
        let little = self.little;
        let own = self.take(kind.size(), 1)?;
        macro_rules! of {
            ($t:ty) => {{
                let bytes = own.try_into().map_err(|_| "it is damaged")?;
                if little { <$t>::from_le_bytes(bytes) } else { <$t>::from_be_bytes(bytes) }
            }};
        }
        Ok(match kind {
            NumberKind::Bool => f64::from(u8::from(of!(u8) != 0)),
            NumberKind::I8 => of!(i8).into(),
            NumberKind::U8 => of!(u8).into(),
            NumberKind::I16 => of!(i16).into(),
            NumberKind::U16 => of!(u16).into(),
            NumberKind::I32 => of!(i32).into(),
            NumberKind::U32 => of!(u32).into(),
            NumberKind::I64 => of!(i64) as f64,
            NumberKind::U64 => of!(u64) as f64,
            NumberKind::F32 => of!(f32).into(),
            NumberKind::F64 => of!(f64),
        })
    }

    /// How many elements follow; each takes a byte at least.
    fn count(&mut self) -> Result<usize, String> {
        let count = self.number(NumberKind::U32)? as usize;
        if count > self.bytes.len() { Err("it is shorter than its definition".into()) } else { Ok(count) }
    }

    fn skip(&mut self, kind: NumberKind, count: usize) -> Result<(), String> {
        self.take(kind.size(), count).map(|_| ())
    }

    fn text(&mut self) -> Result<String, String> {
        let length = self.count()?;
        let bytes = self.take(1, length)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }
}
