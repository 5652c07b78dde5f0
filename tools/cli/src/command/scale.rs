//! `trueup scale`

mod case;

use std::path::{Path, PathBuf};

use trueup_cosim::system::CosimSystem;
use trueup_cosim::{check, write_ssp};
use trueup_scaling::{ScalingError, ScalingLaw, recording, system, table};

use crate::args::ScaleCommand;
use crate::error::CliError;
use crate::output::write;
use crate::voice;

pub(crate) fn run(args: &ScaleCommand) -> Result<(), CliError> {
    let law = ScalingLaw { lambda: args.lambda, back: args.back, given: args.exponent.clone() };
    let kind = ScaledFileKind::of(&args.file)?;
    if args.units.is_some() && kind != ScaledFileKind::Recording {
        return Err(CliError::Usage(
            "--units: only a recording has its units elsewhere; leave it out".into(),
        ));
    }
    if kind == ScaledFileKind::Case {
        return case::run(args, &law);
    }
    let extension = kind.extension(&args.file);
    let to = args.output.clone().unwrap_or_else(|| {
        let stem = args.file.file_stem().unwrap_or_default().to_string_lossy();
        args.file.with_file_name(format!("{stem}.{}.{extension}", word(args)))
    });
    if to.extension().is_none_or(|e| e.to_string_lossy().to_lowercase() != extension) {
        let name = to.display();
        return Err(CliError::Usage(format!(
            "the result is a .{extension}; let --output {name} end with that"
        )));
    }
    another(&args.file, &to)?;
    match kind {
        ScaledFileKind::Table => {
            let scaled = table::scaled(&text(&args.file)?, &args.file, &law).map_err(failed)?;
            write(&to, scaled.as_bytes())?;
        }
        ScaledFileKind::Recording => of_recording(args, &law, &to)?,
        _ => of_system(kind, args, &law, &to)?,
    }
    voice::line(&to.display().to_string());
    Ok(())
}

/// Of a name of a result.
fn word(args: &ScaleCommand) -> &'static str {
    if args.back { "full" } else { "scaled" }
}

/// A result never replaces what it came from.
fn another(from: &Path, to: &Path) -> Result<(), CliError> {
    let same = from.canonicalize().is_ok_and(|a| to.canonicalize().is_ok_and(|b| a == b));
    if !same {
        return Ok(());
    }
    let mend = "what was scaled twice looks like what was scaled once; name another one";
    Err(CliError::Usage(format!("--output {}: that is where it comes from; {mend}", to.display())))
}

/// What a file is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ScaledFileKind {
    /// TOML with components.
    System,
    /// SSP.
    Package,
    Fmu,
    Recording,
    Case,
    /// Quantities with their units.
    Table,
}

impl ScaledFileKind {
    fn of(file: &Path) -> Result<Self, CliError> {
        let extension = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        Ok(match extension.as_str() {
            "ssp" | "ssd" => Self::Package,
            "csv" => Self::Recording,
            "toml" => {
                let whole: Option<toml::Table> = text(file)?.parse().ok();
                let has = |key: &str| whole.as_ref().is_some_and(|t| t.contains_key(key));
                match () {
                    () if has("components") => Self::System,
                    () if has("model") && has("train") => Self::Case,
                    () => Self::Table,
                }
            }
            "fmu" => Self::Fmu,
            _ if file.join("modelDescription.xml").is_file() => Self::Fmu,
            _ if file.join("case.toml").is_file() => Self::Case,
            _ => {
                return Err(CliError::at(file, format!("there is nothing to scale in it; {MEND}")));
            }
        })
    }

    fn extension(self, file: &Path) -> String {
        match self {
            Self::Package => "ssp".into(),
            Self::Fmu => "toml".into(),
            _ => file.extension().unwrap_or_default().to_string_lossy().to_lowercase(),
        }
    }
}

/// What may be named.
const MEND: &str =
    "name a system (.toml, .ssp), an FMU, a case, a table of quantities (.toml) or a recording (.csv)";

fn text(file: &Path) -> Result<String, CliError> {
    crate::input::text(file, MEND)
}

fn failed(e: ScalingError) -> CliError {
    CliError::Failed(e.to_string())
}

fn of_recording(args: &ScaleCommand, law: &ScalingLaw, to: &Path) -> Result<(), CliError> {
    let Some(units) = &args.units else {
        let mend = "name the system or the FMU that they are variables of with --units FILE";
        return Err(CliError::Usage(format!("the columns of {} have no units; {mend}", args.file.display())));
    };
    let bytes = scaled_table(&args.file, &CosimSystem::read(units).map_err(cosim)?, law)?;
    write(to, &bytes)
}

fn cosim(e: trueup_cosim::CosimError) -> CliError {
    CliError::Failed(e.to_string())
}

/// A table whose columns are variables of the system.
fn scaled_table(file: &Path, of: &CosimSystem, law: &ScalingLaw) -> Result<Vec<u8>, CliError> {
    let plan = check(of).map_err(cosim)?;
    let from = text(file)?;
    let mut bytes = Vec::new();
    recording::scale(file, from.as_bytes(), &mut bytes, law, |name| system::column(of, &plan, law, name))
        .map_err(failed)?;
    Ok(bytes)
}

fn of_system(kind: ScaledFileKind, args: &ScaleCommand, law: &ScalingLaw, to: &Path) -> Result<(), CliError> {
    let of = CosimSystem::read(&args.file).map_err(cosim)?;
    let mut scaled = system::scale(&of, law).map_err(failed)?;
    scaled.notes.iter().for_each(|note| voice::note(note));
    let mut inputs = None;
    if let Some(file) = &of.inputs {
        let stem = to.file_stem().unwrap_or_default().to_string_lossy();
        let name = format!("{stem}.inputs.csv");
        let beside: PathBuf = to.with_file_name(&name);
        write(&beside, &scaled_table(&file.file, &of, law)?)?;
        if let Some(file) = &mut scaled.system.inputs {
            file.file = beside;
        }
        inputs = Some(name);
    }
    if kind == ScaledFileKind::Package {
        let plan = check(&scaled.system).map_err(cosim)?;
        return write_ssp(&scaled.system, &plan, to).map_err(cosim);
    }
    let before = if kind == ScaledFileKind::Fmu { String::new() } else { text(&args.file)? };
    let after = system::toml(&scaled, &before, &args.file, to, inputs.as_deref()).map_err(failed)?;
    write(to, after.as_bytes())
}
