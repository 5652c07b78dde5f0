//! The schema that Arrow's writers (pandas, Polars) put next to a Parquet file's own: it alone marks the integers that are durations.
//!
//! A FlatBuffer of the format's `Message.fbs` and `Schema.fbs`, in base64 under `ARROW:schema`. The crates that read all of Arrow
//! would be interpreted as one number of it.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// In the union `Type`.
const DURATION: u8 = 18;

/// Columns that are durations: their names, and how many counts of them are a second. What cannot be understood names none.
pub(super) fn durations(schema: &str) -> Vec<(String, f64)> {
    let Ok(bytes) = STANDARD.decode(schema) else { return Vec::new() };
    fields(&ArrowBuffer(&bytes)).unwrap_or_default()
}

fn fields(buffer: &ArrowBuffer) -> Option<Vec<(String, f64)>> {
    // A mark of four bytes and the length precede the message, of old files the length alone.
    let begin = if buffer.u32(0)? == u32::MAX { 8 } else { 4 };
    let message = FlatTable { buffer, at: buffer.follow(begin)? };
    let list = message.table(2)?.vector(1)?;
    let field = |k: u32| {
        let field = FlatTable { buffer, at: buffer.follow(list.0 + 4 * k as usize)? };
        if buffer.byte(field.slot(2)?)? != DURATION {
            return None;
        }
        // The unit's default is a millisecond.
        let unit = field.table(3)?.slot(0).map_or(Some(1), |at| buffer.u16(at))?;
        let per_second = [1.0, 1e3, 1e6, 1e9].get(usize::from(unit))?;
        Some((field.text(0)?, *per_second))
    };
    Some((0..list.1.min(1 << 16)).filter_map(field).collect())
}

struct ArrowBuffer<'a>(&'a [u8]);

impl ArrowBuffer<'_> {
    fn byte(&self, at: usize) -> Option<u8> {
        self.0.get(at).copied()
    }
    fn u16(&self, at: usize) -> Option<u16> {
        Some(u16::from_le_bytes(self.0.get(at..at.checked_add(2)?)?.try_into().ok()?))
    }
    fn u32(&self, at: usize) -> Option<u32> {
        Some(u32::from_le_bytes(self.0.get(at..at.checked_add(4)?)?.try_into().ok()?))
    }
    /// The target of the offset that is here.
    fn follow(&self, at: usize) -> Option<usize> {
        at.checked_add(self.u32(at)? as usize)
    }
}

struct FlatTable<'a> {
    buffer: &'a ArrowBuffer<'a>,
    at: usize,
}

impl<'a> FlatTable<'a> {
    /// Where a field is; none: it has its default.
    fn slot(&self, field: usize) -> Option<usize> {
        let back = self.buffer.u32(self.at)?.cast_signed();
        let list = usize::try_from(i64::try_from(self.at).ok()? - i64::from(back)).ok()?;
        let entry = 4 + 2 * field;
        let offset =
            if entry < usize::from(self.buffer.u16(list)?) { self.buffer.u16(list + entry)? } else { 0 };
        (offset != 0).then(|| self.at + usize::from(offset))
    }
    fn table(&self, field: usize) -> Option<Self> {
        Some(Self { buffer: self.buffer, at: self.buffer.follow(self.slot(field)?)? })
    }
    /// Where the elements begin, and how many there are.
    fn vector(&self, field: usize) -> Option<(usize, u32)> {
        let at = self.buffer.follow(self.slot(field)?)?;
        Some((at + 4, self.buffer.u32(at)?))
    }
    fn text(&self, field: usize) -> Option<String> {
        let (at, length) = self.vector(field)?;
        let bytes = self.buffer.0.get(at..at.checked_add(length as usize)?)?;
        String::from_utf8(bytes.to_vec()).ok()
    }
}
