//! The Modelica Association's Reference FMUs: `TRUEUP_REFERENCE_FMUS` names a folder with `2.0/<Model>.fmu` and
//! `3.0/<Model>.fmu`, as their releases are laid out. The expected values are the files' own.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use trueup_fmi_description::archive::Archive;
use trueup_fmi_import::fmi3::{CoSimulationOptions, DerivativeOf};
use trueup_fmi_import::{
    ExperimentSetup, FmiStatus, ImportError, InstanceOptions, UnpackedFmu, UsedInterface, fmi2, fmi3,
};

/// The file of a model, or `None`, with a message.
fn file(version: u32, model: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("TRUEUP_REFERENCE_FMUS") else {
        eprintln!("SKIPPED: TRUEUP_REFERENCE_FMUS is not set to a folder of Reference FMUs");
        return None;
    };
    Some(PathBuf::from(folder).join(format!("{version}.0")).join(format!("{model}.fmu")))
}

macro_rules! open {
    ($version:expr, $model:expr) => {
        match file($version, $model) {
            Some(file) => UnpackedFmu::open(file).unwrap(),
            None => return,
        }
    };
}

fn value_reference(fmu: &UnpackedFmu, name: &str) -> u32 {
    fmu.description().find(name).unwrap().value_reference
}

/// The reference result inside the FMU: names, rows (time first).
fn reference(fmu: &UnpackedFmu, model: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let name = format!("extra/org.fmi-standard.fmi-ls-ref/{model}_out.csv");
    let bytes = Archive::open(fmu.file()).unwrap().read(&name, 1 << 20).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',').skip(1).map(str::to_owned).collect();
    let rows = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect());
    (names, rows.collect())
}

fn assert_close(expected: f64, actual: f64, what: &str) {
    assert!(
        (expected - actual).abs() <= 1e-12 * expected.abs().max(1.0),
        "{what}: {actual}, expected {expected}"
    );
}

fn experiment(rows: &[Vec<f64>]) -> ExperimentSetup {
    ExperimentSetup { tolerance: None, start: rows[0][0], stop: Some(rows[rows.len() - 1][0] + 10.0) }
}

/// Runs against the reference results, the same for both versions.
macro_rules! runs {
    ($version:literal, $me:expr, $cs:expr, $get:ident, $iterate:ident, [$(($model:literal, $solver_step:literal, $integer:literal)),*]) => {
        #[test]
        fn co_simulation_gives_the_reference_result() {
            for (model, _, integer) in [$(($model, $solver_step, $integer)),*] {
                let fmu = open!($version, model);
                let (names, rows) = reference(&fmu, model);
                let mut instance = $cs(&fmu, InstanceOptions::named(model));
                instance.enter_initialization_mode(experiment(&rows)).unwrap();
                instance.exit_initialization_mode().unwrap();
                for (i, row) in rows.iter().enumerate() {
                    if i > 0 {
                        let step = instance.do_step(rows[i - 1][0], row[0] - rows[i - 1][0], true).unwrap();
                        let end = rows[i - 1][0] + (row[0] - rows[i - 1][0]);
                        // FMI 2.0 ends a run by a discarded step.
                        assert_eq!((step.time, step.early), (end, step.terminate && $version == 2));
                    }
                    check(&mut instance, &fmu, &names, row, integer, model);
                }
                instance.terminate().unwrap();
            }
        }

        #[test]
        fn model_exchange_gives_the_reference_result_under_the_same_solver() {
            for (model, h, integer) in [$(($model, $solver_step, $integer)),*] {
                let fmu = open!($version, model);
                let (names, rows) = reference(&fmu, model);
                let mut instance = $me(&fmu, InstanceOptions::named(model));
                instance.enter_initialization_mode(experiment(&rows)).unwrap();
                instance.exit_initialization_mode().unwrap();
                let mut next_event = events(&mut instance);
                let (nx, nz) = sizes(&mut instance);
                let (mut x, mut dx) = (vec![0.0; nx], vec![0.0; nx]);
                let (mut z, mut before) = (vec![0.0; nz], vec![0.0; nz]);
                instance.get_nominals(&mut dx).unwrap();
                assert!(dx.iter().all(|nominal| *nominal > 0.0));
                instance.get_event_indicators(&mut before).unwrap();
                check(&mut instance, &fmu, &names, &rows[0], integer, model);
                let (mut steps, mut time) = (0_u32, rows[0][0]);
                for row in &rows[1..] {
                    while time + 0.5 * h < row[0] {
                        instance.get_continuous_states(&mut x).unwrap();
                        instance.get_derivatives(&mut dx).unwrap();
                        steps += 1;
                        time = rows[0][0] + f64::from(steps) * h;
                        instance.set_time(time).unwrap();
                        x.iter_mut().zip(&dx).for_each(|(x, dx)| *x += h * dx);
                        instance.set_continuous_states(&x).unwrap();
                        instance.get_event_indicators(&mut z).unwrap();
                        let crossed = z.iter().zip(&before).any(|(z, before)| (*z > 0.0) != (*before > 0.0));
                        before.copy_from_slice(&z);
                        let completed = instance.completed_integrator_step(true).unwrap();
                        if crossed || completed.event || next_event.is_some_and(|event| time >= event) {
                            instance.enter_event_mode().unwrap();
                            next_event = events(&mut instance);
                            instance.get_event_indicators(&mut before).unwrap();
                        }
                    }
                    check(&mut instance, &fmu, &names, row, integer, model);
                }
                instance.terminate().unwrap();
            }
        }

        /// Event iteration, then continuous-time mode; the next time event.
        fn events(instance: &mut Instance) -> Option<f64> {
            let next = loop {
                let info = instance.$iterate().unwrap();
                if !info.again {
                    break info.next_event;
                }
            };
            instance.enter_continuous_time_mode().unwrap();
            next
        }

        fn check(instance: &mut Instance, fmu: &UnpackedFmu, names: &[String], row: &[f64], integer: bool, model: &str) {
            for (name, expected) in names.iter().zip(&row[1..]) {
                let reference = [value_reference(fmu, name)];
                let mut real = [f64::NAN];
                if integer {
                    let mut value = [0];
                    instance.get_integer(&reference, &mut value).unwrap();
                    real = value.map(f64::from);
                } else {
                    instance.$get(&reference, &mut real).unwrap();
                }
                assert_close(*expected, real[0], &format!("{model}.{name} at {} s", row[0]));
            }
        }
    };
}

