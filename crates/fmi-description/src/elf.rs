//! Shared libraries of Linux that must not be loaded: one that is cut off ends the process that loads it (SIGBUS).

use std::fs::File;
use std::path::Path;

use object::read::elf::{FileHeader, ProgramHeader};
use object::{Endianness, ReadCache, elf};

/// Why this library must not be loaded; `None`: the loader may try. Reads its headers alone.
pub fn unfit(path: &Path) -> Option<String> {
    let file = File::open(path).ok()?;
    let ends = file.metadata().ok()?.len();
    let data = ReadCache::new(file);
    let header = elf::FileHeader64::<Endianness>::parse(&data).ok()?;
    let endian = header.endian().ok()?;
    let machine = header.e_machine(endian);
    let (own, name) = match std::env::consts::ARCH {
        "x86_64" => (elf::EM_X86_64, "x86_64"),
        "aarch64" => (elf::EM_AARCH64, "aarch64"),
        _ => (machine, ""),
    };
    if machine != own {
        return Some(format!("it is made for another processor ({machine:?}), this is {name}"));
    }
    let cut = || format!("it is cut off after {ends} bytes; copy or build the FMU again");
    let Ok(segments) = header.program_headers(endian, &data) else { return Some(cut()) };
    let reaches = segments.iter().map(|s| s.p_offset(endian).saturating_add(s.p_filesz(endian))).max()?;
    (reaches > ends).then(cut)
}
