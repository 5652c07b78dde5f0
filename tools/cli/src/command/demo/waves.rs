//! P/PI and the three wave-based laws on DELIAN's joint 2 with a flexible link, without dry friction and with current
//! without limit: what they leave of its vibration, and what a constant load makes of them.

use std::path::Path;

use super::loops::{column, run};
use super::metric;
use crate::error::CliError;
use trueup_cosim::SeriesMemory;
use trueup_report::{Chart, Page};

/// The reference plant: joint 2 with a flexible link, no dry friction, no limit of the current; bandwidths of P/PI of 60
/// and 10 rad/s; a unit step. DELIAN's comparison.
const WAVES: &str = r#"# P/PI or wave-based control of a joint with a flexible link.
connections = [
    "controller.motorCurrent -> plant.motorCurrent",
    "plant.motorAngle -> controller.motorAngle",
    "plant.motorVelocity -> controller.motorVelocity",
    "plant.loadAngle -> controller.loadAngle",
    "plant.loadVelocity -> controller.loadVelocity",
]
record = ["plant.tipAngle", "plant.loadAngle", "plant.motorAngle"]

[run]
start = 0
stop = 15
step = 1e-3

[components.plant]
fmu = "TwoMassJoint+flexible-link.fmi3.fmu"

[components.plant.start]
gearRatio = 21750.0
loadInertia = 0.5
stiffness = 2.2e-5
damping = 3.18e-8
coulombFriction = 0.0
staticFriction = 0.0
viscousFriction = 2.5e-8
tipInertia = 6.0
linkStiffness = 1555.0
linkDamping = 0.9659192512

[components.controller]
fmu = "JointController.fmi3.fmu"

[components.controller.start]
strategy = "VWBC"
positionReference = 1.0
gearRatio = 21750.0
torqueConstant = 0.02
positionGain = 2.5
velocityGain = 3406.05
velocityIntegralTime = 0.1
waveFrequency = 41.648
currentLimit = 1e6
"#;

const STRATEGIES: [(&str, &str); 4] =
    [("P/PI", "P_PI"), ("WBC", "WBC"), ("VWBC", "VWBC"), ("VWBC, washed out", "VWBC_WASHOUT")];
/// First mode with the motor locked, Hz.
const MODE: f64 = 2.388_158_46;
/// Load in N.m, and the angle in rad by which it twists the joint.
const LOAD: f64 = -30.9;
const TWIST: f64 = -LOAD / (RATIO * RATIO * 2.2e-5);
/// Of the gear, as in [`WAVES`].
const RATIO: f64 = 21750.0;

/// One run for each law.
fn runs(folder: &Path, name: &str, toml: &str, set: &[(&str, f64)]) -> Result<Vec<SeriesMemory>, CliError> {
    let one = |(_, item): &(&str, &str)| {
        let values = set.iter().map(|(name, value)| (*name, value.to_string()));
        let all: Vec<_> = values.chain([("controller.strategy", (*item).to_owned())]).collect();
        Ok(run(folder, name, toml, None, &all)?.results)
    };
    STRATEGIES.iter().map(one).collect()
}

fn chart(page: &mut Page, runs: &[SeriesMemory], title: &str, unit: &str, name: &str, factor: f64) {
    let scaled = runs.iter().map(|r| column(r, name).iter().map(|x| factor * x).collect());
    let scaled: Vec<Vec<f64>> = scaled.collect();
    let all = STRATEGIES.iter().zip(runs).zip(&scaled);
    page.chart(
        &all.fold(Chart::over_time(title, unit), |c, (((label, _), r), y)| c.line(label, r.time(), y)),
    );
}

pub(super) fn draw(folder: &Path, page: &mut Page) -> Result<(), CliError> {
    vibration(folder, page)?;
    load(folder, page)
}

