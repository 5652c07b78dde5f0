//! Directional derivatives are requested of what a description allows, and of nothing else: of all our FMUs, and of one with the
//! habits of the Reference FMUs, compiled here from `as_reference_fmus.c`.

use std::path::{Path, PathBuf};
use std::process::Command;

use trueup_fmi_import::{HybridFmu, UnpackedFmu};
use trueup_numerics::hybrid::At;
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{LANES, Lanes, Plant};

use super::hybrid_fmu::{Draws, begin};

const SEED: u64 = 20_261_130;

/// Derivatives of rates, outputs and indicators by the states, then the inputs: rows by columns.
fn jacobians(plant: &HybridFmu, x: &[f64], u: &[f64], p: &[f64], modes: &[i32]) -> [Vec<Vec<f64>>; 3] {
    let sizes = plant.sizes();
    let constant = |v: &[f64]| v.iter().map(|v| Dual::constant(*v)).collect::<Vec<Lanes>>();
    let (n, p) = (x.len() + u.len(), constant(p));
    let mut found = [sizes.states, sizes.outputs, sizes.indicators].map(|rows| vec![vec![0.0; n]; rows]);
    for first in (0..n).step_by(LANES) {
        let mut all = constant(&[x, u].concat());
        (first..n).take(LANES).for_each(|j| all[j].eps[j - first] = 1.0);
        let (x, u) = all.split_at(x.len());
        let at = At { t: Dual::constant(0.5), x, u, p: &p, modes };
        let mut values = [sizes.states, sizes.outputs, sizes.indicators].map(|n| vec![Lanes::default(); n]);
        plant.rates_lanes(at, &[], &mut values[0]);
        plant.outputs_lanes(at, &mut values[1]);
        plant.indicators_lanes(at, &mut values[2]);
        for (found, values) in found.iter_mut().zip(values) {
            for (row, value) in found.iter_mut().zip(values) {
                (first..n).take(LANES).for_each(|j| row[j] = value.eps[j - first]);
            }
        }
    }
    found
}

/// Largest difference of each row as a share of its largest value.
fn errors(own: &[Vec<f64>], differences: &[Vec<f64>]) -> Vec<f64> {
    let row = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let size = a.iter().chain(b).fold(1e-6, |s: f64, v| s.max(v.abs()));
        a.iter()
            .zip(b)
            .fold(0.0, |e: f64, (a, b)| if (a - b).is_nan() { f64::NAN } else { e.max((a - b).abs() / size) })
    };
    own.iter().zip(differences).map(row).collect()
}

/// Worst row, and how many there are.
fn compared(fmu: HybridFmu) -> (f64, usize) {
    let mut draws = Draws(SEED);
    let table = fmu.table();
    let p: Vec<f64> = table.parameters.iter().map(|q| q.start).collect();
    // About the inputs as the description has them.
    let u: Vec<f64> = table.inputs.iter().map(|q| q.start + 1e-3 * draws.next()).collect();
    let again = HybridFmu::new(fmu.fmu(), 0.0).unwrap().by_differences();
    let (own_modes, x) = begin(&fmu, &u, &p);
    let x: Vec<f64> = x.iter().map(|x| x + 1e-4 * draws.next()).collect();
    let own = jacobians(&fmu, &x, &u, &p, &own_modes);
    assert_eq!(fmu.failure(), None, "{}", fmu.fmu().file().display());
    let (modes, _) = begin(&again, &u, &p);
    let differences = jacobians(&again, &x, &u, &p, &modes);
    assert_eq!(again.failure(), None, "{}", fmu.fmu().file().display());
    let errors: Vec<f64> = own.iter().zip(&differences).flat_map(|(a, b)| errors(a, b)).collect();
    let worst = errors.iter().fold(0.0, |w: f64, e| if e.is_nan() { f64::INFINITY } else { w.max(*e) });
    (worst, errors.len())
}

#[test]
fn our_fmus_are_asked_for_what_they_offer() {
    let Some(folder) = std::env::var_os("TRUEUP_FMUS").map(PathBuf::from) else {
        eprintln!("SKIPPED: TRUEUP_FMUS is not set, so there is no FMU; run ./test");
        return;
    };
    println!("seed {SEED}");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "fmu"));
    files.sort();
    assert!(files.len() >= 20, "{files:?}");
    let mut worst = Vec::new();
    for file in files {
        let fmu = HybridFmu::new(&UnpackedFmu::open(&file).unwrap(), 0.0).unwrap();
        let (error, rows) = compared(fmu);
        println!(
            "{:<32}{rows:>5} rows, largest difference {error:.1e}",
            file.file_name().unwrap().to_string_lossy()
        );
        worst.push((error, file));
    }
    let wrong: Vec<_> = worst.iter().filter(|(error, _)| *error > 1e-5).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Outputs x0, x1 (states) and `product`, a local variable `sum` that the model structure does not have.
