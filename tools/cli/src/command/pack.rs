//! `trueup fmu pack`

mod from;
pub(super) mod start;

use std::path::PathBuf;

use trueup_fmi::configuration::Configuration;
use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::pack::{FmuParts, ReferenceResults, archive, write_file};
use trueup_fmi_description::template::Template;
use trueup_models::presets::ValuePreset;

use crate::args::Pack;
use crate::assets;
use crate::catalog::{self, CatalogModel};
use crate::error::CliError;
use crate::output::{folder, say};
use crate::templates;
use trueup_signals::did_you_mean;

/// Where names are to be found.
const LIST: &str = "`trueup fmu list` shows them";

pub(crate) use from::ReadyModel;

pub(crate) fn run(args: &Pack) -> Result<(), CliError> {
    if let Some(file) = &args.from {
        let ready = ReadyModel::of(&from::read(file)?, &args.set)?;
        let templates = templates::read(&templates::platforms(&args.platform)?, args.library.as_deref())?;
        return written(args, ready.fmus(&versions(args), &templates)?);
    }
    for e in &args.effect {
        let id = e.split(':').next().unwrap_or_default();
        if !catalog::effects().any(|known| known.id == id) {
            let mend = did_you_mean(id, catalog::effects().map(|e| e.id), LIST);
            return Err(CliError::Usage(format!("there is no effect `{e}`; {mend}")));
        }
    }
    if let Some(p) = &args.preset
        && !catalog::models().any(|m| has_preset(m, p))
    {
        let names = catalog::models().flat_map(|m| catalog::preset_names(m.name)).map(|p| p.0);
        return Err(CliError::Usage(format!("there is no preset `{p}`; {}", did_you_mean(p, names, LIST))));
    }
    let platforms = templates::platforms(&args.platform)?;
    let models = models(args)?;
    let templates = templates::read(&platforms, args.library.as_deref())?;
    // All or nothing: files are written when every FMU is ready.
    let mut ready = Vec::new();
    for model in models {
        let configuration = configuration(model, args)?;
        ready.extend(pack(model, &configuration, None, &versions(args), &templates)?);
    }
    written(args, ready)
}

/// The requested versions of FMI.
fn versions(args: &Pack) -> Vec<FmiVersion> {
    FmiVersion::ALL.into_iter().filter(|v| args.fmi.is_none_or(|wanted| wanted == v.major())).collect()
}

fn written(args: &Pack, ready: Vec<(String, Vec<u8>)>) -> Result<(), CliError> {
    folder(&args.output)?;
    for (name, bytes) in ready {
        let path = args.output.join(name);
        write_file(&path, &bytes).map_err(|e| CliError::Failed(e.to_string()))?;
        say(&format!("{}\n", path.display()))?;
    }
    Ok(())
}

/// The chaser of a capture is a robot in space.
fn in_space(args: &Pack) -> bool {
    args.structure.iter().any(|choice| {
        choice.split_once('=').is_some_and(|(name, item)| (name.trim(), item.trim()) == ("chaser", "spatial"))
    })
}

fn has_preset(model: CatalogModel, preset: &str) -> bool {
    catalog::preset_names(model.name).iter().any(|p| p.0 == preset)
}

