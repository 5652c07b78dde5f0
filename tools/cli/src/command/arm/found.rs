//! The map over two joints as it was found.

use std::fmt::Write;
use std::path::Path;

use serde_json::{Value, json};
use trueup_flexibility::elements::FlexibleElement;
use trueup_flexibility::map::{PoseGrid, RestPose, UnstablePose};
use trueup_report::number;
use trueup_signals::WrittenTable;

use super::asked::ArmRequest;
use super::pose;

/// The map as it was found.
pub(super) struct ArmMapResult {
    pub(super) grid: PoseGrid,
    /// Poses at which the arm rests; the second joint changes fastest.
    pub(super) poses: Vec<RestPose>,
    pub(super) fallen: Vec<UnstablePose>,
}

impl ArmMapResult {
    /// Angles of both joints at a pose.
    pub(super) fn place(&self, pose: &RestPose) -> [f64; 2] {
        self.grid.joints.map(|j| pose.motors[j])
    }

    /// The elements, which are the same at every pose.
    pub(super) fn elements(&self) -> Vec<FlexibleElement> {
        self.poses.first().map_or_else(Vec::new, |p| p.elements.iter().map(|c| c.element).collect())
    }

    /// Of all poses.
    pub(super) fn column(&self, of: impl Fn(&RestPose) -> f64) -> Vec<f64> {
        self.poses.iter().map(of).collect()
    }

    /// The poses at which a quantity is smallest and largest, of those where it is a number.
    pub(super) fn extremes(&self, of: impl Fn(&RestPose) -> f64) -> Option<[&RestPose; 2]> {
        let all = || self.poses.iter().filter(|p| of(p).is_finite());
        let least = all().min_by(|a, b| of(a).total_cmp(&of(b)))?;
        let most = all().max_by(|a, b| of(a).total_cmp(&of(b)))?;
        Some([least, most])
    }

    /// A row for each pose; units follow the names.
    pub(super) fn table(&self) -> WrittenTable {
        let [a, b] = self.grid.joints;
        let mut columns = vec![
            (format!("joint{}_rad", a + 1), self.column(|p| p.motors[a])),
            (format!("joint{}_rad", b + 1), self.column(|p| p.motors[b])),
            ("firstMode_Hz".to_owned(), self.column(first)),
            ("tipDeflection_m".to_owned(), self.column(RestPose::tip)),
            ("droop".to_owned(), self.column(|p| p.droop)),
        ];
        for (k, element) in self.elements().into_iter().enumerate() {
            let name = element.to_string().replace(' ', "");
            columns.push((format!("{name}Deflection_rad"), self.column(|p| p.elements[k].deflection)));
            columns.push((format!("{name}Share"), self.column(|p| p.elements[k].share)));
            columns.push((format!("{name}Rise"), self.column(|p| p.elements[k].rise)));
            columns.push((format!("{name}Energy"), self.column(|p| p.elements[k].energy)));
        }
        WrittenTable { columns }
    }

    pub(super) fn json(&self, asked: &ArmRequest<'_>, files: &[&Path]) -> Value {
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

    pub(super) fn text(&self, files: &[&Path]) -> String {
        let mut out = String::new();
        for (k, file) in files.iter().enumerate() {
            let poses = if k == 0 { format!(": {} poses", self.poses.len()) } else { String::new() };
            let _ = writeln!(out, "{}{poses}", file.display());
        }
        let [a, b] = self.grid.joints.map(|j| j + 1);
        let mut told = |what: &str, unit: &str, of: fn(&RestPose) -> f64| {
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
        told("tip deflection", "m", RestPose::tip);
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
pub(super) fn first(pose: &RestPose) -> f64 {
    pose.modes.first().copied().unwrap_or(f64::NAN)
}