mod version3;

mod version2 {
    use super::*;
    use fmi2::Fmi2Instance as Instance;

    fn sizes(instance: &mut Instance) -> (usize, usize) {
        let description = instance.fmu().description();
        (description.structure.derivatives.len(), description.event_indicators())
    }

    runs!(
        2,
        |fmu, options| Instance::new(fmu, UsedInterface::ModelExchange, options).unwrap(),
        |fmu, options| Instance::new(fmu, UsedInterface::CoSimulation, options).unwrap(),
        get_real,
        new_discrete_states,
        [
            ("BouncingBall", 1e-3, false),
            ("VanDerPol", 1e-2, false),
            ("Dahlquist", 0.1, false),
            ("Stair", 0.2, true)
        ]
    );

    #[test]
    fn every_type_goes_through() {
        let fmu = open!(2, "Feedthrough");
        let mut instance =
            Instance::new(&fmu, UsedInterface::CoSimulation, InstanceOptions::default()).unwrap();
        assert_eq!(instance.name(), "Feedthrough");
        instance.enter_initialization_mode(ExperimentSetup::default()).unwrap();
        instance.exit_initialization_mode().unwrap();
        let v = |name: &str| [value_reference(&fmu, name)];
        instance.set_real(&v("Float64_continuous_input"), &[-1.25e-300]).unwrap();
        instance.set_integer(&v("Int32_input"), &[i32::MIN]).unwrap();
        instance.set_integer(&v("Enumeration_input"), &[2]).unwrap();
        instance.set_boolean(&v("Boolean_input"), &[true]).unwrap();
        instance.set_string(&v("String_input"), &["Gruß %s %n"]).unwrap();
        instance.do_step(0.0, 0.1, true).unwrap();
        let (mut real, mut integers, mut boolean) = ([0.0], [0; 2], [false]);
        instance.get_real(&v("Float64_continuous_output"), &mut real).unwrap();
        let outputs = [v("Int32_output")[0], v("Enumeration_output")[0]];
        instance.get_integer(&outputs, &mut integers).unwrap();
        instance.get_boolean(&v("Boolean_output"), &mut boolean).unwrap();
        assert_eq!((real, integers, boolean), ([-1.25e-300], [i32::MIN, 2], [true]));
        assert_eq!(instance.get_string(&v("String_output")).unwrap(), ["Gruß %s %n"]);
    }