/// The models named, or all that the other options fit.
fn models(args: &Pack) -> Result<Vec<CatalogModel>, CliError> {
    let misfit = |m: CatalogModel| {
        let effect = args
            .effect
            .iter()
            .find(|e| catalog::in_order(m.name, in_space(args), &[(*e).clone()]).is_none())
            .map(|e| {
                let plain = || format!("effect `{e}` does not act in {}", m.name);
                catalog::misfit(m.name, in_space(args), e).unwrap_or_else(plain)
            });
        effect
            .or_else(|| {
                args.preset
                    .as_ref()
                    .filter(|p| !has_preset(m, p))
                    .map(|p| format!("preset `{p}` is not for {}", m.name))
            })
            .or_else(|| {
                let robot = args.robot.as_ref().filter(|_| !catalog::of_robots(m.name));
                let (a, b, c) = (catalog::FLYER, catalog::ARM, catalog::CONTROLLER);
                let d = catalog::CAPTURE;
                robot.map(|r| {
                    format!("robot {} is for {a}, {b}, {c} and {d}, not for {}", r.display(), m.name)
                })
            })
    };
    if args.model.is_empty() {
        let chosen = !args.flexible.is_empty() || !args.structure.is_empty() || args.joints.is_some();
        if !args.set.is_empty() || chosen {
            return Err(CliError::Usage(
                "--set, --flexible, --joints and --structure require a model: name it".to_owned(),
            ));
        }
        // No structure is chosen here: a base floats. A robot without further choice is the flyer's: an arm on the ground has
        // not all that a robot may have, and a controller is named.
        let floats = |m: &CatalogModel| args.effect.iter().any(|e| catalog::wants_fixed_base(m.name, e));
        let robot = args.robot.is_some() || args.preset.is_some();
        let ground = |m: &CatalogModel| args.robot.is_some() && m.name == catalog::ARM;
        let controls = |m: &CatalogModel| robot && m.name == catalog::CONTROLLER;
        // Its chaser is rigid, in which no effect acts and which is no robot.
        let described = !args.effect.is_empty() || args.robot.is_some();
        let rigid = |m: &CatalogModel| described && m.name == catalog::CAPTURE;
        // Which of its joints and outputs an effect finds is the robot's: one is named.
        let unnamed = |m: &CatalogModel| !args.effect.is_empty() && m.name == catalog::FLYER;
        let fits = |m: &CatalogModel| {
            !(floats(m) || ground(m) || controls(m) || rigid(m) || unnamed(m)) && misfit(*m).is_none()
        };
        let fitting: Vec<CatalogModel> = catalog::models().filter(fits).collect();
        if fitting.is_empty() {
            return Err(CliError::Usage(
                "no model has all of these effects and this preset: `trueup fmu list` shows which has which"
                    .to_owned(),
            ));
        }
        return Ok(fitting);
    }
    let named = |name: &String| {
        let model = catalog::models().find(|m| m.name == name).ok_or_else(|| {
            let names: Vec<_> = catalog::models().map(|m| m.name).collect();
            let all = format!("there are {}", names.join(", "));
            CliError::Usage(format!("there is no model `{name}`; {}", did_you_mean(name, names, &all)))
        })?;
        misfit(model).map_or(Ok(model), |why| {
            Err(CliError::Usage(format!("{why}: `trueup fmu list` shows what fits")))
        })
    };
    args.model.iter().map(named).collect()
}

/// The requested robot, with the requested joints flexible.
fn robot(model: CatalogModel, args: &Pack) -> Result<Option<trueup_robot::RobotFile>, CliError> {
    if !catalog::of_robots(model.name) {
        return Ok(None);
    }
    // The arm's preset is the default, a capture's has values of its own.
    let of_robots = [catalog::FLYER, catalog::CONTROLLER].contains(&model.name);
    let named = args.preset.as_ref().filter(|_| of_robots).map(PathBuf::from);
    let Some(file) = args.robot.clone().or(named) else { return Ok(None) };
    let mut robot = trueup_robot::read(&file, args.repair_inertia)?;
    // An arm of FlexibleArm is on the ground anyway.
    let ground = model.name == catalog::ARM;
    let floats = robot.floats.iter().filter(|_| !args.held && !ground);
    let without = robot.without_friction.iter().filter(|_| !ground && !catalog::bring_friction(&args.effect));
    robot.notes.iter().chain(floats).chain(without).for_each(|note| crate::voice::note(note));
    robot.design.held |= args.held || ground;
    if !args.flexible.is_empty() {
        robot.design.flex(&args.flexible).map_err(CliError::Usage)?;
    }
    Ok(Some(robot))
}

