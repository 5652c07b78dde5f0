//! Steps an FMU over its default experiment and prints its Float64 outputs as CSV.
//!
//! ```text
//! cargo run -p trueup-fmi-import --example run -- FILE.fmu [--me]
//! ```
//!
//! `--me`: Model Exchange, integrated by Euler's forward method, one step per line of output; a sketch of the
//! call order, no solver to rely on.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::sync::Arc;

use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::description::{DescriptionCausality, VariableType};
use trueup_fmi_import::{ExperimentSetup, InstanceOptions, UnpackedFmu, UsedInterface, fmi2, fmi3};

/// Start, stop and step in s.
struct Run {
    start: f64,
    stop: f64,
    step: f64,
    outputs: Vec<u32>,
    values: Vec<f64>,
}

impl Run {
    fn time(&self, i: u32) -> f64 {
        (self.start + f64::from(i) * self.step).min(self.stop)
    }

    fn print(&self, time: f64) {
        let values: Vec<_> = self.values.iter().map(|value| format!("{value:?}")).collect();
        println!("{time},{}", values.join(","));
    }
}

use trueup_fmi_import::fmi2::Fmi2Instance;
use trueup_fmi_import::fmi3::Fmi3Instance;

/// The same calls in both versions but for two names.
macro_rules! runs {
    ($co_simulation:ident $model_exchange:ident $instance:ident $get:ident $iterate:ident) => {
        fn $co_simulation(mut fmu: $instance, run: &mut Run) -> Result<(), Box<dyn Error>> {
            fmu.enter_initialization_mode(ExperimentSetup {
                start: run.start,
                stop: Some(run.stop),
                ..Default::default()
            })?;
            fmu.exit_initialization_mode()?;
            fmu.$get(&run.outputs, &mut run.values)?;
            run.print(run.start);
            for i in 0.. {
                let (time, end) = (run.time(i), run.time(i + 1));
                if time >= run.stop {
                    break;
                }
                let step = fmu.do_step(time, end - time, true)?;
                fmu.$get(&run.outputs, &mut run.values)?;
                run.print(step.time);
                if step.terminate || step.discarded {
                    break;
                }
            }
            Ok(fmu.terminate()?)
        }

        fn $model_exchange(
            mut fmu: $instance,
            nx: usize,
            nz: usize,
            run: &mut Run,
        ) -> Result<(), Box<dyn Error>> {
            fmu.enter_initialization_mode(ExperimentSetup {
                start: run.start,
                stop: Some(run.stop),
                ..Default::default()
            })?;
            fmu.exit_initialization_mode()?;
            let (mut x, mut rates) = (vec![0.0; nx], vec![0.0; nx]);
            let (mut z, mut before) = (vec![0.0; nz], vec![0.0; nz]);
            let (mut at_event, mut next_event) = (true, None);
            for i in 0.. {
                if at_event {
                    let info = loop {
                        let info = fmu.$iterate()?;
                        if !info.again {
                            break info;
                        }
                    };
                    next_event = info.next_event;
                    fmu.enter_continuous_time_mode()?;
                    fmu.get_event_indicators(&mut before)?;
                    if info.terminate {
                        break;
                    }
                }
                let (time, end) = (run.time(i), run.time(i + 1));
                fmu.$get(&run.outputs, &mut run.values)?;
                run.print(time);
                if time >= run.stop {
                    break;
                }
                fmu.get_continuous_states(&mut x)?;
                fmu.get_derivatives(&mut rates)?;
                x.iter_mut().zip(&rates).for_each(|(x, rate)| *x += (end - time) * rate);
                fmu.set_time(end)?;
                fmu.set_continuous_states(&x)?;
                fmu.get_event_indicators(&mut z)?;
                let crossed = z.iter().zip(&before).any(|(z, before)| (*z > 0.0) != (*before > 0.0));
                before.copy_from_slice(&z);
                let completed = fmu.completed_integrator_step(true)?;
                if completed.terminate {
                    break;
                }
                at_event = crossed || completed.event || next_event.is_some_and(|event| end >= event);
                if at_event {
                    fmu.enter_event_mode()?;
                }
            }
            Ok(fmu.terminate()?)
        }
    };
}

runs!(co_simulation2 model_exchange2 Fmi2Instance get_real new_discrete_states);
runs!(co_simulation3 model_exchange3 Fmi3Instance get_float64 update_discrete_states);

fn options() -> InstanceOptions {
    InstanceOptions {
        listener: Some(Box::new(|message| eprintln!("{message}"))),
        ..InstanceOptions::default()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let (flags, files): (Vec<_>, Vec<_>) =
        std::env::args().skip(1).partition(|argument| argument.starts_with("--"));
    let [file] = &files[..] else { return Err("usage: run FILE.fmu [--me]".into()) };
    let model_exchange = flags.iter().any(|flag| flag == "--me");
    let fmu: Arc<UnpackedFmu> = UnpackedFmu::open(file)?;
    let description = fmu.description();
    let outputs = description.variables.iter().filter(|variable| {
        variable.causality == DescriptionCausality::Output
            && variable.kind == VariableType::Float64
            && variable.dimensions.is_empty()
    });
    let outputs: Vec<_> = outputs.collect();
    let experiment = description.experiment;
    let (start, stop) = (experiment.start_time.unwrap_or(0.0), experiment.stop_time.unwrap_or(1.0));
    let mut run = Run {
        start,
        stop,
        step: experiment.step_size.unwrap_or((stop - start) / 500.0),
        values: vec![0.0; outputs.len()],
        outputs: outputs.iter().map(|v| v.value_reference).collect(),
    };
    println!("time,{}", outputs.iter().map(|v| v.name.as_str()).collect::<Vec<_>>().join(","));
    match (description.version, model_exchange) {
        (FmiVersion::V2, false) => {
            co_simulation2(fmi2::Fmi2Instance::new(&fmu, UsedInterface::CoSimulation, options())?, &mut run)
        }
        (FmiVersion::V2, true) => {
            let instance = fmi2::Fmi2Instance::new(&fmu, UsedInterface::ModelExchange, options())?;
            let (nx, nz) = (description.structure.derivatives.len(), description.event_indicators());
            model_exchange2(instance, nx, nz, &mut run)
        }
        (FmiVersion::V3, false) => {
            co_simulation3(fmi3::Fmi3Instance::co_simulation(&fmu, options(), Default::default())?, &mut run)
        }
        (FmiVersion::V3, true) => {
            let mut instance = fmi3::Fmi3Instance::model_exchange(&fmu, options())?;
            let (nx, nz) = (instance.number_of_states()?, instance.number_of_event_indicators()?);
            model_exchange3(instance, nx, nz, &mut run)
        }
    }
}
