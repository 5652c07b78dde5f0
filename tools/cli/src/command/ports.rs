//! `trueup ports`

mod report;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use trueup_cosim::system::ComponentInterface;
use trueup_fmi_import::{UnpackedFmu, UsedInterface};
use trueup_ports::{Experiment, FmuPorts, FmuQuantities, check, fits, guess, insert, plant, read, write};

use crate::args::PortsCommand;
use crate::error::CliError;
use crate::output::{can_be_written, say};
use crate::voice;
use report::PortsReport;

pub(crate) fn run(args: &PortsCommand) -> Result<(), CliError> {
    let target = target(args)?;
    let fmu = UnpackedFmu::open(&args.fmu).map_err(|e| CliError::Failed(e.to_string()))?;
    let all = FmuQuantities::of(fmu.description()).map_err(|e| CliError::at(&args.fmu, e))?;
    let given = args.ports.as_ref().map(|file| given(file, &args.fmu, &all)).transpose()?;
    let mut interface = interface(args, &fmu)?;
    alone(args, &fmu)?;
    let found = Experiment::run(&fmu, &all, interface).or_else(|why| {
        // Not requested, so the other one will do.
        let other = args.interface.is_none() && interface == UsedInterface::ModelExchange;
        if !other || fmu.description().co_simulation.is_none() {
            return Err(why);
        }
        voice::note(&format!("Model Exchange: {why}; the experiments are by Co-Simulation"));
        interface = UsedInterface::CoSimulation;
        Experiment::run(&fmu, &all, interface)
    });
    let found = found.map_err(|e| CliError::Failed(e.to_string()))?;
    let name = args.fmu.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let drafted = given.is_none();
    let ports = given.unwrap_or_else(|| guess::guess(&found, &all, &name));
    let checks = check::checks(&ports, &all, &found);
    let effects = insert::insertions(&ports, &found, &checks);
    let plant = match interface {
        UsedInterface::ModelExchange => Some(plant::plant(&fmu, &ports, &all, &found)),
        UsedInterface::CoSimulation => None,
    };
    let plant = plant.transpose().map_err(|e| CliError::Failed(e.to_string()))?;
    let draft = drafted.then(|| write::write(&ports));
    if let (Some(file), Some(text)) = (&target, &draft) {
        crate::output::write(file, text.as_bytes())?;
    }
    if let (true, Some(text)) = (args.print, &draft) {
        return say(text);
    }
    let model = &fmu.description().model_name;
    let report = PortsReport {
        model,
        interface,
        ports: &ports,
        all: &all,
        checks: &checks,
        effects: &effects,
        plant: plant.as_ref(),
        draft: draft.as_deref(),
    };
    if args.json {
        return say(&format!("{:#}\n", report.json()));
    }
    let next = target.map_or_else(String::new, |file| {
        let file = file.display();
        format!(
            "\n{file}: lines with GUESS are to be checked; then: trueup ports {} --ports {file}\n",
            args.fmu.display()
        )
    });
    say(&(report.text() + &next))
}

/// Where the draft goes; refused before any work where that is a file that is there.
fn target(args: &PortsCommand) -> Result<Option<PathBuf>, CliError> {
    if args.ports.is_some() || args.print || args.json && args.output.is_none() {
        return Ok(None);
    }
    let folder = args.fmu.parent().unwrap_or(Path::new(""));
    let file = args.output.clone().unwrap_or_else(|| folder.join("ports.toml"));
    if file.exists() && !args.force {
        let why = "it is there already and stays as it is; check it with --ports, see a draft with --print, name another file with -o, or overwrite it with --force";
        return Err(CliError::at(&file, why));
    }
    can_be_written(&file)?;
    Ok(Some(file))
}

/// A user's file, without mistakes.
pub(crate) fn given(file: &Path, fmu: &Path, all: &FmuQuantities) -> Result<FmuPorts, CliError> {
    let ports = read::read(file);
    let mistakes = match &ports {
        Ok(ports) => fits::mistakes(ports, all, file, fmu),
        Err(mistakes) => mistakes.clone(),
    };
    match ports {
        Ok(ports) if mistakes.is_empty() => Ok(ports),
        _ => {
            let lines: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
            Err(CliError::Failed(lines.join("\n")))
        }
    }
}

fn interface(args: &PortsCommand, fmu: &UnpackedFmu) -> Result<UsedInterface, CliError> {
    let d = fmu.description();
    let (exchange, steps) = (d.model_exchange.is_some(), d.co_simulation.is_some());
    match args.interface {
        Some(ComponentInterface::ModelExchange) if exchange => Ok(UsedInterface::ModelExchange),
        Some(ComponentInterface::CoSimulation) if steps => Ok(UsedInterface::CoSimulation),
        None if exchange => Ok(UsedInterface::ModelExchange),
        None if steps => Ok(UsedInterface::CoSimulation),
        _ => {
            let offers: Vec<&str> = d.interfaces().map(|(name, _)| name).collect();
            let why =
                format!("it offers {} only: Model Exchange or Co-Simulation is needed", offers.join(" and "));
            Err(CliError::at(&args.fmu, why))
        }
    }
}

/// The FMU runs in a process of its own where there are any.
fn alone(args: &PortsCommand, fmu: &Arc<UnpackedFmu>) -> Result<(), CliError> {
    match crate::isolate::isolation(Some(args.deadline)) {
        Ok(isolation) => fmu.isolate(&isolation),
        Err(_) => return crate::isolate::keep(&args.fmu.display().to_string()),
    }
    #[cfg(target_os = "linux")]
    let _ = trueup_fmi_import::keeper::adopt(); // else what an FMU that crashed has started lives on
    Ok(())
}
