//! What is missing, as pictures.

use trueup_diagnosis::outcome::{Diagnosis, Verdict};

use super::evidence::{Evidence, EvidenceMap};
use crate::chart::{Axis, Chart, Style};
use crate::heat::Heat;
use crate::page::Page;

/// Of a spectrum what is below this part of its largest value is not drawn.
const DEPTH: f64 = 1e-9;

/// One after the other.
pub(super) fn maps(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    if e.maps.is_empty() {
        return;
    }
    let text = match d.verdict {
        Verdict::NoGap | Verdict::Parameters => {
            "The model's own equations, solved for a torque (or a reading) that would be missing in them. What is left here is \
             noise."
        }
        _ => {
            "The model's own equations, solved for the torque (or the reading) that is missing in them, without any candidate: \
             a plausible effect has this form."
        }
    };
    page.section("What is missing, without a formula", text);
    for map in &e.maps {
        match map {
            EvidenceMap::Curve { title, x, unit, before, after } => {
                let mut chart = Chart::new(title, Axis::new(x[0], x[1]), Axis::new("", unit))
                    .series("mean", &before.x, &before.mean, Style::LineAndPoints)
                    .line("95 % low", &before.x, &before.low)
                    .line("95 % high", &before.x, &before.high);
                if let Some(after) = after {
                    chart =
                        chart.series("left with the effects", &after.x, &after.mean, Style::LineAndPoints);
                }
                page.chart(&chart);
            }
            EvidenceMap::Surface { title, x, y, unit, surface } => page.heat(&Heat {
                title,
                x: *x,
                y: *y,
                unit,
                edges: [&surface.x, &surface.y],
                cells: &surface.z,
                marks: &[],
            }),
            EvidenceMap::Spectrum { title, unit, bands } => {
                let unit = format!("({unit})²/Hz");
                let least = DEPTH * bands.residual.iter().copied().fold(0.0, f64::max);
                let drawn = |v: &f64| if *v > least { *v } else { f64::NAN };
                let residual: Vec<f64> = bands.residual.iter().map(drawn).collect();
                let mut chart =
                    Chart::new(title, Axis::new("frequency", "Hz"), Axis::new("", &unit).logarithmic())
                        .line("residual", &bands.frequency, &residual)
                        .line("noise alone", &bands.frequency, &bands.floor);
                for b in &bands.bands {
                    chart = chart.band(b.low, b.high);
                }
                page.chart(&chart);
            }
            EvidenceMap::Orders { title, unit, orders } => {
                let (order, amplitude): (Vec<f64>, Vec<f64>) =
                    orders.iter().map(|o| (o.order, o.amplitude())).unzip();
                let (x, y) = (Axis::new("periods per turn", ""), Axis::new("amplitude", unit));
                page.chart(&Chart::new(title, x, y).line("amplitude", &order, &amplitude));
            }
            EvidenceMap::Course { title, recording, unit, time, value } => {
                let title = format!("{title}, {recording}");
                page.chart(&Chart::over_time(&title, unit).line("estimate", time, value));
            }
        }
    }
}
