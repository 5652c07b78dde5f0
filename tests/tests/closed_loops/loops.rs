//! The two loops: their systems from `examples/`, run by the master, and their errors.

use std::path::{Path, PathBuf};

use trueup_cosim::system::{Algorithm, CosimSystem, StartValue};
use trueup_cosim::{Master, SeriesMemory, check};

use super::monolith;

/// A closed loop of two FMUs.
pub(crate) struct Case {
    /// In `examples/`.
    pub(crate) folder: &'static str,
    /// Of its files there.
    pub(crate) name: &'static str,
    /// Components and their FMUs.
    pub(crate) components: [(&'static str, &'static str); 2],
    /// Start values in addition to those of the file: no dry friction and no limit, so that the solution is smooth.
    pub(crate) start: &'static [(&'static str, &'static str, &'static str)],
    /// What is compared.
    pub(crate) column: &'static str,
    /// Step of the reference, rad.
    pub(crate) reference: f64,
    /// End, s.
    pub(crate) stop: f64,
    /// Longest communication step, s.
    pub(crate) longest: f64,
    /// The same column from one solver.
    pub(crate) monolith: fn(f64, &[f64]) -> Vec<f64>,
}

pub(crate) const LOOPS: &[Case] = &[
    Case {
        folder: "01-joint",
        name: "joint",
        components: [("plant", "TwoMassJoint"), ("controller", "JointController")],
        start: &[
            ("plant", "coulombFriction", "0"),
            ("plant", "staticFriction", "0"),
            ("controller", "currentLimit", "1e3"),
            ("controller", "strategy", "P_PI"),
            ("controller", "positionReference", "0.1"),
        ],
        column: "plant.loadAngle",
        reference: 0.1,
        stop: 2.0,
        longest: 2e-3,
        monolith: monolith::joint,
    },
    Case {
        folder: "02-arm",
        name: "arm",
        components: [("arm", "PlanarManipulator"), ("controller", "ManipulatorController")],
        start: &[
            ("controller", "torqueLimit[1]", "1e3"),
            ("controller", "torqueLimit[2]", "1e3"),
            ("controller", "torqueLimit[3]", "1e3"),
            ("controller", "strategy", "P_PI"),
            ("controller", "positionReference[1]", "0.2"),
        ],
        column: "arm.jointAngle[1]",
        reference: 0.2,
        stop: 10.0,
        longest: 1e-2,
        monolith: monolith::arm,
    },
];

/// The folder of the packed FMUs.
pub(crate) fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("TRUEUP_FMUS").map(PathBuf::from);
    if folder.is_none() {
        use std::io::Write as _;
        // Not println!, which the test runner keeps to itself.
        let _ =
            writeln!(std::io::stderr(), "SKIPPED: TRUEUP_FMUS is not set, so there is no FMU; run ./test");
    }
    folder
}

/// The system of `examples/<folder>/<name>.<file>` with FMUs of that version of FMI.
pub(crate) fn system(case: &Case, fmus: &Path, file: &str, version: u32) -> CosimSystem {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let mut system =
        CosimSystem::read(&examples.join(case.folder).join(format!("{}.{file}", case.name))).unwrap();
    for component in &mut system.components {
        let (_, model) = case.components.iter().find(|(name, _)| *name == component.name).unwrap();
        component.fmu = fmus.join(format!("{model}.fmi{version}.fmu"));
        let own = case.start.iter().filter(|(of, ..)| *of == component.name);
        component.start.extend(own.map(|(_, variable, value)| StartValue {
            variable: (*variable).into(),
            values: vec![(*value).into()],
            ..StartValue::default()
        }));
    }
    system.run.start = Some(0.0);
    system.run.stop = Some(case.stop);
    // Of the FMUs' own integrators: what is left is the error of the coupling.
    system.run.tolerance = Some(1e-11);
    system
}

/// The compared column at every communication point.
pub(crate) fn run(system: &CosimSystem, case: &Case) -> Vec<f64> {
    let mut memory = SeriesMemory::default();
    let mut master = Master::new(check(system).unwrap()).unwrap();
    master.run(&mut memory).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    memory.column(case.column).unwrap().to_vec()
}

/// The compared column from one solver, at the points of the longest step.
pub(crate) fn exact(case: &Case) -> Vec<f64> {
    let points = (case.stop / case.longest).round() as usize;
    let times: Vec<f64> = (0..=points).map(|k| case.longest * k as f64).collect();
    (case.monolith)(case.reference, &times)
}

/// Largest error at the points of the longest step, for each of the steps, as a share of the reference's step.
pub(crate) fn errors(
    case: &Case,
    exact: &[f64],
    fmus: &Path,
    (file, version): (&str, u32),
    algorithm: Algorithm,
    steps: &[f64],
) -> Vec<f64> {
    let error = |step: &f64| {
        let mut system = system(case, fmus, file, version);
        system.run.step = Some(*step);
        system.run.algorithm = Some(algorithm);
        let every = (case.longest / step).round() as usize;
        let found = run(&system, case);
        assert_eq!(found.len(), (exact.len() - 1) * every + 1);
        let far = found.iter().step_by(every).zip(exact).map(|(a, b)| (a - b).abs());
        far.fold(0.0, f64::max) / case.reference
    };
    steps.iter().map(error).collect()
}

/// Slope of log(error) over log(step), fitted.
pub(crate) fn order(steps: &[f64], errors: &[f64]) -> f64 {
    let points = || steps.iter().map(|h| h.ln()).zip(errors.iter().map(|e| e.ln()));
    let n = steps.len() as f64;
    let (x, y) = points().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / n, y + b / n));
    let (above, below) =
        points().fold((0.0, 0.0), |(s, t), (a, b)| (s + (a - x) * (b - y), t + (a - x) * (a - x)));
    above / below
}
