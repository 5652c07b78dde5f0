//! Libraries of macOS: signed again after they were changed, joined to one file.
//!
//! Apple silicon loads nothing without a signature. The linker writes one without a name ("ad hoc"): a hash of each page of
//! the file. What was changed leaves its size, so the hashes alone are written again, in place.

use object::Endianness;
use object::macho;
use object::read::macho::{LoadCommandVariant, MachHeader, MachOFile64};
use sha2::{Digest, Sha256};

const SUPER_BLOB: u32 = 0xfade_0cc0;
const CODE_DIRECTORY: u32 = 0xfade_0c02;
/// Signatures with a certificate.
const CMS: u32 = 0xfade_0b01;
/// `hashType` of SHA-256.
const SHA_256: u8 = 2;

/// Writes the hashes of an ad-hoc signature again; a library for Intel may be without one.
///
/// # Errors
/// A file that cannot be read; a missing or a certified signature, with the remedy.
pub(crate) fn sign_again(bytes: &mut [u8]) -> Result<(), String> {
    match signature(bytes)? {
        None => Ok(()),
        Some((start, size)) => {
            let (code, rest) = bytes.split_at_mut_checked(start).ok_or("its signature is beyond its end")?;
            let blob = rest.get_mut(..size).ok_or("its signature is beyond its end")?;
            renew(blob, code)
        }
    }
}

/// Offset and size of the signature.
fn signature(bytes: &[u8]) -> Result<Option<(usize, usize)>, String> {
    let unreadable = |e| format!("it cannot be read: {e}");
    let file = MachOFile64::<Endianness>::parse(bytes).map_err(unreadable)?;
    let endian = file.endian();
    let mut commands = file.macho_load_commands().map_err(unreadable)?;
    while let Some(command) = commands.next().map_err(unreadable)? {
        if let Ok(LoadCommandVariant::LinkeditData(data)) = command.variant()
            && data.cmd.get(endian) == macho::LC_CODE_SIGNATURE
        {
            return Ok(Some((data.dataoff.get(endian) as usize, data.datasize.get(endian) as usize)));
        }
    }
    if file.macho_header().cputype(endian) == macho::CPU_TYPE_ARM64 {
        return Err(
            "it has no signature, which Apple silicon requires: link it with a linker that signs ad hoc"
                .to_owned(),
        );
    }
    Ok(None)
}

fn u32_at(bytes: &[u8], at: usize) -> Result<u32, String> {
    let word = at.checked_add(4).and_then(|end| bytes.get(at..end)).and_then(|b| b.first_chunk::<4>());
    word.map(|b| u32::from_be_bytes(*b)).ok_or_else(|| "its signature is cut off".to_owned())
}

/// Writes the hashes of the pages of `code` into all code directories of `blob`. Numbers in it are big-endian.
fn renew(blob: &mut [u8], code: &[u8]) -> Result<(), String> {
    if u32_at(blob, 0)? != SUPER_BLOB {
        return Err("its signature is of an unknown form".to_owned());
    }
    for i in 0..u32_at(blob, 8)? as usize {
        let start = u32_at(blob, 12 + 8 * i + 4)? as usize;
        let part = blob.get_mut(start..).ok_or("its signature is cut off")?;
        match u32_at(part, 0)? {
            CODE_DIRECTORY => hash_pages(part, code)?,
            // Empty in an ad-hoc signature.
            CMS if u32_at(part, 4)? > 8 => {
                return Err(
                    "it is signed with a certificate: take the library as the linker left it".to_owned()
                );
            }
            _ => {}
        }
    }
    Ok(())
}

/// The code directory: `hashOffset` at byte 16, `nCodeSlots` at 28, `codeLimit` at 32, then one byte each `hashSize`, `hashType`,
/// platform, log2 of the page size.
fn hash_pages(directory: &mut [u8], code: &[u8]) -> Result<(), String> {
    let (first, slots, limit) = (u32_at(directory, 16)?, u32_at(directory, 28)?, u32_at(directory, 32)?);
    let form = directory.get(36..40).and_then(|b| b.first_chunk::<4>()).copied();
    let Some([32, SHA_256, _, page @ 1..31]) = form else {
        return Err("its signature hashes in another way than by SHA-256".to_owned());
    };
    let code = code.get(..limit as usize).ok_or("its signature is for a longer file")?;
    let pages = code.chunks(1 << page);
    if pages.len() != slots as usize {
        return Err("its signature has not one hash for each page".to_owned());
    }
    for (k, page) in pages.enumerate() {
        let slot = directory.get_mut(first as usize + 32 * k..).and_then(|s| s.get_mut(..32));
        slot.ok_or("its signature is cut off")?.copy_from_slice(&Sha256::digest(page));
    }
    Ok(())
}

