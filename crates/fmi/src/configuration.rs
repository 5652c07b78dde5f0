//! What the packer writes into a copy of a library to make it one particular FMU.
//!
//! The library carries a block of [`BLOCK_SIZE`] bytes that begins with [`MARKER`]; the packer finds it and
//! writes the configuration behind the marker. So an FMU contains its model, structure, effects and start
//! values without its resources folder, which importers may leave out (FMI 3.0 allows a NULL path).
//! The last [`STAMP_SIZE`] bytes are the digest of the library's sources. Decision 0003 gives the reasons.

use std::fmt::Write as _;

/// Size of the block in bytes, marker included.
pub const BLOCK_SIZE: usize = 64 * 1024;
/// Bytes at the end of the block for the [`stamp`].
pub const STAMP_SIZE: usize = 64;
/// First bytes of the block.
pub const MARKER: &[u8; 32] = b"TRUEUP-FMU-CONFIGURATION-BLOCK:\n";

/// The block of a library that was not packed: marker, text (in tests), stamp.
pub const fn template(text: &str, stamp: &str) -> [u8; BLOCK_SIZE] {
    const fn put(block: &mut [u8; BLOCK_SIZE], at: usize, bytes: &[u8]) {
        let mut i = 0;
        while i < bytes.len() {
            block[at + i] = bytes[i];
            i += 1;
        }
    }
    let mut block = [0; BLOCK_SIZE];
    put(&mut block, 0, MARKER);
    put(&mut block, MARKER.len(), text.as_bytes());
    put(&mut block, BLOCK_SIZE - STAMP_SIZE, stamp.as_bytes());
    block
}

/// From which sources a library was built, by its block.
pub fn stamp(block: &[u8; BLOCK_SIZE]) -> String {
    let stamp = &block[BLOCK_SIZE - STAMP_SIZE..];
    String::from_utf8_lossy(stamp).trim_end_matches('\0').to_owned()
}

/// A packed model: what is fixed when packed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Configuration {
    /// By its name, as `TwoMassJoint`.
    pub model: String,
    /// GUID (FMI 2.0) and instantiation token (FMI 3.0).
    pub token: String,
    /// Which joints are flexible, one entry per joint; empty: the model's default. Its length is the
    /// number of joints.
    pub joint_flexible: Vec<bool>,
    /// Whole numbers that fix the structure beyond that, by name (`parent`: 0, 1, 2); empty: the model's default.
    pub structure: Vec<(String, Vec<u32>)>,
    /// Ids of the effects packed in, in the order of the library.
    pub effects: Vec<String>,
    /// Start values other than the model's own: element name (`linkMass[1]`) and value.
    pub start: Vec<(String, f64)>,
}

/// A configuration block that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ConfigurationError {
    /// The block has no configuration: the library was not packed.
    NotPacked,
    /// A line that is not understood.
    Line(String),
    /// Larger than the block: by so many bytes.
    TooLarge(usize),
}

impl std::fmt::Display for ConfigurationError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotPacked => {
                write!(f, "this library is a template and no FMU: pack it with `trueup fmu pack`")
            }
            Self::Line(l) => write!(
                f,
                "the configuration in this library has a line that is not understood: {l:?}; pack it again"
            ),
            Self::TooLarge(n) => {
                write!(f, "the configuration is {n} bytes too large: give fewer start values")
            }
        }
    }
}
impl std::error::Error for ConfigurationError {}

impl Configuration {
    /// The model as it is by default.
    pub fn of(model: &str) -> Self {
        Self { model: model.to_owned(), ..Self::default() }
    }
    /// As text: one `key value` per line, doubles so that they read back bit-equal.
    pub fn to_text(&self) -> String {
        let mut s = String::new();
        let _ = writeln!(s, "model {}", self.model);
        let _ = writeln!(s, "token {}", self.token);
        for f in &self.joint_flexible {
            let _ = writeln!(s, "joint {}", if *f { "flexible" } else { "rigid" });
        }
        for (name, values) in &self.structure {
            let _ = write!(s, "structure {name}");
            values.iter().for_each(|v| {
                let _ = write!(s, " {v}");
            });
            s.push('\n');
        }
        for e in &self.effects {
            let _ = writeln!(s, "effect {e}");
        }
        for (name, value) in &self.start {
            let _ = writeln!(s, "start {name} {value:?}");
        }
        s
    }
    /// From text.
    pub fn from_text(text: &str) -> Result<Self, ConfigurationError> {
        let mut c = Self::default();
        for line in text.lines() {
            let wrong = || ConfigurationError::Line(line.to_owned());
            let (key, rest) = line.split_once(' ').ok_or_else(wrong)?;
            match key {
                "model" => c.model = rest.to_owned(),
                "token" => c.token = rest.to_owned(),
                "joint" if rest == "flexible" => c.joint_flexible.push(true),
                "joint" if rest == "rigid" => c.joint_flexible.push(false),
                "structure" => {
                    let mut words = rest.split(' ');
                    let name = words.next().unwrap_or_default().to_owned();
                    let values = words.map(|w| w.parse().map_err(|_| wrong())).collect::<Result<_, _>>()?;
                    c.structure.push((name, values));
                }
                "effect" => c.effects.push(rest.to_owned()),
                "start" => {
                    let (name, value) = rest.rsplit_once(' ').ok_or_else(wrong)?;
                    c.start.push((name.to_owned(), value.parse().map_err(|_| wrong())?));
                }
                _ => return Err(wrong()),
            }
        }
        if c.model.is_empty() { Err(ConfigurationError::NotPacked) } else { Ok(c) }
    }
    /// From a library's block (marker included): the text ends at the first zero byte.
    pub fn from_block(block: &[u8]) -> Result<Self, ConfigurationError> {
        let text = block.get(MARKER.len()..).unwrap_or_default();
        let end = text.iter().position(|b| *b == 0).unwrap_or(text.len());
        if end == 0 {
            return Err(ConfigurationError::NotPacked);
        }
        let text = core::str::from_utf8(&text[..end]).map_err(|e| ConfigurationError::Line(e.to_string()))?;
        Self::from_text(text)
    }
    /// Writes it into a library's block, whose stamp stays.
    pub fn write(&self, block: &mut [u8; BLOCK_SIZE]) -> Result<(), ConfigurationError> {
        let text = self.to_text();
        // A zero ends the text.
        let room = BLOCK_SIZE - STAMP_SIZE - MARKER.len() - 1;
        if text.len() > room {
            return Err(ConfigurationError::TooLarge(text.len() - room));
        }
        block[MARKER.len()..BLOCK_SIZE - STAMP_SIZE].fill(0);
        block[MARKER.len()..][..text.len()].copy_from_slice(text.as_bytes());
        Ok(())
    }
}
