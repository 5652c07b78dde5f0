//! What is wrong with a recording or a case, where, and the remedy.

use std::fmt;
use std::path::{Path, PathBuf};

/// Errors of one kind that are reported one by one; the rest is counted.
pub(crate) const MAX_REPORTED: usize = 5;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Good to know.
    Note,
    /// A result may be wrong.
    Warning,
    /// A recording does not mean what it seems to mean: a wrong unit, sign or clock, an unrecorded drive. Figures
    /// are reported, no verdict is based on them.
    Grave,
    /// Nothing is fitted before it is corrected.
    Error,
}

impl Severity {
    /// A stable name.
    pub fn id(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Grave => "grave",
            Self::Error => "error",
        }
    }
}

/// Kinds of findings; [`FindingKind::id`] is what a machine reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)] // the names are enough
pub enum FindingKind {
    Unreadable,
    Encoding,
    Separator,
    Comment,
    EmptyFile,
    NoHeader,
    RaggedRow,
    NotANumber,
    ArrayCell,
    DuplicateName,
    NoTime,
    MissingTime,
    ClockBack,
    ClockRepeats,
    Jump,
    TimeSpan,
    TimeUnit,
    InfiniteValue,
    NoValue,
    UnknownColumn,
    UnknownChannel,
    UnknownParameter,
    UnknownModel,
    UnknownKey,
    Syntax,
    BadValue,
    Unit,
    UnitSuspicion,
    Skipped,
    Constant,
    Clipped,
    Stuck,
    Spike,
    Dropout,
    Quantisation,
    DuplicateChannel,
    SwappedChannels,
    Inconsistent,
    GearRatio,
    DeadChannel,
    NoInput,
    NoOutput,
    MissingInput,
    InputShort,
    InputOffset,
    TooShort,
    LittleExcitation,
    MissingFile,
    NoTraining,
    HoldoutInTrain,
    SameRecording,
    RepeatDiffers,
    NotAtRest,
    NoNoise,
}

impl FindingKind {
    /// A stable name, in kebab case: `clock-back`.
    pub fn id(self) -> String {
        let mut id = String::new();
        for c in format!("{self:?}").chars() {
            if c.is_ascii_uppercase() && !id.is_empty() {
                id.push('-');
            }
            id.push(c.to_ascii_lowercase());
        }
        id
    }
}

/// One thing found.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// How bad.
    pub severity: Severity,
    /// What kind.
    pub kind: FindingKind,
    /// In which file.
    pub file: PathBuf,
    /// Its line, from 1.
    pub line: Option<u64>,
    /// The channel or column.
    pub channel: Option<String>,
    /// Time in s, where the recording has one.
    pub time: Option<f64>,
    /// What is wrong, with numbers.
    pub what: String,
    /// What to do.
    pub mend: String,
}

impl Finding {
    /// An error.
    pub fn error(kind: FindingKind, file: &Path, what: impl Into<String>, mend: impl Into<String>) -> Self {
        Self::new(Severity::Error, kind, file, what.into(), mend.into())
    }

    /// A warning.
    pub fn warning(kind: FindingKind, file: &Path, what: impl Into<String>, mend: impl Into<String>) -> Self {
        Self::new(Severity::Warning, kind, file, what.into(), mend.into())
    }

    /// A note.
    pub fn note(kind: FindingKind, file: &Path, what: impl Into<String>, mend: impl Into<String>) -> Self {
        Self::new(Severity::Note, kind, file, what.into(), mend.into())
    }

    fn new(severity: Severity, kind: FindingKind, file: &Path, what: String, mend: String) -> Self {
        Self { severity, kind, file: file.into(), line: None, channel: None, time: None, what, mend }
    }

    /// With the line, from 1.
    pub fn line(mut self, line: impl Into<Option<u64>>) -> Self {
        self.line = line.into();
        self
    }

    /// With the channel or column.
    pub fn channel(mut self, name: impl Into<String>) -> Self {
        self.channel = Some(name.into());
        self
    }

    /// With the time in s.
    pub fn time(mut self, time: f64) -> Self {
        self.time = Some(time);
        self
    }

    /// The message without file and line: `motorAngle at 0.5 s: what; mend`.
    pub fn message(&self) -> String {
        let place = match (&self.channel, self.time) {
            (Some(name), Some(time)) => format!("{name} at {time} s: "),
            (Some(name), None) => format!("{name}: "),
            (None, Some(time)) => format!("at {time} s: "),
            (None, None) => String::new(),
        };
        let mend = if self.mend.is_empty() { String::new() } else { format!("; {}", self.mend) };
        format!("{place}{}{mend}", self.what)
    }

    /// Whether no verdict is based on the recording.
    pub fn is_grave(&self) -> bool {
        self.severity >= Severity::Grave
    }

    /// Whether it keeps a fit from starting.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

impl fmt::Display for Finding {
    /// `run.csv:7: motorAngle at 0.5 s: what; mend`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}", self.message())
    }
}
