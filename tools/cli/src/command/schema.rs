//! `trueup schema`

use trueup_signals::{keys, schema::schema};

use crate::args::{Schema, SchemaOf};
use crate::error::CliError;
use crate::output::say;

pub(crate) fn run(args: &Schema) -> Result<(), CliError> {
    let found = match args.of {
        SchemaOf::Case => schema("case.toml", &keys::CASE),
        SchemaOf::Sidecar => schema("sidecar of a recording", &keys::SIDECAR),
        SchemaOf::System => schema("system of FMUs", &trueup_cosim::keys::SYSTEM),
        SchemaOf::Sweep => trueup_sweep::schema(),
        SchemaOf::Robot => trueup_robot::schema(),
        SchemaOf::Ports => schema("ports.toml", &trueup_ports::keys::PORTS),
    };
    let text = serde_json::to_string_pretty(&found).map_err(|e| CliError::Failed(e.to_string()))?;
    say(&(text + "\n"))
}
