//! A map over two joints: a table and a page.

use std::f64::consts::PI;
use std::path::Path;
use std::time::{Duration, Instant};

use trueup_flexibility::map::{PoseGrid, weighed};
use trueup_models::space::tree::JointType;
use trueup_report::number;

use super::asked::ArmRequest;
use super::found::ArmMapResult;
use super::{page, schedule::ScheduleRequest};
use crate::error::CliError;
use crate::output::{can_be_made, folder, say, write};
use crate::stages::Stages;
use crate::voice;

/// Angles of the first and the second joint when none are given, rad, and steps between: larger angles give mirror images.
const FROM: [f64; 2] = [-PI / 2.0, -5.0 * PI / 6.0];
const TO: [f64; 2] = [PI / 2.0, 5.0 * PI / 6.0];
const STEPS: [u32; 2] = [18, 20];
/// Time between two words on how far it is.
const TELL: Duration = Duration::from_secs(2);

pub(super) fn run(asked: &ArmRequest<'_>) -> Result<(), CliError> {
    let (grid, wanted) = (grid(asked)?, ScheduleRequest::of(asked)?);
    let to = asked.args.output.as_deref().unwrap_or(Path::new("."));
    // Found out before the work.
    can_be_made(to)?;
    let found = found(asked, grid)?;
    folder(to)?;
    let (table, html) = (to.join("arm-map.csv"), to.join("arm-map.html"));
    found.table().write(&table).map_err(|e| CliError::Failed(e.to_string()))?;
    write(&html, page::html(asked, &found).as_bytes())?;
    let mut files = vec![table.as_path(), html.as_path()];
    let follow = to.join("arm-schedule.toml");
    if let Some(wanted) = wanted {
        write(&follow, wanted.toml(asked, &found).as_bytes())?;
        files.push(&follow);
    }
    say(&if asked.args.json { format!("{:#}\n", found.json(asked, &files)) } else { found.text(&files) })
}

/// The joints (from 0) that are varied, and how.
fn grid(asked: &ArmRequest<'_>) -> Result<PoseGrid, CliError> {
    let n = asked.design.links.len();
    let usage = |why: String| Err(CliError::Usage(why));
    let joints = match asked.args.joints.as_deref() {
        Some(&[a, b]) if a != b && [a, b].iter().all(|j| (1..=n).contains(j)) => [a - 1, b - 1],
        Some(list) => {
            let given = list.iter().map(usize::to_string).collect::<Vec<_>>().join(",");
            return usage(format!(
                "--joints {given}: give two different joints of 1 to {n}, as in --joints 1,2"
            ));
        }
        None => match weighed(&asked.on, &asked.motors).map_err(|e| asked.refused(&e))?[..] {
            [a, b, ..] => [a, b],
            _ => {
                return usage(format!(
                    "of the {n} joints less than two change what the weight does: name two, as in --joints 1,2"
                ));
            }
        },
    };
    let slides = joints.iter().find(|j| asked.design.links[**j].joint == JointType::Prismatic);
    if let Some(j) = slides.filter(|_| asked.args.from.is_none() || asked.args.to.is_none()) {
        return usage(format!("joint {} slides: give the range with --from and --to, in m", j + 1));
    }
    let ends = |name: &str, given: &Option<Vec<f64>>, otherwise: [f64; 2]| match given.as_deref() {
        None => Ok(otherwise),
        Some(&[a, b]) if a.is_finite() && b.is_finite() => Ok([a, b]),
        Some(list) => Err(CliError::Usage(format!(
            "--{name} has {} numbers: give a finite one for each of both joints, rad (m of prismatic ones)",
            list.len()
        ))),
    };
    let from = ends("from", &asked.args.from, FROM)?;
    let to = ends("to", &asked.args.to, TO)?;
    if let Some(k) = (0..2).find(|k| from[*k] >= to[*k]) {
        return usage(format!(
            "joint {} would go from {} to {}: let --from be below --to",
            joints[k] + 1,
            number(from[k]),
            number(to[k])
        ));
    }
    let steps = match asked.args.steps.as_deref() {
        None => STEPS,
        Some(&[both]) => [both; 2],
        Some(&[a, b]) => [a, b],
        Some(list) => {
            return usage(format!("--steps has {} numbers: give one for each of both joints", list.len()));
        }
    };
    Ok(PoseGrid::even(joints, from, to, steps.map(|s| s as usize)))
}

fn found(asked: &ArmRequest<'_>, grid: PoseGrid) -> Result<ArmMapResult, CliError> {
    let count = grid.count();
    let (mut stages, mut told): (Option<Stages>, _) = (None, Instant::now());
    let poses = grid.poses(&asked.on, &asked.motors, |done| {
        if told.elapsed() >= TELL {
            told = Instant::now();
            let what = format!("{done} of {count} poses");
            stages.get_or_insert_with(Stages::new).tell(done as f64 / count as f64, &what);
        }
    });
    drop(stages);
    let (poses, fallen) = poses.map_err(|e| asked.refused(&e))?;
    let found = ArmMapResult { grid, poses, fallen };
    if let Some((at, why)) = found.fallen.first() {
        let fallen = found.fallen.len();
        let [a, b] = found.grid.joints.map(|j| j + 1);
        let first = format!("joint {a} at {}, joint {b} at {}: {why}", number(at[0]), number(at[1]));
        if found.poses.is_empty() {
            return Err(CliError::at(&asked.args.robot, format!("no rest at any of {count} poses; {first}")));
        }
        voice::note(&format!("no rest at {fallen} of {count} poses, which are left out; the first: {first}"));
    }
    Ok(found)
}
