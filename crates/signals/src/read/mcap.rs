//! MCAP: topics of messages become columns `topic.field[3]`, elements counted from 1.

mod cdr;
mod flat;
mod topic;

use std::collections::BTreeMap;
use std::path::Path;

use mcap::{MAGIC, McapError, MessageStream};

use super::guard::guarded;
use super::table::{ClockTicks, ReadTable, TableColumn};
use crate::finding::{Finding, FindingKind};
use topic::Topic;

/// Times of MCAP are in ns.
const PER_SECOND: f64 = 1e9;
/// A time in ns beyond this one, of the year 1973, is counted from the beginning of 1970.
const EPOCH: i64 = 100_000_000_000_000_000;

pub(super) fn read(file: &Path, bytes: &[u8], findings: &mut Vec<Finding>) -> Option<ReadTable> {
    let wrong = |kind, what: String, mend: &str| Finding::error(kind, file, what, mend);
    if bytes.is_empty() {
        findings.push(wrong(FindingKind::EmptyFile, "the file is empty".into(), "record it again"));
        return None;
    }
    if bytes.starts_with(MAGIC) && !(bytes.len() > 2 * MAGIC.len() && bytes.ends_with(MAGIC)) {
        let what = format!("the MCAP is truncated: its end is missing after {} bytes", bytes.len());
        let mend =
            "copy it again; if the recorder was stopped, write what is left to a new file: mcap recover";
        findings.push(wrong(FindingKind::Unreadable, what, mend));
        return None;
    }
    let topics = match guarded(|| topics(bytes)).and_then(|done| done) {
        Ok(topics) => topics,
        Err(e) => {
            let what = format!("no MCAP that can be read: {e}");
            findings.push(wrong(FindingKind::Unreadable, what, "record it again, or try mcap recover"));
            return None;
        }
    };
    let skipped: Vec<String> = topics.values().flat_map(|t| t.skipped.iter().cloned()).collect();
    let read: Vec<Topic> = topics.into_values().filter(|t| !t.columns.is_empty()).collect();
    if read.is_empty() {
        let what = match skipped.is_empty() {
            true => "no topic has a message with numbers".to_owned(),
            false => skipped.join("; "),
        };
        let mend = "record topics of ROS 2 messages (cdr, with their definitions), JSON or Protobuf";
        findings.push(wrong(FindingKind::EmptyFile, what, mend));
        return None;
    }
    let stamped = read.iter().all(Topic::is_stamped);
    let clock =
        if stamped { "the stamps of the messages" } else { "the times at which messages were logged" };
    let mend = if stamped {
        "nothing, if that is meant"
    } else {
        "stamp all messages (header.stamp), if these times jitter"
    };
    findings.push(Finding::note(FindingKind::TimeUnit, file, format!("the clock is {clock}"), mend));
    Some(ReadTable { skipped, ..table(read, stamped) })
}

fn topics(bytes: &[u8]) -> Result<BTreeMap<String, Topic>, String> {
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    let text = |e: McapError| match std::error::Error::source(&e) {
        Some(cause) => format!("{e} ({cause})"),
        None => e.to_string(),
    };
    for message in MessageStream::new(bytes).map_err(text)? {
        let message = message.map_err(text)?;
        let name = &message.channel.topic;
        if !topics.contains_key(name) {
            topics.insert(name.clone(), Topic::of(&message.channel));
        }
        if let Some(topic) = topics.get_mut(name) {
            topic.add(&message)?;
        }
    }
    Ok(topics)
}

/// One row for each time; a topic that has no message then has no value there.
fn table(topics: Vec<Topic>, stamped: bool) -> ReadTable {
    let mut events: Vec<(i64, usize, usize)> = Vec::new();
    for (of, topic) in topics.iter().enumerate() {
        events.extend(topic.times(stamped).enumerate().map(|(k, t)| (t, of, k)));
    }
    events.sort_by_key(|e| e.0);
    // The row of each message.
    let mut times: Vec<i64> = Vec::new();
    let mut rows: Vec<Vec<usize>> = topics.iter().map(|t| vec![0; t.len()]).collect();
    let mut last: Vec<Option<usize>> = vec![None; topics.len()];
    for (t, of, k) in events {
        let taken = times.last() == Some(&t) && last[of] != Some(times.len() - 1);
        if !taken {
            times.push(t);
        }
        last[of] = Some(times.len() - 1);
        rows[of][k] = times.len() - 1;
    }
    let of_epoch = times.first().is_some_and(|t| *t >= EPOCH);
    let seconds = times.iter().map(|t| *t as f64 / PER_SECOND).collect();
    let counts = times.iter().map(|t| Some(*t)).collect();
    let ticks = Some(ClockTicks { counts, per_second: PER_SECOND, of_epoch });
    let mut table = ReadTable::default();
    table.columns.push(TableColumn { ticks, ..TableColumn::numbers("time", seconds) });
    for (topic, rows) in topics.into_iter().zip(&rows) {
        for column in topic.columns {
            let mut values = vec![f64::NAN; times.len()];
            column.values.iter().zip(rows).for_each(|(x, row)| values[*row] = *x);
            table
                .columns
                .push(TableColumn { label: column.label, ..TableColumn::numbers(column.name, values) });
        }
    }
    table
}