/// What its joints lose, as start values: a joint at rest starts to move at its break-away torque. Of an arm on the ground dry friction
/// acts on the motors of flexible joints; that of rigid ones is named.
fn frictions(robot: &trueup_robot::RobotFile, ground: bool) -> Vec<(String, f64)> {
    let links = || robot.friction.iter().zip(&robot.design.links).enumerate();
    let rigid = links().filter(|(_, (f, l))| ground && f.coulomb != 0.0 && !l.motor.flexible);
    let named: Vec<_> = rigid.map(|(_, (_, l))| l.name.as_str()).collect();
    if !named.is_empty() {
        crate::voice::note(&format!(
            "dry friction of the joints of {} is not in this model: it acts on the motors of flexible joints; --flexible makes them so",
            named.join(", ")
        ));
    }
    links()
        .flat_map(|(k, (f, l))| {
            let of = |name: &str| format!("{name}[{}]", k + 1);
            let dry = if l.motor.flexible || !ground { f.coulomb } else { 0.0 };
            [(of("viscousFriction"), f.viscous), (of("coulombFriction"), dry), (of("staticFriction"), dry)]
        })
        .collect()
}

/// One entry per joint: which are flexible; of a controller their number counts alone.
fn joints(model: CatalogModel, args: &Pack) -> Result<Vec<bool>, String> {
    match args.joints {
        None if args.flexible.is_empty() => {
            Ok(chosen_preset(model, args).map_or_else(Vec::new, |p| p.flexible.to_vec()))
        }
        None => Ok(args.flexible.clone()),
        Some(n) if model.name == catalog::ARM_CONTROLLER => Ok(vec![false; usize::from(n)]),
        Some(_) => Err(format!(
            "--joints is for {}; --flexible has an entry per joint of an arm",
            catalog::ARM_CONTROLLER
        )),
    }
}

/// What `--structure` chooses; the last one of a name counts.
fn structure(model: CatalogModel, args: &Pack) -> Result<Vec<(String, Vec<u32>)>, String> {
    let known = catalog::choices(model.name);
    let mut chosen: Vec<(String, Vec<u32>)> = Vec::new();
    for asked in &args.structure {
        let wrong = |why: String| format!("--structure {asked}: {why}");
        let (name, value) =
            asked.split_once('=').ok_or_else(|| wrong("write it as name=value".to_owned()))?;
        let choice = known.iter().find(|k| k.name == name.trim()).ok_or_else(|| {
            let mend = did_you_mean(name.trim(), known.iter().map(|k| k.name), LIST);
            wrong(format!("there is no `{}` to choose here; {mend}", name.trim()))
        })?;
        let number = choice.parse(value.trim()).map_err(wrong)?;
        chosen.retain(|c| c.0 != choice.name);
        chosen.push((choice.name.to_owned(), vec![number]));
    }
    Ok(chosen)
}

/// The requested values by a name.
fn chosen_preset(model: CatalogModel, args: &Pack) -> Option<&'static ValuePreset> {
    let name = args.preset.as_ref()?;
    catalog::presets(model.name).find(|p| p.name == name)
}