fn vibration(folder: &Path, page: &mut Page) -> Result<(), CliError> {
    page.section(
        "JointController: what P/PI and wave-based control leave of a vibration",
        "DELIAN's joint 2 with a flexible link, a unit step. Conditions: no dry friction (coulombFriction and staticFriction are \
         0) and a current without limit (currentLimit 1e6 A). With dry friction, or where the amplifier saturates, the figures are \
         others: set these parameters in waves.toml and look. Vibration: root mean square of the tip angle about its moving \
         average over one period of the first mode.",
    );
    let mut rows = Vec::new();
    for (gain, wave) in [(2.5, 41.648), (2.0, 200.0)] {
        let set = [("controller.positionGain", gain), ("controller.waveFrequency", wave)];
        let all = runs(folder, "waves", WAVES, &set)?;
        let left = all.iter().map(|r| metric::vibration(column(r, "plant.tipAngle"), 1e-3, MODE));
        let left: Vec<f64> = left.collect();
        rows.extend(STRATEGIES.iter().zip(&left).map(|((name, _), v)| {
            let less = format!("{:.2} %", 100.0 * (1.0 - v / left[0]));
            vec![format!("{gain}"), format!("{wave}"), (*name).to_owned(), format!("{v:.5} rad"), less]
        }));
        if wave < 100.0 {
            chart(page, &all, "Tip angle", "rad", "plant.tipAngle", 1.0);
        }
    }
    page.table(&["K_p in 1/s", "omega_n in rad/s", "control", "vibration", "less than P/PI by"], &rows);
    Ok(())
}

fn load(folder: &Path, page: &mut Page) -> Result<(), CliError> {
    page.section(
        "A constant load: who holds the reference",
        "The same joint under the same conditions (no dry friction, current without limit), reference 0, with -30.9 N m on the \
         load. The joint twists by delta; position waves take the \
         twist for a motion and drift at -omega_n delta, velocity waves stay off by -omega_n delta / K_p, washed out \
         they do not.",
    );
    let (gain, wave) = (1.5, 30.0);
    // In one integrator: where VWBC comes to rest depends on all the way there, so also on the coupling's error.
    let toml = WAVES
        .replace(".fmu\"\n", ".fmu\"\ninterface = \"model-exchange\"\n")
        .replace("stop = 15", "stop = 30")
        .replace("positionReference = 1.0", "positionReference = 0.0")
        .replace(
            "gearRatio = 21750.0\nloadInertia",
            &format!("gearRatio = 21750.0\nexternalTorque = {LOAD}\nloadInertia"),
        );
    let set = [("controller.positionGain", gain), ("controller.waveFrequency", wave)];
    let all = runs(folder, "waves-load", &toml, &set)?;
    chart(page, &all, "Load angle", "deg", "plant.loadAngle", 1f64.to_degrees());
    let row = |((name, item), r): (&(&str, &str), &SeriesMemory)| {
        let angle = column(r, "plant.loadAngle");
        // Over the last second.
        let drift = (angle[angle.len() - 1] - angle[angle.len() - 1001]).to_degrees();
        let [drifts, error] = match *item {
            "WBC" => [-wave * TWIST, f64::NAN],
            "VWBC" => [0.0, -wave * TWIST / gain],
            _ => [0.0, 0.0],
        };
        let text = |x: f64| if x.is_nan() { "-".into() } else { format!("{:.4}", x.to_degrees()) };
        let last =
            if error.is_nan() { "-".into() } else { format!("{:.4}", angle[angle.len() - 1].to_degrees()) };
        vec![(*name).to_owned(), format!("{drift:.4}"), text(drifts), last, text(error)]
    };
    let rows: Vec<_> = STRATEGIES
        .iter()
        .zip(&all)
        .filter(|(_, r)| column(r, "plant.loadAngle").len() > 1001)
        .map(row)
        .collect();
    page.table(&["control", "drift in deg/s", "theory", "error in deg at the end", "theory"], &rows);
    Ok(())
}
