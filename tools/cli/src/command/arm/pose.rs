//! A single pose, on the terminal.

use std::fmt::Write;

use serde_json::{Value, json};
use trueup_flexibility::elements::{Contribution, FlexibleElement, INCREMENT, squares};
use trueup_flexibility::map::RestPose;
use trueup_report::number;

use super::asked::{ArmRequest, degrees};
use super::paper::{self, TABLES};
use crate::error::CliError;
use crate::output::say;

/// Modes that are reported.
const MODES: usize = 3;

pub(super) fn run(asked: &ArmRequest<'_>) -> Result<(), CliError> {
    let pose = RestPose::of(&asked.on, &asked.motors).map_err(|e| asked.refused(&e))?;
    let beside = paper::applies(asked);
    say(&if asked.args.json {
        format!("{:#}\n", whole(asked, &pose, beside))
    } else {
        text(asked, &pose, beside)
    })
}

/// What a pose came to.
pub(super) fn json(pose: &RestPose) -> Value {
    let element = |c: &Contribution| {
        json!({
            "element": c.element.to_string(),
            "deflection": c.deflection,
            "share": c.share,
            "rise": c.rise,
            "energy": c.energy,
        })
    };
    json!({
        "pose": pose.motors,
        "modes": pose.modes.iter().take(MODES).collect::<Vec<_>>(),
        "tipDeflection": pose.tip_deflection,
        "droop": pose.droop,
        "elements": pose.elements.iter().map(element).collect::<Vec<_>>(),
        "squares": squares(pose.elements.iter().map(|c| c.rise)),
    })
}

fn whole(asked: &ArmRequest<'_>, pose: &RestPose, beside: bool) -> Value {
    let mut all = json(pose);
    all["schema"] = json!("trueup.arm-map/1");
    all["robot"] = json!(asked.design.name);
    all["gravity"] = json!(asked.gravity);
    all["payload"] = json!(asked.args.payload);
    all["stiffened"] = json!(INCREMENT);
    if beside {
        let row = |r: &paper::PaperRow| json!({"element": r.element.to_string(), "deflection": r.deflection.to_radians(), "rise": r.rise});
        let rows: Vec<Value> = TABLES.iter().map(row).collect();
        all["printed"] = json!({"elements": rows, "squares": squares(TABLES.iter().map(|r| r.rise))});
    }
    all
}

fn text(asked: &ArmRequest<'_>, pose: &RestPose, beside: bool) -> String {
    let list =
        |v: &[f64], digits: usize| v.iter().map(|x| format!("{x:.digits$}")).collect::<Vec<_>>().join(", ");
    let mut out =
        format!("{}: motors held at ({}), {}\n", asked.design.name, list(&pose.motors, 6), asked.loads());
    let modes = &pose.modes[..MODES.min(pose.modes.len())];
    let _ = writeln!(out, "modes: {} Hz", list(modes, 3));
    if let Some(d) = pose.tip_deflection {
        let _ = writeln!(out, "tip: {} m off, ({}) m", number(pose.tip()), list(&d, 5));
    }
    if pose.droop > 0.0 {
        let _ = writeln!(
            out,
            "velocity waves (VWBC) run away above {} K_p rad/s (K_p in 1/s)",
            number(1.0 / pose.droop)
        );
    }
    let _ = writeln!(out, "\n{}", head(beside));
    pose.elements.iter().for_each(|c| {
        let _ = writeln!(out, "{}", line(asked, c, beside));
    });
    let more = 100.0 * INCREMENT;
    let sum = 100.0 * squares(pose.elements.iter().map(|c| c.rise));
    let _ = writeln!(
        out,
        "\nRise: of the first mode's frequency when this element alone is {more} % stiffer; energy: its part of that of all springs in the first mode."
    );
    let _ = writeln!(
        out,
        "The rises of the frequency's square add up to {sum:.1} %; a linear conservative model allows {more} % (Rayleigh)."
    );
    if beside {
        let printed = 100.0 * squares(TABLES.iter().map(|r| r.rise));
        let _ = writeln!(
            out,
            "Those of the paper's Table 5 add up to {printed:.1} %: no linear conservative model can have them all."
        );
    }
    out
}

/// Titles of columns.
fn head(beside: bool) -> String {
    let printed = |text: &str| if beside { format!("{text:>9}") } else { String::new() };
    format!(
        "{:<26}{:>16}{}{:>9}{:>13}{}{:>10}",
        "element",
        "deflection, deg",
        printed("Table 4"),
        "share",
        format!("rise, +{} %", 100.0 * INCREMENT),
        printed("Table 5"),
        "energy"
    )
}

fn line(asked: &ArmRequest<'_>, c: &Contribution, beside: bool) -> String {
    let of = |element: FlexibleElement| TABLES.iter().find(|r| r.element == element);
    let printed = |text: Option<String>| {
        if beside { format!("{:>9}", text.unwrap_or_else(|| "-".to_owned())) } else { String::new() }
    };
    format!(
        "{:<26}{:>16.4}{}{:>7.2} %{:>11.2} %{}{:>8.2} %",
        asked.named(c.element),
        degrees(c.deflection),
        printed(of(c.element).map(|r| format!("{:.2}", r.deflection))),
        100.0 * c.share,
        percent(c.rise),
        printed(of(c.element).map(|r| format!("{:.1} %", 100.0 * r.rise))),
        100.0 * c.energy,
    )
}

/// In %; what would be written as -0.00 is 0.
fn percent(share: f64) -> f64 {
    let percent = 100.0 * share;
    if percent.abs() < 0.005 { 0.0 } else { percent }
}
