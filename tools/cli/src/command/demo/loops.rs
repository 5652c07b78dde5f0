//! FMUs stepped side by side with fixed steps: enough to show them at work, no master.

use std::path::Path;

use crate::error::Error;
use trueup_fmi_import::fmi2::Instance;
use trueup_fmi_import::{Experiment, Fmu, Interface, Options};

/// An output of one FMU feeds an input of another; (number of the FMU, element name).
pub(crate) struct Wire<'a> {
    pub(crate) from: (usize, &'a str),
    pub(crate) to: (usize, &'a str),
}

/// What was watched.
pub(crate) struct Recording {
    pub(crate) t: Vec<f64>,
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Recording {
    /// The samples of a watched output.
    pub(crate) fn column(&self, name: &str) -> Vec<f64> {
        let k = self.names.iter().position(|n| n == name);
        k.map(|k| self.rows.iter().map(|r| r[k]).collect()).unwrap_or_default()
    }
}

struct Unit {
    instance: Instance,
    name: String,
}

impl Unit {
    fn open(path: &Path) -> Result<Self, Error> {
        let failed = |e: trueup_fmi_import::Error| Error::at(path, e);
        let fmu = Fmu::open(path).map_err(failed)?;
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let instance = Instance::new(&fmu, Interface::CoSimulation, Options::named(&name)).map_err(failed)?;
        Ok(Self { instance, name })
    }
    fn reference(&self, name: &str) -> Result<(u32, bool), Error> {
        let fmu = self.instance.fmu().clone();
        let v = fmu
            .description()
            .find(name)
            .ok_or_else(|| Error::Failed(format!("{} has no variable {name}", self.name)))?;
        Ok((v.value_reference, v.kind.is_float()))
    }
    fn set(&mut self, name: &str, value: f64) -> Result<(), Error> {
        let (vr, real) = self.reference(name)?;
        let done = if real {
            self.instance.set_real(&[vr], &[value])
        } else {
            self.instance.set_integer(&[vr], &[value as i32])
        };
        done.map_err(|e| Error::Failed(e.to_string()))
    }
    fn get(&mut self, name: &str) -> Result<f64, Error> {
        let mut value = [0.0];
        let (vr, _) = self.reference(name)?;
        self.instance.get_real(&[vr], &mut value).map_err(|e| Error::Failed(e.to_string()))?;
        Ok(value[0])
    }
}

/// Steps the FMUs from 0 to `stop` in s. Before every step `drive` is called with the time and a setter
/// (number of the FMU, name, value); wires are then carried over, first FMU to last. The FMU with the highest
/// number sees the others' present outputs, so a controller belongs behind its plant.
pub(crate) fn run(
    fmus: &[&Path],
    wires: &[Wire],
    stop: f64,
    h: f64,
    watched: &[&str],
    drive: impl Fn(f64, &mut dyn FnMut(usize, &str, f64)),
) -> Result<Recording, Error> {
    let mut units = fmus.iter().map(|p| Unit::open(p)).collect::<Result<Vec<_>, _>>()?;
    let mut r = Recording {
        t: Vec::new(),
        names: watched.iter().map(|w| (*w).to_owned()).collect(),
        rows: Vec::new(),
    };
    let steps = (stop / h).round() as usize;
    for k in 0..=steps {
        let t = k as f64 * h;
        let mut outcome = Ok(());
        drive(t, &mut |unit, name, value| {
            if outcome.is_ok() {
                outcome = units[unit].set(name, value);
            }
        });
        outcome?;
        if k == 0 {
            for u in &mut units {
                u.instance
                    .enter_initialization_mode(Experiment::default())
                    .map_err(|e| Error::Failed(e.to_string()))?;
                u.instance.exit_initialization_mode().map_err(|e| Error::Failed(e.to_string()))?;
            }
        }
        for wire in wires {
            let value = units[wire.from.0].get(wire.from.1)?;
            units[wire.to.0].set(wire.to.1, value)?;
        }
        r.t.push(t);
        r.rows.push(
            watched
                .iter()
                .map(|name| units[0].get(name).or_else(|_| units[fmus.len() - 1].get(name)))
                .collect::<Result<_, _>>()?,
        );
        if k < steps {
            for u in &mut units {
                u.instance.do_step(t, h, true).map_err(|e| Error::Failed(e.to_string()))?;
            }
        }
    }
    Ok(r)
}
