//! The keys of a system's TOML: the reader takes these and no other.

use trueup_signals::keys::KeyValue::{
    Anything, Either, Flag, List, Named, Number, OneOf, Table, Text, Texts, Values,
};
use trueup_signals::keys::{KeyValue, Keys, key};

/// Of the root.
pub const SYSTEM: Keys = Keys {
    of: "a system",
    list: &[
        key("run", "from when to when, and how", "", "see there", Table(&RUN)),
        key(
            "components",
            "tables `[components.NAME]`: the FMUs",
            "",
            "must be given",
            Named(&[Table(&COMPONENT)]),
        ),
        key(
            "connections",
            "`\"from.output -> to.input\"`, or tables",
            "",
            "none",
            List(&[Text, Table(&CONNECTION)]),
        ),
        key(
            "record",
            "what is recorded: `component.variable`, or tables",
            "",
            "all outputs",
            List(&[Text, Table(&RECORD)]),
        ),
        key("inputs", "a file that drives inputs, or a table", "", "none", Either(&[Text, Table(&INPUTS)])),
    ],
};

/// Of `[run]`.
pub const RUN: Keys = Keys {
    of: "[run]",
    list: &[
        key("start", "start time", "s", "of the default experiment, else 0", Number),
        key("stop", "stop time", "s", "of the default experiments", Number),
        key("step", "communication step", "s", "the smallest of the default experiments", Number),
        key(
            "tolerance",
            "relative tolerance of the coupling and of integrators",
            "1",
            "of the default experiment",
            Number,
        ),
        key("algorithm", "how components are coupled", "name", "chosen by the system", Text),
        key("event-rows", "a row before and after each event", "", "false", Flag),
    ],
};

/// Of a component.
pub const COMPONENT: Keys = Keys {
    of: "a component",
    list: &[
        key("fmu", "the FMU", "file name", "must be given", Text),
        key(
            "interface",
            "Co-Simulation or Model Exchange",
            "",
            "Co-Simulation, if it has it",
            OneOf(&["cs", "me"]),
        ),
        key("step", "its own communication step", "s", "that of the run", Number),
        key(
            "start",
            "start values by variable, `{ value = .., unit = .. }` in another unit",
            "",
            "the FMU's",
            Anything,
        ),
    ],
};

/// Of a connection that is a table.
pub const CONNECTION: Keys = Keys {
    of: "a connection",
    list: &[
        key("from", "an output, `component.variable`", "", "must be given", Text),
        key("to", "an input, `component.variable`", "", "must be given", Text),
        key("factor", "the value is multiplied by it", "", "1", Number),
        key("offset", "what is added then", "", "0", Number),
        key("map", "values for values: integers, truth values, items", "", "none", Values),
        key("convert-units", "units are converted", "", "true", Flag),
    ],
};

/// Of a record that is a table.
pub const RECORD: Keys = Keys {
    of: "a record",
    list: &[
        key("variable", "`component.variable`", "", "must be given", Text),
        key("as", "name of its column", "", "the variable's", Text),
        key("every", "communication steps from row to row", "", "1", KeyValue::Integer),
    ],
};

/// Of `[inputs]`.
pub const INPUTS: Keys = Keys {
    of: "[inputs]",
    list: &[
        key("file", "a recording", "file name", "must be given", Text),
        key(
            "columns",
            "what its columns drive: `component.input`, or a list of these",
            "",
            "inputs of their names",
            Named(&[Text, Texts]),
        ),
    ],
};
