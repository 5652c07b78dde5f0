//! Damaged files: valid ones with bytes changed, cut out, put in. Whatever comes out, it is an answer: never a panic, and never
//! memory beyond what the file could hold.

use std::fs;
use std::path::Path;

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::common::joint;
use trueup_signals::{Case, SignalsError, check};

/// Of each file in the plain run; all with `--ignored`.
const FEW: usize = 40;
const ALL: usize = 2000;
/// Peak memory of the whole process that none of them may pass.
const MEMORY: u64 = 1 << 30;

const CSV: &str =
    "time,motorCurrent,motorAngle,loadAngle\n0,0,0,0\n0.01,1,0.1,1e-3\n0.02,,nan,2e-3\n0.03,1,0.3,3e-3\n";
const CASE: &str = "model = \"TwoMassJoint\"\ntrain = [\"run.csv\"]\nholdout = [\"b.csv\"]\nrepeats = [[\"run.csv\", \"b.csv\"]]\n\
    [parameters]\nstiffness = 3.07e-5\n[uncertain]\nstiffness = 0.1\n[fit]\nparameters = [\"stiffness\"]\n\
    [channels.motorAngle]\nnoise = 1e-3\nresolution = 0.01\ndelay = 0.01\noffset = \"estimate\"\ninterpolation = \"hold\"\n";
const SIDECAR: &str = "[columns]\nmotorAngle = { variable = \"motorAngle\", scale = 0.5, offset = 1.0, unit = \"deg\" }\n\
    loadAngle = \"loadAngle\"\n[channels.motorAngle]\nnoise = 1e-3\n[parameters]\ninitialMotorAngle = 0.1\n";

fn mutate(bytes: &[u8], rng: &mut StdRng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..rng.random_range(1..=4) {
        if bytes.is_empty() {
            break;
        }
        let at = rng.random_range(0..bytes.len());
        let end = (at + rng.random_range(1..=16)).min(bytes.len());
        match rng.random_range(0..8) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes[at] = rng.random(),
            2 => bytes[at..end].fill(0xff),
            3 => bytes[at..end].fill(0),
            4 => bytes.truncate(at),
            5 => drop(bytes.drain(at..end)),
            6 => {
                let part = bytes[at..end].to_vec();
                let to = rng.random_range(0..=bytes.len());
                bytes.splice(to..to, part);
            }
            _ => {
                let extremes = b"-,.\"[]{}=\n\xff\x00e9";
                bytes[at] = extremes[rng.random_range(0..extremes.len())];
            }
        }
    }
    bytes
}

/// Reads a case as a program does; every message names a file and has a remedy.
fn look(folder: &Path) -> bool {
    let known = joint();
    match Case::load(folder, |_| Ok(known.clone())) {
        Ok((loaded, _)) => {
            check::case(&loaded, &known, &[]);
            true
        }
        Err(SignalsError::Wrong(findings)) => {
            let errors: Vec<_> = findings.iter().filter(|f| f.is_error()).collect();
            assert!(!errors.is_empty());
            for f in errors {
                assert!(!f.mend.is_empty() && f.file.starts_with(folder), "{f}");
            }
            false
        }
        Err(other) => panic!("{other}"),
    }
}

/// So many mutants of one file of a case whose others are whole.
fn survive(name: &str, valid: &[u8], count: usize) {
    let recording = if name.ends_with(".toml") { "run.csv" } else { name };
    let case = CASE.replace("run.csv", recording);
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    write(recording, CSV.as_bytes());
    write("b.csv", CSV.replace("0.1", "0.2").as_bytes());
    write("case.toml", case.as_bytes());
    write(name, valid);
    assert!(look(folder.path()), "the valid {name} is refused");
    let mut rng = StdRng::seed_from_u64(name.bytes().map(u64::from).sum());
    let (mut read, mut refused) = (0, 0);
    for _ in 0..count {
        write(name, &mutate(valid, &mut rng));
        if look(folder.path()) { read += 1 } else { refused += 1 }
    }
    println!("{name}: {read} read, {refused} refused");
    assert!(refused > 0, "{name}: no mutant was refused, so they were no mutants");
    if let Some(peak) = peak() {
        assert!(peak < MEMORY, "{name}: {peak} bytes at most");
    }
}

/// Peak resident memory of this process, where the system reports it.
fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}

fn all(count: usize) {
    let v73 = include_bytes!("files/v73.mat");
    let (v5, v7) = (include_bytes!("files/v5.mat"), include_bytes!("files/v7.mat"));
    let (plain, dictionary) =
        (include_bytes!("files/plain.parquet"), include_bytes!("files/dictionary.parquet"));
    let files: [(&str, &[u8]); 8] = [
        ("run.csv", CSV.as_bytes()),
        ("case.toml", CASE.as_bytes()),
        ("run.toml", SIDECAR.as_bytes()),
        ("plain.parquet", plain),
        ("dictionary.parquet", dictionary),
        ("v5.mat", v5),
        ("v7.mat", v7),
        ("v73.mat", v73),
    ];
    files.iter().for_each(|(name, valid)| survive(name, valid, count));
}

#[test]
fn some_damaged_files_get_an_answer() {
    all(FEW);
}

#[test]
#[ignore = "2,000 mutants a reader"]
fn damaged_files_get_an_answer() {
    all(ALL);
}
