//! Times of a calendar: ISO dates and Unix times, counted from the first row.

use chrono::{DateTime, NaiveDateTime};

use crate::read::table::{ClockTicks, TableColumn};

const NANO: f64 = 1e9;

/// Unix times since September 2001, in each unit in which they are counted: the ranges do not meet, and no clock of a rig that
/// counts in s runs for as long as the first of them (31 years).
const EPOCHS: [(f64, &str, i128); 4] =
    [(1e9, "s", 1_000_000_000), (1e12, "ms", 1_000_000), (1e15, "us", 1_000), (1e18, "ns", 1)];

/// The date and time in a cell, in ns since the beginning of 1970; without a zone it is taken as UTC.
fn date(text: &str) -> Option<i64> {
    let text = text.replace(',', ".");
    let zoned = ["%+", "%Y-%m-%d %H:%M:%S%.f%:z", "%Y-%m-%d %H:%M:%S%.f %z"];
    if let Some(t) = zoned.iter().find_map(|f| DateTime::parse_from_str(&text, f).ok()) {
        return t.timestamp_nanos_opt();
    }
    let plain = ["%Y-%m-%dT%H:%M:%S%.f", "%Y-%m-%d %H:%M:%S%.f"];
    let t = plain.iter().find_map(|f| NaiveDateTime::parse_from_str(&text, f).ok())?;
    t.and_utc().timestamp_nanos_opt()
}

/// A column of dates.
///
/// # Errors
/// The first row whose cell is no date.
pub(super) fn dates(column: &TableColumn) -> Result<ClockTicks, usize> {
    let mut counts = Vec::with_capacity(column.texts.len());
    for (row, text) in column.texts.iter().enumerate() {
        counts.push(match text.as_str() {
            "" => None,
            text => Some(date(text).ok_or(row)?),
        });
    }
    Ok(ClockTicks { counts, per_second: NANO, of_epoch: true })
}

/// A column of Unix times with the unit they are in; `unit` is how many s one of its counts is, where that is known.
pub(super) fn unix(column: &TableColumn, unit: Option<f64>) -> Option<(ClockTicks, String)> {
    let first = *column.values.iter().find(|t| t.is_finite())?;
    let (_, name, nanos) = match unit {
        None => *EPOCHS.iter().find(|(from, ..)| (*from..*from * 10.0).contains(&first))?,
        Some(unit) if (1e9..1e10).contains(&(first * unit)) => (0.0, "", (unit * NANO).round() as i128),
        Some(_) => return None,
    };
    let count = |(row, value): (usize, &f64)| {
        let written = column.texts.get(row).and_then(|text| decimal(text, nanos));
        written.or_else(|| value.is_finite().then(|| (value * nanos as f64).round() as i64))
    };
    let counts = column.values.iter().enumerate().map(count).collect();
    Some((ClockTicks { counts, per_second: NANO, of_epoch: true }, name.to_owned()))
}

/// A number as it is written, times this, to the digit: a double has no room for the nanoseconds of a Unix time.
fn decimal(text: &str, times: i128) -> Option<i64> {
    let text = text.replace(',', ".");
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    if whole.is_empty() || !(whole.to_owned() + fraction).bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let mut count = whole.parse::<i128>().ok()?.checked_mul(times)?;
    let mut place = times;
    for digit in fraction.bytes() {
        place /= 10;
        count += place * i128::from(digit - b'0');
    }
    i64::try_from(count).ok()
}

impl ClockTicks {
    /// Times in s from the first of them; `NaN` where there is none.
    pub(super) fn since_first(&self) -> Vec<f64> {
        let first = self.counts.iter().flatten().next().copied().unwrap_or(0);
        let seconds = |n: &Option<i64>| n.map_or(f64::NAN, |n| (i128::from(n) - i128::from(first)) as f64);
        self.counts.iter().map(|n| seconds(n) / self.per_second).collect()
    }

    /// The first, in s since the beginning of 1970, and as a date.
    pub(super) fn first(&self) -> Option<(f64, String)> {
        let seconds = *self.counts.iter().flatten().next()? as f64 / self.per_second;
        let nanos = (seconds.fract() * NANO) as u32;
        let date = DateTime::from_timestamp(seconds.floor() as i64, nanos)?;
        Some((seconds, date.format("%Y-%m-%dT%H:%M:%S%.3fZ").to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_read_in_every_form_that_loggers_write() {
        let t = 1_709_294_400_123_000_000;
        for text in [
            "2024-03-01T12:00:00.123Z",
            "2024-03-01 12:00:00.123",
            "2024-03-01T12:00:00,123",
            "2024-03-01T13:00:00.123+01:00",
            "2024-03-01 13:00:00.123+01:00",
            "2024-03-01 11:30:00.123 -0030",
        ] {
            assert_eq!(date(text), Some(t), "{text}");
        }
        for text in ["2024-13-01T12:00:00Z", "01.03.2024 12:00", "12", "soon"] {
            assert_eq!(date(text), None, "{text}");
        }
    }

    #[test]
    fn unix_times_lose_no_digit() {
        let column = |texts: [&str; 2]| TableColumn {
            texts: texts.map(str::to_owned).to_vec(),
            ..TableColumn::numbers("time", texts.iter().map(|t| t.parse().unwrap()).collect())
        };
        for (texts, unit) in [
            (["1709294400.123456789", "1709294400.123456790"], "s"),
            (["1709294400123.456789", "1709294400123.456790"], "ms"),
            (["1709294400123456.789", "1709294400123456.790"], "us"),
            (["1709294400123456789", "1709294400123456790"], "ns"),
        ] {
            let (ticks, said) = unix(&column(texts), None).unwrap();
            assert_eq!((ticks.since_first(), said.as_str()), (vec![0.0, 1e-9], unit), "{texts:?}");
        }
        assert!(unix(&column(["0", "1709294400"]), None).is_none());
        assert!(unix(&column(["86400", "86401"]), None).is_none());
    }
}