    #[test]
    fn a_restored_state_continues_bit_equal() {
        let fmu = open!(2, "BouncingBall");
        let h = [value_reference(&fmu, "h")];
        let start = || {
            let mut instance =
                Instance::new(&fmu, UsedInterface::CoSimulation, InstanceOptions::named("ball")).unwrap();
            instance.enter_initialization_mode(ExperimentSetup::default()).unwrap();
            instance.exit_initialization_mode().unwrap();
            instance
        };
        let run = |instance: &mut Instance| {
            for i in 40..80 {
                instance.do_step(f64::from(i) * 0.01, 0.01, false).unwrap();
            }
            let mut value = [0.0];
            instance.get_real(&h, &mut value).unwrap();
            value[0]
        };
        let mut instance = start();
        for i in 0..40 {
            instance.do_step(f64::from(i) * 0.01, 0.01, false).unwrap();
        }
        let id = instance.save().unwrap();
        let expected = run(&mut instance);
        instance.restore(&id).unwrap();
        assert_eq!(run(&mut instance), expected);
        let bytes = instance.serialize(&id).unwrap();
        let mut other = start();
        assert!(matches!(other.restore(&id), Err(ImportError::NoSuchState { .. })));
        let copy = other.deserialize(&bytes).unwrap();
        other.restore(&copy).unwrap();
        assert_eq!(run(&mut other), expected);
        other.save_over(&copy).unwrap();
        other.free(copy).unwrap();
        instance.terminate().unwrap();
        assert!(matches!(instance.restore(&id), Err(ImportError::NoSuchState { .. })));
    }

    #[test]
    fn derivatives_of_the_oscillator() {
        let fmu = open!(2, "VanDerPol");
        let mut instance =
            Instance::new(&fmu, UsedInterface::ModelExchange, InstanceOptions::default()).unwrap();
        instance.enter_initialization_mode(ExperimentSetup::default()).unwrap();
        instance.exit_initialization_mode().unwrap();
        instance.new_discrete_states().unwrap();
        instance.enter_continuous_time_mode().unwrap();
        let (x0, x1) = (0.5, -1.5);
        instance.set_continuous_states(&[x0, x1]).unwrap();
        let v = |name: &str| value_reference(&fmu, name);
        let mut result = [0.0];
        let result_of =
            instance.directional_derivative(&[v("der(x1)")], &[v("x0"), v("x1")], &[2.0, 3.0], &mut result);
        result_of.unwrap();
        assert_eq!(result[0], 2.0 * (-2.0 * x0 * x1 - 1.0) + 3.0 * (1.0 - x0 * x0));
    }
}

#[test]
fn the_directory_lives_as_long_as_an_instance_which_may_move_between_threads() {
    let fmu = open!(3, "Dahlquist");
    let x = [value_reference(&fmu, "x")];
    let instances: Vec<_> = (0..4)
        .map(|i| {
            let name = InstanceOptions::named(format!("d{i}"));
            fmi3::Fmi3Instance::co_simulation(&fmu, name, CoSimulationOptions::default()).unwrap()
        })
        .collect();
    drop(fmu);
    let threads = instances.into_iter().map(|mut it| {
        std::thread::spawn(move || {
            it.enter_initialization_mode(ExperimentSetup::default()).unwrap();
            it.exit_initialization_mode().unwrap();
            for i in 0..10 {
                it.do_step(f64::from(i) * 0.1, 0.1, true).unwrap();
            }
            let mut value = [0.0];
            it.get_float64(&x, &mut value).unwrap();
            value[0]
        })
    });
    let threads: Vec<_> = threads.collect();
    for thread in threads {
        assert_close(0.9_f64.powi(10), thread.join().unwrap(), "x at 1 s");
    }
}

#[test]
fn what_an_fmu_does_not_offer_is_an_error() {
    let fmu = open!(3, "Clocks");
    let error = fmi3::Fmi3Instance::model_exchange(&fmu, InstanceOptions::default()).err().unwrap();
    assert!(matches!(error, ImportError::Interface { .. }), "{error}");
    let fmu = open!(2, "Dahlquist");
    let error =
        fmi3::Fmi3Instance::co_simulation(&fmu, InstanceOptions::default(), CoSimulationOptions::default())
            .err()
            .unwrap();
    assert!(error.to_string().contains("FMI 2.0"), "{error}");
}
