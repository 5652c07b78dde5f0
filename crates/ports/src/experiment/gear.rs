//! How a motor and a link are coupled.

use super::{Experiment, ObservedMotion, RestPoint};

/// A motor and a link that move together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GearFit {
    /// Turns of the motor per turn of the link.
    pub ratio: f64,
    /// Difference of two determinations of it, relative.
    pub error: f64,
    /// One coordinate: there is no spring between them.
    pub rigid: bool,
}

/// Two determinations that are further apart give no ratio.
const LARGEST: f64 = 0.1;

impl Experiment {
    /// Motor angle and velocity against link angle and velocity (outputs); `None`: they are not coupled, or it cannot be
    /// determined. `drive`: the input that turns the motor.
    pub fn gear(&self, motor: [usize; 2], link: [usize; 2], drive: usize) -> Option<GearFit> {
        match (&self.rest, &self.motion) {
            (Some(rest), ObservedMotion::Points(_)) => at_rest(rest, motor, link),
            _ => self.along(motor, link, drive),
        }
    }

    /// By the run with the drive's step alone: both have to go the same way.
    fn along(&self, [qm, _]: [usize; 2], [ql, _]: [usize; 2], drive: usize) -> Option<GearFit> {
        let (_, rows) = self.alone.get(drive)?.as_ref()?;
        let first = rows.first()?;
        let ratio = |row: &Vec<f64>| (row[qm] - first[qm]) / (row[ql] - first[ql]);
        let (early, late) = (ratio(rows.get(rows.len() / 2)?), ratio(rows.last()?));
        let same = rows.iter().skip(1).map(ratio).all(|r| (r - late).abs() <= 1e-6 * late.abs());
        let error = (early - late).abs() / late.abs();
        (late.is_finite() && late > 0.0 && error.is_finite()).then_some(GearFit {
            ratio: late,
            error,
            rigid: same,
        })
    }
}

/// The spring's torque depends on angle of the motor less ratio times angle of the link: both equations of motion show the ratio.
fn at_rest(rest: &RestPoint, [qm, vm]: [usize; 2], [ql, vl]: [usize; 2]) -> Option<GearFit> {
    let (m, l) = (&rest.outputs[qm], &rest.outputs[ql]);
    let acting: Vec<usize> = (0..m.len()).filter(|i| m[*i] != 0.0 || l[*i] != 0.0).collect();
    let product = |a: &[f64], b: &[f64]| acting.iter().map(|i| a[*i] * b[*i]).sum::<f64>();
    let (mm, ml, ll) = (product(m, m), product(m, l), product(l, l));
    if mm == 0.0 || ll == 0.0 {
        return None;
    }
    // One coordinate: the rows are parallel.
    if (1.0 - ml * ml / (mm * ll)).abs() < 1e-9 {
        let ratio = ml / ll;
        return (ratio > 0.0).then_some(GearFit { ratio, error: 0.0, rigid: true });
    }
    let by = |flow: &[f64]| {
        let (fm, fl, ff) = (product(flow, m), product(flow, l), product(flow, flow));
        let determinant = mm * ll - ml * ml;
        let (on_motor, on_link) = ((fm * ll - fl * ml) / determinant, (fl * mm - fm * ml) / determinant);
        let rest: f64 = acting.iter().map(|i| (flow[*i] - on_motor * m[*i] - on_link * l[*i]).powi(2)).sum();
        (ff > 0.0 && rest < 1e-6 * ff).then_some([on_motor, on_link])
    };
    // The motor may stick: then it does not accelerate.
    let motor = by(&rest.flows[vm]).map(|[on_motor, on_link]| -on_link / on_motor);
    let [on_motor, on_link] = by(&rest.flows[vl])?;
    let ratio = -on_link / on_motor;
    if !(on_motor > 0.0 && ratio.is_finite() && ratio > 0.0) {
        return None;
    }
    let error = motor.map_or(0.0, |other| ((other - ratio) / ratio).abs());
    (error < LARGEST).then_some(GearFit { ratio: motor.unwrap_or(ratio), error, rigid: false })
}
