//! Finished results in, one HTML file out: no network, light and dark, every chart a picture that needs no script and
//! that a script, where there is one, makes zoomable.
//!
//! ```
//! use trueup_report::{Chart, Page};
//!
//! let t: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
//! let angle: Vec<f64> = t.iter().map(|t| t.sin()).collect();
//! let mut page = Page::new("A pendulum", "Swings with little amplitude.");
//! page.section("Motion", "Both charts zoom together.");
//! page.chart(&Chart::over_time("Angle", "rad").line("pendulum", &t, &angle));
//! page.table(&["quantity", "value"], &[vec!["period".into(), "6.28 s".into()]]);
//! let html: String = page.finish();
//! assert!(html.contains("<svg"));
//! ```

mod chart;
mod diagnosis;
mod heat;
mod join;
mod number;
mod page;
mod picture;
mod scene;
mod surface;
mod svg;
mod tiles;

pub use chart::{Axis, Chart, Style};
pub use diagnosis::{
    DiagnosisFileError, DiagnosisRun, Evidence, EvidenceMap, EvidenceTrace, IntakeEvidence,
    RecordingEvidence, command_line, diagnosis_files, diagnosis_page, diagnosis_pictures, effect_name,
    sentence,
};
pub use heat::Heat;
pub use number::number;
pub use page::{Page, escape};
pub use surface::GridSurface;
pub use tiles::{Tile, Tiles};
