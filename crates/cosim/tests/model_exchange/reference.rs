//! The Modelica Association's Reference FMUs in Model Exchange: `TRUEUP_REFERENCE_FMUS` names a folder with
//! `2.0/<Model>.fmu` and `3.0/<Model>.fmu`. Their CSV files come from Euler's method, so the solver's own accuracy is
//! measured against exact solutions here.

use super::*;

fn open(version: u32, model: &str) -> Option<Arc<UnpackedFmu>> {
    let Some(folder) = std::env::var_os("TRUEUP_REFERENCE_FMUS") else {
        eprintln!("SKIPPED: TRUEUP_REFERENCE_FMUS is not set to a folder of Reference FMUs");
        return None;
    };
    let folder = std::path::PathBuf::from(folder);
    Some(UnpackedFmu::open(folder.join(format!("{version}.0")).join(format!("{model}.fmu"))).unwrap())
}

/// Impacts of a ball that falls from 1 m, keeps 0.7 of its speed and rests once it is slower than 0.1 m/s.
fn impacts() -> Vec<f64> {
    let (g, e) = (9.81f64, 0.7f64);
    let mut v = (2.0 * g).sqrt();
    let mut times = vec![v / g];
    loop {
        v *= e;
        if v < 0.1 {
            return times;
        }
        times.push(times[times.len() - 1] + 2.0 * v / g);
    }
}

#[test]
fn impacts_of_the_bouncing_ball_are_exact() {
    for version in [2, 3] {
        let Some(fmu) = open(version, "BouncingBall") else { return };
        for integrator in [Integrator::Explicit, Integrator::Stiff] {
            // One interval over all impacts, and many.
            for step in [3.0, 0.01] {
                let mut ball = Single::new(&fmu, integrator, TOLERANCE);
                let mut events = Vec::new();
                for i in 1..=(3.0 / step) as u32 {
                    ball.to(f64::from(i) * step, &mut (), &mut events).unwrap();
                }
                let expected = impacts();
                assert_eq!(events.len(), expected.len(), "{version} {integrator:?} {step}: {events:?}");
                let worst = events.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                eprintln!("FMI {version}, {integrator:?}, step {step} s: worst impact {worst:.1e} s");
                assert!(worst < 1e-9, "{version} {integrator:?} {step}: {worst:e} s");
            }
        }
    }
}

#[test]
fn dahlquist_follows_its_exponential() {
    for (version, reference) in [(2, 1), (3, 1)] {
        let Some(fmu) = open(version, "Dahlquist") else { return };
        for tolerance in [1e-5, 1e-8, 1e-11] {
            let mut model = Single::new(&fmu, Integrator::Automatic, tolerance);
            let mut worst = 0f64;
            for i in 1..=10 {
                let t = f64::from(i);
                model.to(t, &mut (), &mut Vec::new()).unwrap();
                worst = worst.max((model.reals(&[reference])[0] - (-t).exp()).abs());
            }
            eprintln!("FMI {version}, tolerance {tolerance:e}: worst error {worst:.1e}");
            assert!(worst < tolerance, "{version} {tolerance:e}: {worst:e}");
        }
    }
}

#[test]
fn stairs_climb_at_their_times_and_then_end() {
    for version in [2, 3] {
        let Some(fmu) = open(version, "Stair") else { return };
        let mut stair = Single::new(&fmu, Integrator::Automatic, TOLERANCE);
        let mut events = Vec::new();
        for i in 1..=45 {
            stair.to(f64::from(i) / 5.0, &mut (), &mut events).unwrap();
        }
        assert_eq!(events, (1..=9).map(f64::from).collect::<Vec<_>>(), "{version}");
    }
}
