//! The messages of a topic as columns.

use std::collections::HashMap;

use mcap::{Channel, Message};
use prost_reflect::{DescriptorPool, DynamicMessage, MessageDescriptor};

use super::cdr::RosType;
use super::flat::{self, FlatMessage};

/// Where messages have the time of what they measured.
const STAMPS: [&str; 3] = ["header.stamp", "stamp", "timestamp"];

/// How messages are decoded.
enum Decoder {
    Ros(RosType),
    Json,
    Protobuf(MessageDescriptor),
    /// Not at all.
    None,
}

/// A topic.
pub(super) struct Topic {
    name: String,
    decoder: Decoder,
    /// Times at which messages were logged, in ns, and their own stamps.
    logged: Vec<i64>,
    stamps: Vec<Option<i64>>,
    pub(super) columns: Vec<TopicColumn>,
    by_path: HashMap<String, usize>,
    /// Names of the elements of arrays, in the order of the columns: joints of a JointState.
    elements: Vec<String>,
    /// What is left out, and why.
    pub(super) skipped: Vec<String>,
}

/// A field of its messages.
pub(super) struct TopicColumn {
    pub(super) name: String,
    pub(super) label: Option<String>,
    pub(super) values: Vec<f64>,
}

impl Topic {
    pub(super) fn of(channel: &Channel) -> Self {
        let mut topic = Self {
            name: channel.topic.clone(),
            decoder: Decoder::None,
            logged: Vec::new(),
            stamps: Vec::new(),
            columns: Vec::new(),
            by_path: HashMap::new(),
            elements: Vec::new(),
            skipped: Vec::new(),
        };
        match decoder(channel) {
            Ok(decoder) => topic.decoder = decoder,
            Err(why) => topic.skipped.push(format!("the topic `{}` is left out: {why}", topic.name)),
        }
        topic
    }

    /// One more message.
    ///
    /// # Errors
    /// It is not what its definition gives.
    pub(super) fn add(&mut self, message: &Message) -> Result<(), String> {
        let failed = |e: String| format!("a message of `{}`: {e}", message.channel.topic);
        let mut fields = FlatMessage::default();
        match &self.decoder {
            Decoder::None => return Ok(()),
            Decoder::Ros(kind) => kind.flatten(&message.data, &mut fields).map_err(failed)?,
            Decoder::Json => {
                let value = serde_json::from_slice(&message.data).map_err(|e| failed(e.to_string()))?;
                flat::json(&value, &mut fields);
            }
            Decoder::Protobuf(kind) => {
                let decoded = DynamicMessage::decode(kind.clone(), &message.data[..]);
                flat::protobuf(&decoded.map_err(|e| failed(e.to_string()))?, &mut fields);
            }
        }
        for long in std::mem::take(&mut fields.long) {
            let what = format!("`{}.{long}` is a long array and is left out", self.name);
            if !self.skipped.contains(&what) {
                self.skipped.push(what);
            }
        }
        let stamp = STAMPS.iter().find_map(|path| fields.take_time(path));
        let order = self.order(&fields);
        let row = self.logged.len();
        for (path, value) in fields.numbers {
            let path = renumbered(path, &order);
            let column = match self.by_path.get(&path) {
                Some(at) => *at,
                None => {
                    let label = element(&path).and_then(|(_, k)| self.elements.get(k - 1).cloned());
                    let name = format!("{}.{path}", self.name);
                    self.columns.push(TopicColumn { name, label, values: vec![f64::NAN; row] });
                    self.by_path.insert(path, self.columns.len() - 1);
                    self.columns.len() - 1
                }
            };
            let values = &mut self.columns[column].values;
            values.resize(row, f64::NAN);
            values.push(value);
        }
        self.columns.iter_mut().for_each(|c| c.values.resize(row + 1, f64::NAN));
        self.logged.push(i64::try_from(message.log_time).unwrap_or(i64::MAX));
        self.stamps.push(stamp);
        Ok(())
    }

    /// Where the elements of this message belong: its own names of them may come in another order, or be others.
    fn order(&mut self, fields: &FlatMessage) -> Vec<usize> {
        let names =
            fields.texts.iter().filter(|(path, _)| element(path).is_some_and(|(base, _)| base == "name"));
        let place = |(_, name): &(String, String)| {
            let at = self.elements.iter().position(|n| n == name).unwrap_or_else(|| {
                self.elements.push(name.clone());
                self.elements.len() - 1
            });
            at + 1
        };
        names.map(place).collect()
    }

    /// Every message has a stamp of its own, and they go on.
    pub(super) fn is_stamped(&self) -> bool {
        self.stamps.iter().all(Option::is_some)
            && (self.stamps.len() < 2 || self.stamps.iter().any(|t| *t != self.stamps[0]))
    }

    /// Times of its messages in ns.
    pub(super) fn times(&self, stamped: bool) -> impl Iterator<Item = i64> {
        let own = self.stamps.iter().zip(&self.logged);
        own.map(move |(stamp, logged)| stamp.filter(|_| stamped).unwrap_or(*logged))
    }

    pub(super) fn len(&self) -> usize {
        self.logged.len()
    }
}

fn decoder(channel: &Channel) -> Result<Decoder, String> {
    let schema = channel.schema.as_ref();
    let defined = schema.map_or("", |s| s.encoding.as_str());
    match (channel.message_encoding.as_str(), schema) {
        ("json", _) => Ok(Decoder::Json),
        ("cdr", Some(s)) if defined == "ros2msg" => {
            let text = std::str::from_utf8(&s.data).map_err(|e| e.to_string())?;
            RosType::parse(&s.name, text).map(Decoder::Ros)
        }
        ("protobuf", Some(s)) if defined == "protobuf" => {
            let pool = DescriptorPool::decode(&s.data[..]).map_err(|e| e.to_string())?;
            let found = pool.get_message_by_name(&s.name);
            found.map(Decoder::Protobuf).ok_or_else(|| format!("its definition has no message `{}`", s.name))
        }
        (messages, _) => Err(format!(
            "messages `{messages}` defined by `{defined}` are not read (but cdr by ros2msg, json, protobuf)"
        )),
    }
}

/// `position` and 3 of `position[3]`; nothing of what is nested: names of elements are of a message's own arrays.
fn element(path: &str) -> Option<(&str, usize)> {
    let (base, index) = path.strip_suffix(']')?.rsplit_once('[')?;
    index.parse().ok().filter(|k| *k > 0 && !base.contains(['.', '['])).map(|k| (base, k))
}

/// An element of an array whose elements have names, at its place.
fn renumbered(path: String, order: &[usize]) -> String {
    let place = element(&path).and_then(|(base, k)| Some((base, *order.get(k - 1)?)));
    match place {
        Some((base, k)) => format!("{base}[{k}]"),
        None => path,
    }
}
