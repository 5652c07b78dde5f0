//! How finely what the recording does not prescribe has to be integrated.

use nalgebra::{DMatrix, Schur};
use trueup_numerics::hybrid::At;
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{LANES, Lanes};

use super::Links;
use crate::engine::subject::EngineModel;

/// Longest step of the classical Runge-Kutta method, in radians (or e-folds) of the fastest mode: an oscillation is then
/// wrong by 2e-4 of itself after a period.
const RADIANS: f64 = 0.25;

/// The fastest own mode of what is integrated, rad/s, at an instant; where derivatives are not finite: infinite.
pub(super) fn fastest(model: &EngineModel, links: &Links, at: &At<'_, f64>) -> f64 {
    let n = links.free.len();
    let lift = |v: &[f64]| v.iter().map(|v| Lanes::constant(*v)).collect::<Vec<_>>();
    let (mut x, u, p) = (lift(at.x), lift(at.u), lift(at.p));
    let mut dx = vec![Lanes::zero(); x.len()];
    let mut slope = DMatrix::zeros(n, n);
    let given: Vec<(usize, Lanes)> = links.given.iter().map(|(row, ..)| (*row, Dual::zero())).collect();
    let columns: Vec<(usize, usize)> = links.free.iter().copied().enumerate().collect();
    for group in columns.chunks(LANES) {
        group.iter().enumerate().for_each(|(lane, (_, s))| x[*s].eps[lane] = 1.0);
        model.rates_prescribed(
            At { t: Dual::constant(at.t), x: &x, u: &u, p: &p, modes: at.modes },
            &given,
            &mut dx,
        );
        for (lane, (column, s)) in group.iter().enumerate() {
            x[*s].eps[lane] = 0.0;
            for (row, &r) in links.free.iter().enumerate() {
                slope[(row, *column)] = dx[r].eps[lane];
            }
        }
    }
    if !slope.iter().all(|v| v.is_finite()) {
        return f64::INFINITY;
    }
    Schur::try_new(slope, f64::EPSILON, 1000).map_or(f64::INFINITY, |found| {
        found.complex_eigenvalues().iter().map(|v| v.norm()).fold(0.0, f64::max)
    })
}

/// Into how many parts a step of the grid is divided, at most `most`.
pub(super) fn parts(step: f64, fastest: f64, most: usize) -> usize {
    ((step * fastest / RADIANS).ceil() as usize).clamp(1, most.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::balance::GriddedRecording;
    use crate::engine::subject::DiagnosisSubject;
    use trueup_identification::run::{IdentificationRun, OutputChannel};
    use trueup_models::effect::PlantKind;
    use trueup_models::joint::{output, parameter};

    #[test]
    fn the_fastest_mode_of_a_spring_is_its_resonance() {
        let model = DiagnosisSubject::new(PlantKind::Joint, vec![true]).model(&[] as &[&str]).unwrap();
        let subject = DiagnosisSubject::new(PlantKind::Joint, vec![true]);
        let mut p = subject.defaults(&model);
        for i in [parameter::DAMPING, parameter::VISCOUS_FRICTION] {
            p[i] = 0.0;
        }
        // The motor's motion is prescribed; the load swings on the spring: deflection and load velocity are free.
        let (k, n, j) = (p[parameter::STIFFNESS], p[parameter::GEAR_RATIO], p[parameter::LOAD_INERTIA]);
        let coordinates = subject.coordinates(&model, &p);
        let t: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.002).collect();
        let motor = OutputChannel {
            name: "motorAngle".into(),
            output: output::MOTOR_ANGLE,
            y: t.iter().map(|t| (3.0 * t).sin()).collect(),
            t,
            sigma: 1e-6,
            ..OutputChannel::default()
        };
        let prescribed = GriddedRecording::new(
            &IdentificationRun { channels: vec![motor], ..IdentificationRun::default() },
            2,
            1.5,
        )
        .unwrap();
        let links = prescribed.links(&model, &coordinates);
        let (x, u) = (vec![0.0; model.sizes().states], vec![0.0; model.sizes().inputs]);
        let modes = vec![0; model.sizes().modes];
        let found = fastest(&model, &links, &At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes });
        let exact = n * (k / j).sqrt();
        assert!((found / exact - 1.0).abs() < 1e-6, "{found} {exact}");
        assert_eq!(parts(0.05, 1.0, 10), 1);
        assert_eq!(parts(0.05, 20.0, 10), 4);
        assert_eq!(parts(0.05, f64::INFINITY, 10), 10);
    }
}