/// Offsets of the libraries in a file of several are multiples of it, given as its logarithm.
const ALIGNMENT: u32 = 14;

/// Libraries for several processors as one file; one alone stays as it is. In its head, big-endian: a magic number and how many;
/// for each of them processor, its kind, offset, size, alignment.
pub(crate) fn universal(mut libraries: Vec<Vec<u8>>) -> Vec<u8> {
    if libraries.len() == 1 {
        return libraries.remove(0);
    }
    let aligned = |n: usize| n.next_multiple_of(1 << ALIGNMENT);
    let mut head = Vec::new();
    let mut body = Vec::new();
    let words = |out: &mut Vec<u8>, words: &[u32]| out.extend(words.iter().flat_map(|w| w.to_be_bytes()));
    words(&mut head, &[macho::FAT_MAGIC, libraries.len() as u32]);
    let begin = aligned(8 + 20 * libraries.len());
    for library in &libraries {
        body.resize(aligned(body.len()), 0);
        // Bytes 4 to 11 of a library, there little-endian.
        head.extend(library.iter().skip(4).take(4).rev());
        head.extend(library.iter().skip(8).take(4).rev());
        words(&mut head, &[(begin + body.len()) as u32, library.len() as u32, ALIGNMENT]);
        body.extend(library);
    }
    head.resize(begin, 0);
    head.extend(body);
    head
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: usize = 1 << 12;

    /// A signature of one code directory for `code`, its hashes zero.
    fn blob(code: &[u8]) -> Vec<u8> {
        let slots = code.len().div_ceil(PAGE);
        let size = 44 + 32 * slots;
        let words = [SUPER_BLOB, 20 + size as u32, 1, 0, 20];
        let directory = [CODE_DIRECTORY, size as u32, 0x20400, 2, 44, 0, 0, slots as u32, code.len() as u32];
        let mut blob: Vec<u8> = words.iter().chain(&directory).flat_map(|w| w.to_be_bytes()).collect();
        blob.extend([32, SHA_256, 0, 12, 0, 0, 0, 0]);
        blob.resize(20 + size, 0);
        blob
    }

    #[test]
    fn every_page_gets_its_hash_and_nothing_else_changes() {
        let code: Vec<u8> = (0..2 * PAGE + 100).map(|i| (i / 7) as u8).collect();
        let unsigned = blob(&code);
        let mut signed = unsigned.clone();
        renew(&mut signed, &code).unwrap();
        assert_eq!(signed[..64], unsigned[..64]);
        for (k, page) in [&code[..PAGE], &code[PAGE..2 * PAGE], &code[2 * PAGE..]].iter().enumerate() {
            assert_eq!(signed[64 + 32 * k..][..32], Sha256::digest(page)[..], "page {k}");
        }
    }

    #[test]
    fn what_cannot_be_signed_again_is_refused() {
        let code = vec![1; PAGE];
        let refused = |change: &dyn Fn(&mut Vec<u8>), code: &[u8]| {
            let mut blob = blob(&[1; PAGE]);
            change(&mut blob);
            renew(&mut blob, code).unwrap_err()
        };
        assert!(refused(&|b| b[57] = 1, &code).contains("SHA-256"));
        assert!(refused(&|b| b[0] = 0, &code).contains("unknown form"));
        assert!(refused(&|b| b.truncate(80), &code).contains("cut off"));
        assert!(refused(&|_| {}, &code[..10]).contains("longer file"));
        // Of a certificate, behind the rest.
        let with_certificate = |b: &mut Vec<u8>| {
            b[19] = b.len() as u8;
            b.extend([CMS, 100].iter().flat_map(|w| w.to_be_bytes()));
        };
        assert!(refused(&with_certificate, &code).contains("certificate"));
        assert!(sign_again(&mut b"no library".to_vec()).is_err());
    }

    #[test]
    fn several_libraries_lie_aligned_in_one_file() {
        let library =
            |kind: u8| [&[0xcf, 0xfa, 0xed, 0xfe, kind, 0, 0, 1, 3, 0, 0, 0][..], &[kind; 30]].concat();
        let (arm, intel) = (library(12), library(7));
        assert_eq!(universal(vec![arm.clone()]), arm);
        let both = universal(vec![arm.clone(), intel.clone()]);
        assert_eq!(both[..16], [0xca, 0xfe, 0xba, 0xbe, 0, 0, 0, 2, 1, 0, 0, 12, 0, 0, 0, 3]);
        assert_eq!(both[1 << 14..][..arm.len()], arm[..]);
        assert_eq!(both[2 << 14..], intel[..]);
        assert_eq!(both[28..40], [1, 0, 0, 7, 0, 0, 0, 3, 0, 0, 0x80, 0]);
    }
}
