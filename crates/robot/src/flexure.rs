//! A body's link that bends, in a file of a robot: a beam, or a table of modes.

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::Flexure;
use trueup_models::space::table::{LinkTable, ModeReach, ModeTable, TabledMode};

use super::reduced::{Damping, Reduced};
use super::wrong::RobotFileError;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct BendingEntry {
    #[serde(default)]
    position: [f64; 3],
    #[serde(default = "super::panel::unturned")]
    orientation: [f64; 4],
    #[schemars(with = "Option<f64>")]
    damping_ratio: Option<Spanned<f64>>,
    /// Shapes of a beam along its x, along its y, of torsion.
    shapes: Option<[usize; 3]>,
    length: Option<f64>,
    mass_per_length: Option<f64>,
    youngs_modulus: Option<f64>,
    area_moment: Option<[f64; 2]>,
    poisson_ratio: Option<f64>,
    torsion_constant: Option<f64>,
    polar_inertia_per_length: Option<f64>,
    /// Of a table of modes.
    mass: Option<f64>,
    center_of_mass: Option<[f64; 3]>,
    inertia: Option<[[f64; 3]; 3]>,
    end: Option<[f64; 3]>,
    mode: Option<Vec<LinkModeEntry>>,
    #[schemars(with = "Option<Reduced>")]
    reduced: Option<Spanned<Reduced>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct LinkModeEntry {
    /// Hz.
    #[schemars(with = "f64")]
    frequency: Spanned<f64>,
    /// That of the link when left out.
    #[schemars(with = "Option<f64>")]
    damping_ratio: Option<Spanned<f64>>,
    participation: [f64; 6],
    end_shift: [f64; 3],
    end_turn: [f64; 3],
}

/// A link that bends.
pub(super) enum FlexibleLinkEntry {
    Beam(Flexure),
    Table(LinkTable),
}

const USUAL: [usize; 3] = [2, 2, 1];
/// Poisson's ratio of aluminium.
const METAL: f64 = 0.33;

const OF_BEAM: &str = "a beam has length, mass-per-length, youngs-modulus, area-moment, torsion-constant and polar-inertia-per-length";
const OF_TABLE: &str =
    "a table of modes has mass, center-of-mass, inertia, end, and [[body.link.mode]] or [body.link.reduced]";

impl BendingEntry {
    /// Of the body of this number (from 1) and name; the link begins at this byte.
    pub(super) fn of(
        self,
        body: usize,
        name: &str,
        begin: usize,
    ) -> Result<FlexibleLinkEntry, RobotFileError> {
        let of_table = self.mass.is_some()
            || self.center_of_mass.is_some()
            || self.inertia.is_some()
            || self.end.is_some()
            || self.mode.is_some()
            || self.reduced.is_some();
        let numbers = [
            self.length,
            self.mass_per_length,
            self.youngs_modulus,
            self.poisson_ratio,
            self.torsion_constant,
            self.polar_inertia_per_length,
        ];
        let of_beam =
            self.shapes.is_some() || self.area_moment.is_some() || numbers.iter().any(Option::is_some);
        let told = |w: RobotFileError| {
            RobotFileError::at(w.at.unwrap_or(begin), format!("`{name}`: its link: {}", w.why))
        };
        if of_table && of_beam {
            return Err(told(format!("{OF_BEAM}, {OF_TABLE}; leave one of both out").into()));
        }
        if !of_table {
            return self.beam(body).map_err(told).map(FlexibleLinkEntry::Beam);
        }
        let table = self.table(body, name).map_err(told)?;
        table.check().map_err(|why| told(why.into())).map(|()| FlexibleLinkEntry::Table(table))
    }

    fn beam(self, body: usize) -> Result<Flexure, RobotFileError> {
        let ratio = self.damping_ratio.as_ref().map(share).transpose()?;
        let need =
            |value: Option<f64>, key: &str| value.ok_or_else(|| RobotFileError::from(lacks(key, OF_BEAM)));
        let [x, y, torsion] = self.shapes.unwrap_or(USUAL);
        Ok(Flexure {
            body,
            shapes: Shapes { x, y, torsion },
            position: self.position,
            orientation: self.orientation,
            length: need(self.length, "length")?,
            mass_per_length: need(self.mass_per_length, "mass-per-length")?,
            youngs_modulus: need(self.youngs_modulus, "youngs-modulus")?,
            area_moment: self.area_moment.ok_or_else(|| lacks("area-moment", OF_BEAM))?,
            poisson_ratio: self.poisson_ratio.unwrap_or(METAL),
            torsion_constant: need(self.torsion_constant, "torsion-constant")?,
            polar_inertia_per_length: need(self.polar_inertia_per_length, "polar-inertia-per-length")?,
            damping_ratio: ratio.unwrap_or(0.0),
        })
    }

    fn table(self, body: usize, name: &str) -> Result<LinkTable, RobotFileError> {
        let ratio = self.damping_ratio.as_ref().map(share).transpose()?;
        let rows = match (self.mode, self.reduced) {
            (Some(modes), None) => {
                let all = modes.into_iter().map(|m| m.row(ratio));
                all.collect::<Result<_, _>>()?
            }
            (None, Some(set)) => {
                let begin = set.span().start;
                let damping = ratio.map_or(Damping::None, Damping::Ratio);
                set.into_inner().modes(damping, begin)?
            }
            (None, None) => return Err(lacks("[[body.link.mode]]", OF_TABLE).into()),
            (Some(_), Some(set)) => {
                let why = "its modes are given by [[body.link.mode]] and by [body.link.reduced]; leave one of both out";
                return Err(RobotFileError::at(set.span().start, why.into()));
            }
        };
        let (modes, reach) = rows.into_iter().unzip();
        Ok(LinkTable {
            body,
            table: ModeTable {
                name: name.to_owned(),
                position: self.position,
                orientation: self.orientation,
                mass: self.mass.ok_or_else(|| lacks("mass", OF_TABLE))?,
                center_of_mass: self.center_of_mass.ok_or_else(|| lacks("center-of-mass", OF_TABLE))?,
                inertia: self.inertia.ok_or_else(|| lacks("inertia", OF_TABLE))?,
                modes,
            },
            end: self.end.ok_or_else(|| lacks("end", OF_TABLE))?,
            reach,
        })
    }
}

impl LinkModeEntry {
    fn row(self, ratio: Option<f64>) -> Result<(TabledMode, ModeReach), RobotFileError> {
        let own = self.damping_ratio.as_ref().map(share).transpose()?;
        let hertz = *self.frequency.get_ref();
        if !(hertz > 0.0 && hertz.is_finite()) {
            let why = format!("frequency = {hertz}: give one above 0, Hz");
            return Err(RobotFileError::at(self.frequency.span().start, why));
        }
        let mode = TabledMode {
            frequency: std::f64::consts::TAU * hertz,
            damping_ratio: own.or(ratio).unwrap_or(0.0),
            participation: self.participation,
        };
        Ok((mode, ModeReach { shift: self.end_shift, turn: self.end_turn }))
    }
}

fn lacks(key: &str, with: &str) -> String {
    format!("`{key}` is missing; {with}; see docs/robots.md")
}

/// A damping ratio of 0 to 1.
fn share(ratio: &Spanned<f64>) -> Result<f64, RobotFileError> {
    let value = *ratio.get_ref();
    if (0.0..=1.0).contains(&value) {
        return Ok(value);
    }
    let why = format!("damping-ratio = {value}: give a share of critical damping, 0 to 1 (0.5 % is 0.005)");
    Err(RobotFileError::at(ratio.span().start, why))
}
