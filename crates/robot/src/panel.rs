//! `[[appendage]]`: a beam by its shapes, or a table of modes.

use schemars::JsonSchema;
use serde::Deserialize;
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::Appendage;
use trueup_models::space::table::{ModeTable, TabledMode};

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Panel {
    name: Option<String>,
    position: [f64; 3],
    #[serde(default = "unturned")]
    orientation: [f64; 4],
    #[serde(default)]
    damping_ratio: f64,
    /// Along x, along y, of torsion.
    shapes: Option<[usize; 3]>,
    length: Option<f64>,
    mass_per_length: Option<f64>,
    /// Along x, along y.
    bending_stiffness: Option<[f64; 2]>,
    torsion_stiffness: Option<f64>,
    polar_inertia_per_length: Option<f64>,
    mass: Option<f64>,
    center_of_mass: Option<[f64; 3]>,
    inertia: Option<[[f64; 3]; 3]>,
    mode: Option<Vec<PanelModeEntry>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct PanelModeEntry {
    /// Hz.
    frequency: f64,
    /// That of the appendage when left out.
    damping_ratio: Option<f64>,
    participation: [f64; 6],
}

/// Beams and tables of a file, each in their order.
pub(super) fn sorted(all: Vec<Panel>) -> Result<(Vec<Appendage>, Vec<ModeTable>), String> {
    let (mut beams, mut tables) = (Vec::new(), Vec::new());
    for (k, panel) in all.into_iter().enumerate() {
        let name = panel.name.clone().unwrap_or_else(|| format!("appendage {}", k + 1));
        let wrong = |why: String| format!("`{name}`: {why}");
        if panel.mode.is_some() || panel.mass.is_some() {
            tables.push(panel.table(&name).map_err(wrong)?);
        } else {
            beams.push(panel.beam(&name).map_err(wrong)?);
        }
    }
    Ok((beams, tables))
}

fn lacks(key: &str, with: &str) -> String {
    format!("`{key}` is missing; {with}; see docs/robots.md")
}

impl Panel {
    fn beam(self, name: &str) -> Result<Appendage, String> {
        let with = "a beam has shapes, length, mass-per-length, bending-stiffness, torsion-stiffness and polar-inertia-per-length, a table of modes mass, center-of-mass, inertia and [[appendage.mode]]";
        let need = |value: Option<f64>, key: &str| value.ok_or_else(|| lacks(key, with));
        let [x, y, torsion] = self.shapes.ok_or_else(|| lacks("shapes", with))?;
        if self.center_of_mass.is_some() || self.inertia.is_some() {
            return Err(
                "center-of-mass and inertia are those of a table of modes, shapes those of a beam; leave one of them out"
                    .into(),
            );
        }
        Ok(Appendage {
            name: name.to_owned(),
            shapes: Shapes { x, y, torsion },
            position: self.position,
            orientation: self.orientation,
            length: need(self.length, "length")?,
            mass_per_length: need(self.mass_per_length, "mass-per-length")?,
            bending_stiffness: self.bending_stiffness.ok_or_else(|| lacks("bending-stiffness", with))?,
            torsion_stiffness: need(self.torsion_stiffness, "torsion-stiffness")?,
            polar_inertia_per_length: need(self.polar_inertia_per_length, "polar-inertia-per-length")?,
            damping_ratio: self.damping_ratio,
        })
    }

    fn table(self, name: &str) -> Result<ModeTable, String> {
        let with = "a table of modes has mass, center-of-mass, inertia and [[appendage.mode]]";
        let of_beams =
            [self.length, self.mass_per_length, self.torsion_stiffness, self.polar_inertia_per_length];
        if self.shapes.is_some() || self.bending_stiffness.is_some() || of_beams.iter().any(Option::is_some) {
            let message = format!(
                "{with}; shapes, length and what they need are those of a beam: leave one of both out"
            );
            return Err(message);
        }
        let row = |m: PanelModeEntry| TabledMode {
            frequency: std::f64::consts::TAU * m.frequency,
            damping_ratio: m.damping_ratio.unwrap_or(self.damping_ratio),
            participation: m.participation,
        };
        Ok(ModeTable {
            name: name.to_owned(),
            position: self.position,
            orientation: self.orientation,
            mass: self.mass.ok_or_else(|| lacks("mass", with))?,
            center_of_mass: self.center_of_mass.ok_or_else(|| lacks("center-of-mass", with))?,
            inertia: self.inertia.ok_or_else(|| lacks("inertia", with))?,
            modes: self.mode.unwrap_or_default().into_iter().map(row).collect(),
        })
    }
}

/// No rotation, as a quaternion (w, x, y, z).
pub(super) fn unturned() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}
