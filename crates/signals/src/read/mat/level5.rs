//! MAT files of level 5 (`save -v6`, `-v7`).

use matfile::{MatFile, NumericData};

use super::array::{Array, Contents};

/// Bytes of a file's own header.
pub(super) const HEADER: usize = 128;

/// All variables of a file that is as long as its header at least.
pub(super) fn read(bytes: &[u8]) -> Contents {
    let mut contents = Contents::default();
    for (count, element) in elements(bytes).enumerate() {
        // One by one: a struct or a cell, which the library skips in silence, is reported, and affects no other.
        let mut alone = bytes[..HEADER].to_vec();
        alone.extend_from_slice(element);
        let found = MatFile::parse(alone.as_slice()).ok().and_then(|mat| mat.arrays().first().cloned());
        let array = found.as_ref().and_then(|a| {
            Some(Array { name: a.name().to_owned(), size: a.size().clone(), values: numbers(a.data())? })
        });
        match array {
            Some(array) => contents.arrays.push(array),
            None => contents.skip(&format!("variable {}", count + 1)),
        }
    }
    contents
}

/// The top-level data elements, tags included.
fn elements(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let little = &bytes[126..128] == b"IM";
    let word = move |at: usize| -> Option<u32> {
        let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(if little { u32::from_le_bytes(four) } else { u32::from_be_bytes(four) })
    };
    let mut at = HEADER;
    std::iter::from_fn(move || {
        let (kind, size) = (word(at)?, word(at + 4)? as usize);
        // Compressed ones (15) are not padded.
        let padded = if kind == 15 { size } else { size.checked_next_multiple_of(8)? };
        let end = at.checked_add(8)?.checked_add(padded)?.min(bytes.len());
        let element = &bytes[at..end];
        at = end;
        Some(element)
    })
}

fn numbers(data: &NumericData) -> Option<Vec<f64>> {
    macro_rules! real {
        ($($variant:ident),*) => {
            match data {
                $(NumericData::$variant { real, imag: None } => Some(real.iter().map(|x| *x as f64).collect()),)*
                _ => None,
            }
        };
    }
    real!(Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Single, Double)
}
