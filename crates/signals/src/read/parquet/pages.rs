//! Sizes that the pages of a Parquet column claim, looked at before any of them is given memory.

/// What Snappy at most makes of a byte is 22.
const EXPANDS: u64 = 64;
/// zstd and gzip make any number of bytes of a few: a page may claim so much at least. Writers make pages of about a megabyte.
const PAGE: u64 = 64 << 20;

/// Whether what the headers of a column chunk's pages announce can be in them.
///
/// # Errors
/// What cannot be.
pub(super) fn check(chunk: &[u8]) -> Result<(), String> {
    let mut at = 0;
    while at < chunk.len() {
        let mut header = PageReader { bytes: &chunk[at..], at: 0 };
        let [unpacked, packed] = header
            .page()
            .ok_or_else(|| format!("the header of a page at byte {at} of a column is damaged"))?;
        if unpacked > packed.saturating_mul(EXPANDS).max(PAGE) {
            return Err(format!("a page of {packed} bytes claims to hold {unpacked}"));
        }
        let packed = usize::try_from(packed).unwrap_or(usize::MAX);
        at = at.saturating_add(header.at).saturating_add(packed);
    }
    Ok(())
}

/// Thrift's compact protocol, as far as a page's header needs it.
struct PageReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

/// Structures within structures.
const DEEPEST: usize = 16;

impl PageReader<'_> {
    /// Unpacked and packed size of the page.
    fn page(&mut self) -> Option<[u64; 2]> {
        let (mut id, mut sizes) = (0_i64, [None, None]);
        while let Some((delta, kind)) = self.field()? {
            id = if delta == 0 { self.zigzag()? } else { id + delta };
            match (id, kind) {
                (2 | 3, 5) => sizes[usize::from(id == 3)] = Some(u64::try_from(self.zigzag()?).ok()?),
                _ => self.skip(kind, 0)?,
            }
        }
        Some([sizes[0]?, sizes[1]?])
    }

    fn byte(&mut self) -> Option<u8> {
        let byte = *self.bytes.get(self.at)?;
        self.at += 1;
        Some(byte)
    }

    fn pass(&mut self, n: u64) -> Option<()> {
        self.at = self.at.checked_add(usize::try_from(n).ok()?).filter(|at| *at <= self.bytes.len())?;
        Some(())
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    fn zigzag(&mut self) -> Option<i64> {
        let n = self.varint()?;
        Some((n >> 1) as i64 ^ -((n & 1) as i64))
    }

    /// Step of the id and type of the next field; none at the end of the structure.
    fn field(&mut self) -> Option<Option<(i64, u8)>> {
        let byte = self.byte()?;
        Some((byte != 0).then_some((i64::from(byte >> 4), byte & 0x0f)))
    }

    fn skip(&mut self, kind: u8, depth: usize) -> Option<()> {
        if depth > DEEPEST {
            return None;
        }
        match kind {
            1 | 2 => Some(()),
            3 => self.pass(1),
            4..=6 => self.varint().map(drop),
            7 => self.pass(8),
            8 => {
                let n = self.varint()?;
                self.pass(n)
            }
            9 | 10 => {
                let head = self.byte()?;
                let n = if head >> 4 == 15 { self.varint()? } else { u64::from(head >> 4) };
                // A truth value in a list has a byte of its own.
                let kind = if matches!(head & 0x0f, 1 | 2) { 3 } else { head & 0x0f };
                (0..n).try_for_each(|_| self.skip(kind, depth + 1))
            }
            12 => {
                while let Some((delta, kind)) = self.field()? {
                    if delta == 0 {
                        self.zigzag()?;
                    }
                    self.skip(kind, depth + 1)?;
                }
                Some(())
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// type 0, unpacked, packed, a structure with a number, the end; then `packed` bytes.
    fn page(unpacked: u8, packed: u8) -> Vec<u8> {
        let mut bytes = vec![0x15, 0, 0x15, 2 * unpacked, 0x15, 2 * packed, 0x2c, 0x15, 8, 0, 0];
        bytes.resize(bytes.len() + usize::from(packed), 7);
        bytes
    }

    #[test]
    fn pages_that_claim_too_much_are_told() {
        assert_eq!(check(&[page(40, 20), page(20, 20)].concat()), Ok(()));
        // 2^31 - 1 bytes out of 4.
        let bomb = [0x15, 0, 0x15, 0xfe, 0xff, 0xff, 0xff, 0x0f, 0x15, 8, 0, 1, 2, 3, 4];
        assert!(check(&bomb).unwrap_err().contains("a page of 4 bytes claims to hold 2147483647"));
        assert!(check(&[0x15, 0, 0x15]).unwrap_err().contains("damaged"));
    }
}