fn configuration(model: CatalogModel, args: &Pack) -> Result<Configuration, CliError> {
    let refused = |why: String| CliError::Usage(format!("{}: {why}", model.name));
    // In the order in which they act; given twice, an effect is packed once.
    let effects = catalog::in_order(model.name, in_space(args), &args.effect)
        .ok_or_else(|| refused(format!("no place for one of {}", args.effect.join(", "))))?;
    let mut configuration = match robot(model, args)? {
        Some(robot) if model.name == catalog::ARM => {
            let chosen = structure(model, args).map_err(refused)?;
            let design = fmu_library::with_links(robot.design.clone(), &chosen).map_err(refused)?;
            design.unstiffened().iter().for_each(|note| crate::voice::note(note));
            let mut own = fmu_library::of_arm(&design, &chosen).map_err(refused)?;
            let lossy = frictions(&robot, true).into_iter().filter(|(_, value)| *value != 0.0);
            let chosen = lossy.chain(robot.start);
            chosen.for_each(|(name, value)| start::assign(&mut own.start, &name, value));
            Configuration { effects, ..own }
        }
        Some(robot) => {
            // But for a capture nothing is: a name is refused.
            let chosen = structure(model, args).map_err(refused)?;
            robot.design.unstiffened().iter().for_each(|note| crate::voice::note(note));
            if model.name == catalog::CONTROLLER {
                let own = fmu_library::controller_of_design(&robot.design).map_err(refused)?;
                Configuration { effects, ..own }
            } else {
                let mut own = match model.name == catalog::CAPTURE {
                    true => fmu_library::capture_of_design(&robot.design, &chosen),
                    false => fmu_library::of_design(&robot.design),
                }
                .map_err(refused)?;
                // Of a file without friction the effect's small start values stay.
                let lossy = catalog::bring_friction(&effects).then(|| frictions(&robot, false));
                let lossy = lossy.filter(|all| all.iter().any(|(_, value)| *value != 0.0));
                let start = lossy.into_iter().flatten().chain(robot.start);
                start.for_each(|(name, value)| start::assign(&mut own.start, &name, value));
                Configuration { effects, ..own }
            }
        }
        None => Configuration {
            joint_flexible: joints(model, args).map_err(refused)?,
            structure: structure(model, args).map_err(refused)?,
            effects,
            ..Configuration::of(model.name)
        },
    };
    // Start values are read against the variables that this structure has.
    let table = fmu_library::table(&configuration).map_err(refused)?;
    for (name, value) in chosen_preset(model, args).into_iter().flat_map(|p| p.values) {
        match table.find(name) {
            Some(v) => (0..v.len()).for_each(|e| {
                start::assign(&mut configuration.start, &v.element_name(e), *value);
            }),
            None => start::assign(&mut configuration.start, name, *value),
        }
    }
    for set in &args.set {
        for (name, value) in start::parse(&table, set).map_err(refused)? {
            start::assign(&mut configuration.start, &name, value);
        }
    }
    fmu_library::table(&configuration).map_err(refused)?;
    Ok(configuration)
}

/// A name and a description of an FMU that are not those of its model and effects.
struct PackTitle {
    title: String,
    /// Behind the model's own description.
    description: String,
}

/// File names and contents of FMUs, version by version.
fn pack(
    model: CatalogModel,
    configuration: &Configuration,
    titled: Option<&PackTitle>,
    versions: &[FmiVersion],
    templates: &[Template],
) -> Result<Vec<(String, Vec<u8>)>, CliError> {
    let failed = |why: String| CliError::Failed(format!("{}: {why}", model.name));
    let mut table = fmu_library::table(configuration).map_err(failed)?;
    if let Some(titled) = titled {
        table.title = Some(titled.title.clone());
        table.description = format!("{}: {}; {}", titled.title, model.description, titled.description);
    }
    // Values that are meant for other inputs need not survive those of the default experiment.
    let reference = fmu_library::reference_result(configuration);
    if let Err(why) = &reference {
        let name = model.name;
        crate::voice::note(&format!(
            "{name} is packed without a reference result: the default experiment fails: {why}"
        ));
    }
    let assets = assets::of(model.name).ok_or_else(|| failed("has no documentation".to_owned()))?;
    let mut equations = assets.equations.to_owned();
    if !configuration.effects.is_empty() {
        equations += "<h2>Effects packed in</h2>\n";
        equations.extend(configuration.effects.iter().filter_map(|id| assets::effect(id)));
    }
    let modelica = crate::modelica::of(model.name);
    let one = |version: &FmiVersion| {
        let bytes = archive(&FmuParts {
            table: &table,
            configuration,
            version: *version,
            templates,
            stamp: fmu_library::STAMP,
            equations: &equations,
            picture: assets.picture,
            modelica: modelica.as_deref(),
            icon_svg: assets.icon_svg,
            icon_png: assets.icon_png,
            licences: assets::LICENCES,
            reference: reference
                .as_ref()
                .ok()
                .map(|r| ReferenceResults { inputs: &r.inputs, outputs: &r.outputs }),
        });
        Ok((
            format!("{}.fmi{}.fmu", table.title(), version.major()),
            bytes.map_err(|e| failed(e.to_string()))?,
        ))
    };
    versions.iter().map(one).collect()
}
