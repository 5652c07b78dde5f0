//! A map over two joints: a table and a page.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use trueup_flexibility::elements::Element;
use trueup_flexibility::map::{Fallen, Grid, Pose, weighed};
use trueup_models::space::tree::Joint;
use trueup_report::number;
use trueup_signals::Table;

use super::asked::Asked;
use super::{page, pose, schedule::Wanted};
use crate::error::Error;
use crate::output::{can_be_made, folder, say, write};
use crate::stages::Stages;
use crate::voice;

/// Angles of the first and the second joint when none are given, rad, and steps between: larger angles give mirror images.
const FROM: [f64; 2] = [-PI / 2.0, -5.0 * PI / 6.0];
const TO: [f64; 2] = [PI / 2.0, 5.0 * PI / 6.0];
const STEPS: [u32; 2] = [18, 20];
/// Time between two words on how far it is.
const TELL: Duration = Duration::from_secs(2);

/// The map as it was found.
pub(super) struct Found {
    pub(super) grid: Grid,
    /// Poses at which the arm rests; the second joint changes fastest.
    pub(super) poses: Vec<Pose>,
    pub(super) fallen: Vec<Fallen>,
}

pub(super) fn run(asked: &Asked<'_>) -> Result<(), Error> {
    let (grid, wanted) = (grid(asked)?, Wanted::of(asked)?);
    let to = asked.args.output.as_deref().unwrap_or(Path::new("."));
    // Found out before the work.
    can_be_made(to)?;
    let found = found(asked, grid)?;
    folder(to)?;
    let (table, html) = (to.join("arm-map.csv"), to.join("arm-map.html"));
    found.table().write(&table).map_err(|e| Error::Failed(e.to_string()))?;
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
fn grid(asked: &Asked<'_>) -> Result<Grid, Error> {
    let n = asked.design.links.len();
    let usage = |why: String| Err(Error::Usage(why));
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
    let slides = joints.iter().find(|j| asked.design.links[**j].joint == Joint::Prismatic);
    if let Some(j) = slides.filter(|_| asked.args.from.is_none() || asked.args.to.is_none()) {
        return usage(format!("joint {} slides: say from where to where with --from and --to, in m", j + 1));
    }
    let ends = |name: &str, given: &Option<Vec<f64>>, otherwise: [f64; 2]| match given.as_deref() {
        None => Ok(otherwise),
        Some(&[a, b]) if a.is_finite() && b.is_finite() => Ok([a, b]),
        Some(list) => Err(Error::Usage(format!(
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
    Ok(Grid::even(joints, from, to, steps.map(|s| s as usize)))
}

fn found(asked: &Asked<'_>, grid: Grid) -> Result<Found, Error> {
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
    let found = Found { grid, poses, fallen };
    if let Some((at, why)) = found.fallen.first() {
        let fallen = found.fallen.len();
        let [a, b] = found.grid.joints.map(|j| j + 1);
        let first = format!("joint {a} at {}, joint {b} at {}: {why}", number(at[0]), number(at[1]));
        if found.poses.is_empty() {
            return Err(Error::at(&asked.args.robot, format!("no rest at any of {count} poses; {first}")));
        }
        voice::note(&format!("no rest at {fallen} of {count} poses, which are left out; the first: {first}"));
    }
    Ok(found)
}

impl Found {
    /// Angles of both joints at a pose.
    pub(super) fn place(&self, pose: &Pose) -> [f64; 2] {
        self.grid.joints.map(|j| pose.motors[j])
    }

    /// The elements, which are the same at every pose.
    pub(super) fn elements(&self) -> Vec<Element> {
        self.poses.first().map_or_else(Vec::new, |p| p.elements.iter().map(|c| c.element).collect())
    }

    /// Of all poses.
    pub(super) fn column(&self, of: impl Fn(&Pose) -> f64) -> Vec<f64> {
        self.poses.iter().map(of).collect()
    }

    /// The poses at which a quantity is smallest and largest, of those where it is a number.
    pub(super) fn extremes(&self, of: impl Fn(&Pose) -> f64) -> Option<[&Pose; 2]> {
        let all = || self.poses.iter().filter(|p| of(p).is_finite());
        let least = all().min_by(|a, b| of(a).total_cmp(&of(b)))?;
        let most = all().max_by(|a, b| of(a).total_cmp(&of(b)))?;
        Some([least, most])
    }

    /// A row for each pose; units follow the names.
    fn table(&self) -> Table {
        let [a, b] = self.grid.joints;
        let mut columns = vec![
            (format!("joint{}_rad", a + 1), self.column(|p| p.motors[a])),
            (format!("joint{}_rad", b + 1), self.column(|p| p.motors[b])),
            ("firstMode_Hz".to_owned(), self.column(first)),
            ("tipDeflection_m".to_owned(), self.column(Pose::tip)),
            ("droop".to_owned(), self.column(|p| p.droop)),
        ];
        for (k, element) in self.elements().into_iter().enumerate() {
            let name = element.to_string().replace(' ', "");
            columns.push((format!("{name}Deflection_rad"), self.column(|p| p.elements[k].deflection)));
            columns.push((format!("{name}Share"), self.column(|p| p.elements[k].share)));
            columns.push((format!("{name}Rise"), self.column(|p| p.elements[k].rise)));
            columns.push((format!("{name}Energy"), self.column(|p| p.elements[k].energy)));
        }
        Table { columns }
    }

    fn json(&self, asked: &Asked<'_>, files: &[&Path]) -> Value {
        let file = |k: usize| files.get(k).map(|f| f.display().to_string());
        let left = self.fallen.iter().map(|(at, why)| json!({"at": at, "why": why.to_string()}));
        json!({
            "schema": "trueup.arm-map/1",
            "robot": asked.design.name,
            "gravity": asked.gravity,
            "payload": asked.args.payload,
            "joints": self.grid.joints.map(|j| j + 1),
            "angles": self.grid.at,
            "table": file(0),
            "page": file(1),
            "schedule": file(2),
            "poses": self.poses.iter().map(pose::json).collect::<Vec<_>>(),
            "leftOut": left.collect::<Vec<_>>(),
        })
    }

    fn text(&self, files: &[&Path]) -> String {
        let mut out = String::new();
        for (k, file) in files.iter().enumerate() {
            let poses = if k == 0 { format!(": {} poses", self.poses.len()) } else { String::new() };
            let _ = writeln!(out, "{}{poses}", file.display());
        }
        let [a, b] = self.grid.joints.map(|j| j + 1);
        let mut told = |what: &str, unit: &str, of: fn(&Pose) -> f64| {
            let Some(ends) = self.extremes(of) else { return };
            let [low, high] = ends.map(|p| {
                let [x, y] = self.place(p).map(number);
                format!(
                    "{} {unit} at joint {a} = {x}, joint {b} = {y}",
                    number(settled(of(p), 1e-3 * ROUNDING))
                )
            });
            let _ = writeln!(out, "{what}: from {low} to {high}");
        };
        told("first mode", "Hz", first);
        told("tip deflection", "m", Pose::tip);
        out
    }
}

/// Below this much in mm, deg or % it is rounding.
pub(super) const ROUNDING: f64 = 1e-6;

/// 0 for what is rounding.
pub(super) fn settled(value: f64, rounding: f64) -> f64 {
    if value.abs() < rounding { 0.0 } else { value }
}

/// Of the modes, Hz.
pub(super) fn first(pose: &Pose) -> f64 {
    pose.modes.first().copied().unwrap_or(f64::NAN)
}
