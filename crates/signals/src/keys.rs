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
    /// Form of its value.
    pub value: KeyValue,
}

/// The form of a value, as the readers take it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyValue {
    /// A text.
    Text,
    /// A list of texts.
    Texts,
    /// A list of lists of texts.
    TextGroups,
    /// A number.
    Number,
    /// A list of numbers.
    Numbers,
    /// A whole number.
    Integer,
    /// A truth value.
    Flag,
    /// `false` alone.
    Never,
    /// One of these texts.
    OneOf(&'static [&'static str]),
    /// Any of these forms.
    Either(&'static [KeyValue]),
    /// A table with these keys.
    Table(&'static Keys),
    /// A table with these keys and parameters by name.
    Entries(&'static Keys),
    /// A list of such tables.
    EntryLists(&'static Keys),
    /// A list of these forms.
    List(&'static [KeyValue]),
    /// A table of anything.
    Anything,
    /// A table of any names, each with one of these forms.
    Named(&'static [KeyValue]),
    /// A table of columns, in which tables of files may be, each of columns again.
    Columns,
    /// A table of parameters: numbers, truth values, texts, and arrays of them.
    Values,
    /// A table of numbers or arrays of them.
    Deviations,
}

use KeyValue::*;

/// What a column of `[columns]` may be.
pub const COLUMN: &[KeyValue] = &[Text, Never, Table(&COLUMNS)];

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
    &[CASE, RECORDINGS, EFFECTS, PAYLOAD, PAYLOAD_FIGURE, FIT, FIT_WEIGHT, CHANNELS, GUESS, SIDECAR, COLUMNS];

/// A key of a table; its arguments are the fields of [`CaseFileKey`].
pub const fn key(
    name: &'static str,
    meaning: &'static str,
    unit: &'static str,
    default: &'static str,
    value: KeyValue,
) -> CaseFileKey {
    CaseFileKey { name, meaning, unit, default, value }
}

/// Of `case.toml`.
pub const CASE: Keys = Keys {
    of: "a case",
    list: &[
        key(
            "model",
            "the model that the recordings are compared with, or an FMU",
            "name, or file name",
            "must be given",
            Text,
        ),
        key(
            "ports",
            "of an FMU as model: what its variables mean, a `ports.toml`; `trueup diagnose` requires it",
            "file name",
            "none",
            Text,
        ),
        key(
            "robot",
            "of SpatialFreeFlyer: what the robot is made of, a file of TOML, URDF or MJCF, or a preset",
            "file name, or name",
            "must be given for it",
            Text,
        ),
        key("train", "recordings that may be fitted", "file names in the folder", "must be given", Texts),
        key(
            "holdout",
            "recordings that are never fitted: the reported figures are of them",
            "file names",
            "none: figures are of `train`, with a note",
            Texts,
        ),
        key(
            "repeats",
            "groups of runs of the same command: their differences are noise, but for what drifts from run to run",
            "lists of file names",
            "none",
            TextGroups,
        ),
        key("rest", "recordings at rest: what varies in them is noise", "file names", "none", Texts),
        key("parameters", "table: the nominal simulation, see below", "", "the model's own values", Values),
        key(
            "uncertain",
            "table: how far these values may be off, see below",
            "",
            "none is doubted",
            Deviations,
        ),
        key(
            "effects",
            "tables `[effects.ID]`: effects that are there for certain, see below",
            "",
            "the model has none",
            Named(&[Entries(&EFFECTS), EntryLists(&EFFECTS)]),
        ),
        key(
            "payload",
            "table: a body that a link of PlanarManipulator carries, see below",
            "",
            "none",
            Table(&PAYLOAD),
        ),
        key("fit", "table: what `identify` estimates, see below", "", "see there", Table(&FIT)),
        key(
            "channels",
            "tables `[channels.NAME]`: what is known of a sensor, see below",
            "",
            "nothing is known",
            Named(&[Table(&CHANNELS)]),
        ),
        key(
            "columns",
            "table: what columns of the recordings are, as in a sidecar; `[columns.\"log_04*.csv\"]` of those whose names match, see below",
            "",
            "columns bear names of variables",
            Columns,
        ),
        key(
            "recordings",
            "table: what holds for the rows of all recordings, see below",
            "",
            "none",
            Table(&RECORDINGS),
        ),
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
        Number,
    )],
};

/// Of a known effect, in addition to the names of its parameters.
pub const EFFECTS: Keys = Keys {
    of: "effects",
    list: &[
        key(
            "joint",
            "at which joint of an arm it is, from 1",
            "",
            "as given by arrays of its parameters",
            Integer,
        ),
        key("doubt", "relative standard deviation of all its values", "1", "0: known exactly", Number),
    ],
};

/// Of a payload.
pub const PAYLOAD: Keys = Keys {
    of: "payload",
    list: &[
        key("link", "which link carries it, from 1", "", "must be given", Integer),
        key(
            "mass",
            "a number where it is known, a table as below where it is estimated",
            "kg",
            "must be given",
            Either(&[Number, Table(&PAYLOAD_FIGURE)]),
        ),
        key(
            "centerOfMass",
            "where its centre is in the link's axes, along and across it: two numbers, or a table as below",
            "m",
            "the link's end",
            Either(&[Numbers, Table(&PAYLOAD_FIGURE)]),
        ),
        key(
            "inertia",
            "about that centre: a number, or a table as below",
            "kg.m2",
            "0",
            Either(&[Number, Table(&PAYLOAD_FIGURE)]),
        ),
    ],
};

/// Of a figure of a payload that is estimated.
pub const PAYLOAD_FIGURE: Keys = Keys {
    of: "a figure of payload",
    list: &[
        key("value", "prior mean", "as the figure", "0", Either(&[Number, Numbers])),
        key("doubt", "its standard deviation", "as the figure", "0: known exactly", Number),
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
            Texts,
        ),
        key(
            "effects",
            "effects that `identify` estimates in addition to the model's parameters, as `--with` does; parameters of them that the case gives are where it begins",
            "ids",
            "none",
            Texts,
        ),
        key(
            "weight",
            "stretches of time whose readings count for less in `identify`, see below; a diagnosis refuses it",
            "",
            "every reading counts by its noise",
            List(&[Table(&FIT_WEIGHT)]),
        ),
    ],
};

/// Of a stretch of `weight` in `[fit]`.
pub const FIT_WEIGHT: Keys = Keys {
    of: "a stretch of weight",
    list: &[
        key(
            "weight",
            "factor on the square of each residual there, 0 to 1; where several hold, their product",
            "1",
            "must be given",
            Number,
        ),
        key("start", "from this time on", "s", "from the first reading on", Number),
        key("end", "until this time", "s", "to the last reading", Number),
        key("recordings", "recordings of `train` in which it holds", "file names", "all", Texts),
    ],
};

/// Of `[channels.NAME]`, in a case and in a sidecar.
pub const CHANNELS: Keys = Keys {
    of: "channels",
    list: &[
        key("resolution", "step of the reading: one count", "the channel's", "none: not quantised", Number),
        key(
            "noise",
            "standard deviation of white noise",
            "the channel's",
            "from `repeats` or `rest`, else guessed from the highest frequencies",
            Number,
        ),
        key(
            "delay",
            "by how much the reading is late, of inputs and outputs alike: a number where it is known, `\"estimate\"` or a table as below where it is estimated",
            "s",
            "0",
            Either(&[Number, OneOf(&["estimate"]), Table(&GUESS)]),
        ),
        key(
            "offset",
            "the reading is too large by a constant, which is estimated: `\"estimate\"`, or a table as below",
            "the channel's",
            "none",
            Either(&[OneOf(&["estimate"]), Table(&GUESS)]),
        ),
        key(
            "gain",
            "the reading is too large by a factor, which is estimated: `\"estimate\"`, or a table as below; reading = gain x true value + offset, of inputs and outputs alike",
            "1",
            "1",
            Either(&[OneOf(&["estimate"]), Table(&GUESS)]),
        ),
        key(
            "interpolation",
            "of an input, between samples: `\"linear\"`, or `\"hold\"` until the next one",
            "",
            "`\"linear\"`",
            OneOf(&["linear", "hold"]),
        ),
    ],
};

/// Of a gain, an offset or a delay of a sensor that something is known of.
pub const GUESS: Keys = Keys {
    of: "gain, offset or delay",
    list: &[
        key("value", "prior mean", "as the figure", "1 of a gain, 0 of an offset or a delay", Number),
        key(
            "doubt",
            "standard deviation: of a gain as a share of it, of an offset in the channel's unit, of a delay in s",
            "",
            "nothing is known",
            Number,
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
            "as in `case.toml`",
            Named(COLUMN),
        ),
        key(
            "channels",
            "tables `[channels.NAME]` as in `case.toml`, of this recording alone",
            "",
            "as in `case.toml`",
            Named(&[Table(&CHANNELS)]),
        ),
        key(
            "parameters",
            "table: start values known for this run, such as `initialMotorAngle`",
            "the parameter's",
            "as in `case.toml`",
            Values,
        ),
        key(
            "rate",
            "as under `[recordings]` of `case.toml`, of this recording alone",
            "Hz",
            "as in `case.toml`",
            Number,
        ),
    ],
};

/// Of a column in `[columns]`.
pub const COLUMNS: Keys = Keys {
    of: "columns",
    list: &[
        key("variable", "the FMU variable that it measures", "name", "the column's name", Text),
        key(
            "scale",
            "factor of the reading: the value is `scale` times the reading plus `offset`",
            "the variable's per the reading's",
            "1, or that of `unit`",
            Number,
        ),
        key("offset", "what is added then", "the variable's, or `unit`", "0", Number),
        key(
            "unit",
            "the unit of the result, converted to SI: deg, rpm, mA, Nmm, ms and others",
            "",
            "SI",
            Text,
        ),
    ],
};
