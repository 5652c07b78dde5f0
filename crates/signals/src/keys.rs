//! The keys of `case.toml` and of sidecars: the readers know these and no other, docs/cases.md has the same tables.

/// A key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CaseFileKey {
    /// As it is written.
    pub name: &'static str,
    /// Meaning of its value.
    pub meaning: &'static str,
    /// Unit of the value, or what kind of value it is; empty: given by the meaning.
    pub unit: &'static str,
    /// What holds where it is not written.
    pub default: &'static str,
}

/// The keys of one table of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keys {
    /// What has these keys.
    pub of: &'static str,
    /// In the order in which they are listed.
    pub list: &'static [CaseFileKey],
}

impl Keys {
    /// Their names.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + Clone {
        self.list.iter().map(|key| key.name)
    }
}

/// All tables.
pub const ALL: &[Keys] =
    &[CASE, RECORDINGS, EFFECTS, PAYLOAD, PAYLOAD_FIGURE, FIT, CHANNELS, GUESS, SIDECAR, COLUMNS];

const fn key(
    name: &'static str,
    meaning: &'static str,
    unit: &'static str,
    default: &'static str,
) -> CaseFileKey {
    CaseFileKey { name, meaning, unit, default }
}

/// Of `case.toml`.
pub const CASE: Keys = Keys {
    of: "a case",
    list: &[
        key("model", "the model that the recordings are compared with", "name", "must be given"),
        key("train", "recordings that may be fitted", "file names in the folder", "must be given"),
        key(
            "holdout",
            "recordings that are never fitted: the reported figures are of them",
            "file names",
            "none: figures are of `train`, with a note",
        ),
        key(
            "repeats",
            "groups of runs of the same command: their differences are noise, but for what drifts from run to run",
            "lists of file names",
            "none",
        ),
        key("rest", "recordings at rest: what varies in them is noise", "file names", "none"),
        key("parameters", "table: the nominal simulation, see below", "", "the model's own values"),
        key("uncertain", "table: how far these values may be off, see below", "", "none is doubted"),
        key(
            "effects",
            "tables `[effects.ID]`: effects that are there for certain, see below",
            "",
            "the model has none",
        ),
        key("payload", "table: a body that a link of PlanarManipulator carries, see below", "", "none"),
        key("fit", "table: what `identify` estimates, see below", "", "see there"),
        key(
            "channels",
            "tables `[channels.NAME]`: what is known of a sensor, see below",
            "",
            "nothing is known",
        ),
        key("recordings", "table: what holds for the rows of all recordings, see below", "", "none"),
    ],
};

/// Of `[recordings]`.
pub const RECORDINGS: Keys = Keys {
    of: "recordings",
    list: &[key(
        "rate",
        "rows a second: they are evenly spaced, whatever the column `time` shows (a logger whose clock is coarser than its rows)",
        "Hz",
        "the column `time` is used",
    )],
};

/// Of a known effect, in addition to the names of its parameters.
pub const EFFECTS: Keys = Keys {
    of: "effects",
    list: &[
        key("joint", "at which joint of an arm it is, from 1", "", "as given by arrays of its parameters"),
        key("doubt", "relative standard deviation of all its values", "1", "0: known exactly"),
    ],
};

/// Of a payload.
pub const PAYLOAD: Keys = Keys {
    of: "payload",
    list: &[
        key("link", "which link carries it, from 1", "", "must be given"),
        key(
            "mass",
            "a number where it is known, a table as below where it is estimated",
            "kg",
            "must be given",
        ),
        key(
            "centerOfMass",
            "where its centre is in the link's axes, along and across it: two numbers, or a table as below",
            "m",
            "the link's end",
        ),
        key("inertia", "about that centre: a number, or a table as below", "kg.m2", "0"),
    ],
};

/// Of a figure of a payload that is estimated.
pub const PAYLOAD_FIGURE: Keys = Keys {
    of: "a figure of payload",
    list: &[
        key("value", "prior mean", "as the figure", "0"),
        key("doubt", "its standard deviation", "as the figure", "0: known exactly"),
    ],
};

/// Of `[fit]`.
pub const FIT: Keys = Keys {
    of: "fit",
    list: &[
        key(
            "parameters",
            "what `identify` estimates; an array's name includes all its elements",
            "names",
            "of a joint stiffness, damping and frictions, of an arm motor inertia, stiffness and damping of flexible joints",
        ),
        key(
            "effects",
            "effects that `identify` estimates in addition to the model's parameters, as `--with` does; parameters of them that the case gives are where it begins",
            "ids",
            "none",
        ),
    ],
};

/// Of `[channels.NAME]`, in a case and in a sidecar.
pub const CHANNELS: Keys = Keys {
    of: "channels",
    list: &[
        key("resolution", "step of the reading: one count", "the channel's", "none: not quantised"),
        key(
            "noise",
            "standard deviation of white noise",
            "the channel's",
            "from `repeats` or `rest`, else guessed from the highest frequencies",
        ),
        key(
            "delay",
            "by how much the reading is late, of inputs and outputs alike: a number where it is known, `\"estimate\"` or a table as below where it is estimated",
            "s",
            "0",
        ),
        key(
            "offset",
            "the reading is too large by a constant, which is estimated: `\"estimate\"`, or a table as below",
            "the channel's",
            "none",
        ),
        key(
            "gain",
            "the reading is too large by a factor, which is estimated: `\"estimate\"`, or a table as below; reading = gain x true value + offset, of inputs and outputs alike",
            "1",
            "1",
        ),
        key(
            "interpolation",
            "of an input, between samples: `\"linear\"`, or `\"hold\"` until the next one",
            "",
            "`\"linear\"`",
        ),
    ],
};

/// Of a gain, an offset or a delay of a sensor that something is known of.
pub const GUESS: Keys = Keys {
    of: "gain, offset or delay",
    list: &[
        key("value", "prior mean", "as the figure", "1 of a gain, 0 of an offset or a delay"),
        key(
            "doubt",
            "standard deviation: of a gain as a share of it, of an offset in the channel's unit, of a delay in s",
            "",
            "nothing is known",
        ),
    ],
};

/// Of a sidecar.
pub const SIDECAR: Keys = Keys {
    of: "a sidecar",
    list: &[
        key(
            "columns",
            "table: what a column of the file is: the variable's name, a table as below, or `false` to leave it out",
            "",
            "columns bear names of variables",
        ),
        key(
            "channels",
            "tables `[channels.NAME]` as in `case.toml`, of this recording alone",
            "",
            "as in `case.toml`",
        ),
        key(
            "parameters",
            "table: start values known for this run, such as `initialMotorAngle`",
            "the parameter's",
            "as in `case.toml`",
        ),
        key(
            "rate",
            "as under `[recordings]` of `case.toml`, of this recording alone",
            "Hz",
            "as in `case.toml`",
        ),
    ],
};

/// Of a column in a sidecar's `[columns]`.
pub const COLUMNS: Keys = Keys {
    of: "columns",
    list: &[
        key("variable", "the FMU variable that it measures", "name", "the column's name"),
        key(
            "scale",
            "factor of the reading: the value is `scale` times the reading plus `offset`",
            "the variable's per the reading's",
            "1, or that of `unit`",
        ),
        key("offset", "what is added then", "the variable's, or `unit`", "0"),
        key("unit", "the unit of the result, converted to SI: deg, rpm, mA, Nmm, ms and others", "", "SI"),
    ],
};
