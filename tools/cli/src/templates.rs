//! Where the libraries are from which FMUs are made: that of this machine next to the program, as cargo leaves it; those of all
//! platforms in `templates/<platform>/` there, as `tools/release` leaves them.

use std::path::{Path, PathBuf};

use trueup_fmi_description::platform::Platform;
use trueup_fmi_description::template::Template;

use crate::error::CliError;

/// Name of the crate whose shared library every FMU carries.
const LIBRARY: &str = "fmu_library";

/// The platforms that `--platform` names; none when it is not given.
pub(crate) fn platforms(names: &[String]) -> Result<Vec<Platform>, CliError> {
    let mut out = Vec::new();
    for name in names {
        match (name.as_str(), Platform::named(name)) {
            ("all", _) => out.extend(Platform::ALL),
            (_, Some(platform)) => out.push(platform),
            (_, None) => {
                let all = Platform::ALL.map(Platform::name).join(", ");
                return Err(CliError::Usage(format!(
                    "there is no platform `{name}`; there are {all}, and `all`"
                )));
            }
        }
    }
    // Given twice, a platform is packed once; in the order of the list, so that archives do not differ.
    out.sort();
    out.dedup();
    Ok(out)
}

/// The templates of these platforms; of none: that of this machine.
pub(crate) fn read(platforms: &[Platform], named: Option<&Path>) -> Result<Vec<Template>, CliError> {
    if platforms.is_empty() {
        return Ok(vec![load(own_platform()?, &own(named)?)?]);
    }
    let templates = match named {
        Some(folder) => folder.join("templates"),
        None => program_folder()?.join("templates"),
    };
    let mut missing = Vec::new();
    let mut out = Vec::new();
    for platform in platforms {
        match cross_built(*platform, &templates)? {
            Some(path) => out.push(load(*platform, &path)?),
            None if Platform::host() == Some(*platform) && own(named).is_ok() => {
                crate::voice::note(&format!(
                    "{platform}: the library of this build is packed, which runs where the system is not older than this one; \
                     `tools/release` makes one that does not require that"
                ));
                out.push(load(*platform, &own(named)?)?);
            }
            None => missing.push(platform.name()),
        }
    }
    if missing.is_empty() {
        return Ok(out);
    }
    Err(CliError::Failed(format!(
        "no template library for {} in {}: make them with `tools/release {}`, or name the folder above it with --library",
        missing.join(", "),
        templates.display(),
        missing.join(" ")
    )))
}

fn own_platform() -> Result<Platform, CliError> {
    Platform::host().ok_or_else(|| {
        let all = Platform::ALL.map(Platform::name).join(", ");
        CliError::Failed(format!(
            "FMUs are not made for this machine; name other ones with --platform: {all}"
        ))
    })
}

fn program_folder() -> Result<PathBuf, CliError> {
    let program = std::env::current_exe().map_err(|e| CliError::Failed(e.to_string()))?;
    Ok(program.parent().unwrap_or(Path::new(".")).to_owned())
}

/// The library that cargo built with the program: in the folder named, or next to the program, or where cargo puts the library of a
/// dependency; the newest.
fn own(named: Option<&Path>) -> Result<PathBuf, CliError> {
    let file = format!("{}{}{}", std::env::consts::DLL_PREFIX, LIBRARY, std::env::consts::DLL_SUFFIX);
    let folders = match named {
        Some(folder) => vec![folder.to_owned()],
        None => {
            let beside = program_folder()?;
            vec![beside.join("deps"), beside.join("../lib/trueup"), beside]
        }
    };
    let modified = |path: &PathBuf| path.metadata().and_then(|m| m.modified()).ok();
    let found = folders.iter().map(|f| f.join(&file)).filter(|p| modified(p).is_some()).max_by_key(modified);
    found.ok_or_else(|| {
        let places: Vec<_> = folders.iter().map(|f| f.display().to_string()).collect();
        CliError::Failed(format!(
            "{file}, the template of every FMU, is not in {}: build it with `cargo build --release`, \
             or name its folder with --library",
            places.join(" nor in ")
        ))
    })
}

/// The one library in `<templates>/<platform>`.
fn cross_built(platform: Platform, templates: &Path) -> Result<Option<PathBuf>, CliError> {
    let folder = templates.join(platform.name());
    if !folder.is_dir() {
        return Ok(None);
    }
    let mut found = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(|e| CliError::at(&folder, e))? {
        let path = entry.map_err(|e| CliError::at(&folder, e))?.path();
        if path.to_string_lossy().ends_with(platform.suffix()) {
            found.push(path);
        }
    }
    found.sort();
    match &found[..] {
        [] => Ok(None),
        [one] => Ok(Some(one.clone())),
        [one, two, ..] => Err(CliError::Failed(format!(
            "{} and {} are both template libraries for {platform}: take one away",
            one.display(),
            two.display()
        ))),
    }
}

fn load(platform: Platform, path: &Path) -> Result<Template, CliError> {
    let bytes = std::fs::read(path)
        .map_err(|e| crate::input::unread(path, &e, "name another folder with --library"))?;
    let of = Platform::of_library(&bytes);
    if of != Some(platform) {
        let found = of.map_or("no library that is known".to_owned(), |p| format!("a library for {p}"));
        return Err(CliError::at(
            path,
            format!("it is {found}, not one for {platform}: `tools/release {platform}` makes one"),
        ));
    }
    let template = Template { platform, bytes };
    template.check(fmu_library::STAMP).map_err(|e| CliError::at(path, e))?;
    Ok(template)
}