fn description(version: u32) -> String {
    let list = [
        ("x0", 0, "output", ""),
        ("der(x0)", 1, "local", "x0"),
        ("x1", 2, "output", ""),
        ("der(x1)", 3, "local", "x1"),
        ("product", 5, "output", ""),
        ("sum", 6, "local", ""),
    ];
    let mut variables = String::new();
    for (name, reference, causality, of) in list {
        let state = name == "x0" || name == "x1";
        let (initial, start) = if state { (" initial=\"exact\"", " start=\"0\"") } else { ("", "") };
        let head = format!(
            "name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\" variability=\"continuous\"{initial}"
        );
        let at = |of: &str| list.iter().position(|v| v.0 == of);
        variables += &match (version, at(of)) {
            (2, Some(of)) => {
                format!("<ScalarVariable {head}><Real derivative=\"{}\"/></ScalarVariable>", of + 1)
            }
            (2, None) => format!("<ScalarVariable {head}><Real{start}/></ScalarVariable>"),
            (_, Some(of)) => format!("<Float64 {head} derivative=\"{}\"/>", list[of].1),
            (_, None) => format!("<Float64 {head}{start}/>"),
        };
    }
    if version == 2 {
        format!(
            "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"o\" guid=\"g\" numberOfEventIndicators=\"0\"><ModelExchange modelIdentifier=\"o\" providesDirectionalDerivative=\"true\"/><ModelVariables>{variables}</ModelVariables><ModelStructure><Outputs><Unknown index=\"1\"/><Unknown index=\"3\"/><Unknown index=\"5\"/></Outputs><Derivatives><Unknown index=\"2\"/><Unknown index=\"4\"/></Derivatives></ModelStructure></fmiModelDescription>"
        )
    } else {
        format!(
            "<fmiModelDescription fmiVersion=\"3.0\" modelName=\"o\" instantiationToken=\"g\"><ModelExchange modelIdentifier=\"o\" providesDirectionalDerivatives=\"true\"/><ModelVariables>{variables}</ModelVariables><ModelStructure><Output valueReference=\"0\"/><Output valueReference=\"2\"/><Output valueReference=\"5\"/><ContinuousStateDerivative valueReference=\"1\"/><ContinuousStateDerivative valueReference=\"3\"/></ModelStructure></fmiModelDescription>"
        )
    }
}

/// That FMU; none without a C compiler, and on other systems than Linux.
pub(crate) fn oscillator(version: u32) -> Option<(tempfile::TempDir, HybridFmu)> {
    if cfg!(not(target_os = "linux")) {
        eprintln!("SKIPPED: not Linux");
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let name = match (version, std::env::consts::ARCH) {
        (2, "x86_64") => "linux64".to_owned(),
        (_, arch) => format!("{arch}-linux"),
    };
    let binaries = folder.path().join("binaries").join(name);
    std::fs::create_dir_all(&binaries).unwrap();
    std::fs::write(folder.path().join("modelDescription.xml"), description(version)).unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/as_reference_fmus.c");
    let mut compiler = Command::new("cc");
    compiler
        .args(["-shared", "-fPIC", &format!("-DFMI={version}"), "-o"])
        .arg(binaries.join("o.so"))
        .arg(source);
    if !compiler.status().is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: no C compiler (cc)");
        return None;
    }
    let fmu = HybridFmu::new(&UnpackedFmu::open(folder.path()).unwrap(), 0.0).unwrap();
    Some((folder, fmu))
}

#[test]
fn states_and_local_variables_are_not_asked_for() {
    for version in [2, 3] {
        let Some((_folder, fmu)) = oscillator(version) else { return };
        let names: Vec<&str> = fmu.table().outputs.iter().map(|q| q.name.as_str()).collect();
        assert_eq!(names, ["x0", "der(x0)", "x1", "der(x1)", "product", "sum"]);
        let (modes, _) = begin(&fmu, &[], &[]);
        let (x, v) = (1.5, -0.75);
        let [rates, outputs, _] = jacobians(&fmu, &[x, v], &[], &[], &modes);
        assert_eq!(fmu.failure(), None);
        let own = [vec![0.0, 1.0], vec![-2.0 * x * v - 1.0, 1.0 - x * x]];
        assert_eq!(rates, own);
        assert_eq!(
            outputs[..5],
            [vec![1.0, 0.0], own[0].clone(), vec![0.0, 1.0], own[1].clone(), vec![v, x]]
        );
        assert!(outputs[5].iter().all(|d| (d - 1.0).abs() < 1e-9), "{:?}", outputs[5]);
    }
}
