//! `trueup gearbox`

use serde::Deserialize;
use serde_json::json;
use trueup_models::gearbox::{Stage, printed_damping, series};
use trueup_report::number;

use crate::args::Gearbox;
use crate::error::CliError;
use crate::output::say;

/// The file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
struct GearboxFile {
    motor_inertia: Option<f64>,
    load_inertia: Option<f64>,
    planetary: StageTable,
    #[serde(rename = "harmonic-drive")]
    harmonic_drive: StageTable,
}

/// A stage of it; stiffness and damping at its input.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StageTable {
    #[serde(default)]
    inertia: f64,
    stiffness: f64,
    #[serde(default)]
    damping: f64,
    ratio: f64,
}

impl StageTable {
    fn stage(&self, name: &str) -> Result<Stage<f64>, String> {
        let wrong = |what: &str, value: f64, range: &str| {
            Err(format!("[{name}] {what} = {value} is refused: write a number {range}"))
        };
        for (what, value) in [("inertia", self.inertia), ("damping", self.damping)] {
            if !(0.0..f64::INFINITY).contains(&value) {
                return wrong(what, value, "of 0 or more");
            }
        }
        if !(self.stiffness > 0.0 && self.stiffness.is_finite()) {
            return wrong("stiffness", self.stiffness, "above 0, N.m/rad at the stage's input");
        }
        if !(1.0..f64::INFINITY).contains(&self.ratio) {
            return wrong("ratio", self.ratio, "of 1 or more: turns of the input per turn of the output");
        }
        let StageTable { inertia, stiffness, damping, ratio } = *self;
        Ok(Stage { inertia, stiffness, damping, ratio })
    }
}

const MEND: &str = "give a TOML file with [planetary] and [harmonic-drive]: inertia (kg.m2), stiffness (N.m/rad), damping (N.m.s/rad), all at the stage's input, and ratio";

pub(crate) fn run(args: &Gearbox) -> Result<(), CliError> {
    let text = crate::input::text(&args.file, MEND)?;
    let file: GearboxFile = toml::from_str(&text)
        .map_err(|e| CliError::at(&args.file, format!("{}; {MEND}", e.to_string().trim_end())))?;
    let stage =
        |table: &StageTable, name: &str| table.stage(name).map_err(|why| CliError::at(&args.file, why));
    let planetary = stage(&file.planetary, "planetary")?;
    let harmonic_drive = stage(&file.harmonic_drive, "harmonic-drive")?;
    for (name, value) in [("motorInertia", file.motor_inertia), ("loadInertia", file.load_inertia)] {
        if let Some(value) = value.filter(|v| !(*v > 0.0 && v.is_finite())) {
            let what = format!("{name} = {value} is refused: write kg.m2 above 0, or leave it out");
            return Err(CliError::at(&args.file, what));
        }
    }
    let none = f64::NAN;
    let e = series(
        &planetary,
        &harmonic_drive,
        file.motor_inertia.unwrap_or(none),
        file.load_inertia.unwrap_or(none),
    );
    let printed = printed_damping(&planetary, &harmonic_drive);
    let known = |value: f64| value.is_finite().then_some(value);
    let at_load = e.stiffness * e.ratio * e.ratio;
    // What the planetary gear gives of the whole compliance, motor side.
    let share = e.stiffness / planetary.stiffness;
    if args.json {
        let all = json!({
            "schema": "trueup.gearbox/1",
            "gearRatio": {"value": e.ratio, "unit": "1"},
            "stiffness": {"value": e.stiffness, "unit": "N.m/rad"},
            "damping": {"value": e.damping, "unit": "N.m.s/rad"},
            "motorInertia": {"value": known(e.motor_inertia), "unit": "kg.m2"},
            "loadInertia": {"value": known(e.load_inertia), "unit": "kg.m2"},
            "stiffnessAtLoad": {"value": at_load, "unit": "N.m/rad"},
            "printedDamping": {"value": printed, "unit": "N.m.s/rad"},
            "planetaryShareOfCompliance": share,
        });
        return say(&format!("{all:#}\n"));
    }
    let mut text =
        "# Both stages as one, for TwoMassJoint: motor side, but for loadInertia\n[parameters]\n".to_owned();
    let inertias = [("motorInertia", e.motor_inertia), ("loadInertia", e.load_inertia)];
    let all = [("gearRatio", e.ratio), ("stiffness", e.stiffness), ("damping", e.damping)]
        .into_iter()
        .chain(inertias);
    for (name, value) in all.filter(|(_, value)| value.is_finite()) {
        text += &format!("{name} = {}\n", number(value));
    }
    text += &format!(
        "# {} N.m/rad at the load; {:.1} % of the compliance is in the planetary gear\n# S3 prints a damping of {} N.m.s/rad, which is no series of two stages\n",
        number(at_load),
        100.0 * share,
        number(printed)
    );
    say(&text)
}
