//! `--from`: the model of an identification or a diagnosis.

use std::path::Path;

use serde_json::Value;
use trueup_fmi::configuration::Configuration;
use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::template::Template;
use trueup_identification::packed::PackedModel;

use super::{PackTitle, configuration, models, pack};
use crate::args::Pack;
use crate::catalog::CatalogModel;
use crate::error::CliError;

/// Where results come from.
const SOURCES: &str =
    "give what `trueup identify CASE --json` prints, or the diagnosis.json of `trueup diagnose`";

/// The model in a file with a result.
pub(super) fn read(file: &Path) -> Result<PackedModel, CliError> {
    let failed = |what: String| CliError::at(file, what);
    let text = crate::input::text(file, SOURCES)?;
    let whole: Value =
        serde_json::from_str(&text).map_err(|e| failed(format!("this is no JSON: {e}; {SOURCES}")))?;
    match whole.get("pack") {
        Some(Value::Null) => {
            let why = "it has no model to pack: it was fitted through an FMU; set its values there";
            Err(failed(why.to_owned()))
        }
        Some(packed) => serde_json::from_value(packed.clone()).map_err(|e| {
            failed(format!("`pack` is not as this version writes it: {e}; make the result again"))
        }),
        None if whole.get("capped").is_some() => {
            let why = "nothing was concluded, for a finding is grave: correct it and diagnose again";
            Err(failed(why.to_owned()))
        }
        None => Err(failed(format!("there is no `pack` in it, so it is no result with a model; {SOURCES}"))),
    }
}

/// A model with its values, ready to be packed.
pub(crate) struct ReadyModel {
    model: CatalogModel,
    configuration: Configuration,
    title: Option<PackTitle>,
}

impl ReadyModel {
    /// The options of `trueup fmu pack` that it corresponds to; `set`: values that go before its own.
    pub(crate) fn of(packed: &PackedModel, set: &[String]) -> Result<Self, CliError> {
        let args = Pack {
            model: vec![packed.model.clone()],
            effect: packed.effects.clone(),
            set: packed.sets().chain(set.iter().cloned()).collect(),
            flexible: packed.flexible.clone(),
            structure: packed.structures().collect(),
            robot: packed.robot.as_ref().map(Into::into),
            held: packed.held,
            ..Pack::default()
        };
        let model = *models(&args)?
            .first()
            .ok_or_else(|| CliError::Failed(format!("there is no model `{}` to pack", packed.model)))?;
        let configuration = configuration(model, &args)?;
        let title = packed.case.as_ref().map(|case| {
            let with = configuration.effects.join(", ");
            let case = if case.is_empty() { String::new() } else { format!(" of the case {case}") };
            PackTitle {
                title: format!("{}.augmented", packed.model),
                description: format!("with {with} and fitted values, as the diagnosis{case} found them"),
            }
        });
        Ok(Self { model, configuration, title })
    }

    /// Its start values.
    pub(crate) fn start(&self) -> &[(String, f64)] {
        &self.configuration.start
    }

    /// File names and contents, version by version.
    pub(crate) fn fmus(
        &self,
        versions: &[FmiVersion],
        templates: &[Template],
    ) -> Result<Vec<(String, Vec<u8>)>, CliError> {
        pack(self.model, &self.configuration, self.title.as_ref(), versions, templates)
    }
}
