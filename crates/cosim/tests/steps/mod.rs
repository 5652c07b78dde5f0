//! The master takes the steps that were requested: FMUs that count their calls, make one sample per call or whole internal steps and drop
//! the rest, compiled here from `counts.c`; over steps, stop times, rates, versions, circles and inputs that a seed draws.
#![cfg(target_os = "linux")]

mod draw;

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use trueup_cosim::system::{Algorithm, CosimSystem};
use trueup_cosim::{CosimError, Master, RunLog, SeriesMemory, check};
use trueup_fmi_description::FmiVersion;
use trueup_testkit::{BlockFmu, problems};

/// What an FMU declares.
#[derive(Clone, Copy, Debug)]
struct Offers {
    version: FmiVersion,
    any_step: bool,
    states: bool,
    /// FMI 3.0: `mightReturnEarlyFromDoStep`.
    early: bool,
    /// `stepSize` of the default experiment.
    default_step: Option<f64>,
    /// FMI 3.0: `fixedInternalStepSize`.
    internal: Option<f64>,
}

/// As small exporters have it: any step, and no declaration of parts of one.
const PLAIN: Offers = Offers {
    version: FmiVersion::V2,
    any_step: true,
    states: false,
    early: false,
    default_step: None,
    internal: None,
};

/// Outputs of the FMU: its value, how often it was called, the shortest and longest call, their sum, and the largest distance of a call
/// from whole internal steps, in these.
const OUTPUTS: [&str; 6] = ["y", "calls", "shortest", "longest", "covered", "rest"];
const PARAMETERS: [(&str, &str); 3] = [("kind", "0"), ("internal", "0.01"), ("gain", "0.25")];

fn description(offers: Offers) -> String {
    let attribute = |name: &str, x: Option<f64>| x.map_or(String::new(), |x| format!(" {name}=\"{x:?}\""));
    let step = attribute("stepSize", offers.default_step);
    let mut variables: Vec<(&str, &str, &str, &str)> =
        OUTPUTS.iter().map(|name| (*name, "output", "continuous", "")).collect();
    variables.extend([("u", "input", "continuous", "0"), ("d", "input", "discrete", "0")]);
    variables.extend(PARAMETERS.iter().map(|(name, start)| (*name, "parameter", "fixed", *start)));
    let start = |x: &str| if x.is_empty() { String::new() } else { format!(" start=\"{x}\"") };
    let (any, states) = (offers.any_step, offers.states);
    let mut text = String::new();
    let mut unknowns = String::new();
    match offers.version {
        FmiVersion::V2 => {
            for (r, (name, causality, variability, x)) in variables.iter().enumerate() {
                let x = start(x);
                let _ = writeln!(
                    text,
                    "<ScalarVariable name=\"{name}\" valueReference=\"{r}\" causality=\"{causality}\" variability=\"{variability}\"><Real{x}/></ScalarVariable>"
                );
            }
            for i in 1..=OUTPUTS.len() {
                let _ = write!(unknowns, "<Unknown index=\"{i}\" dependencies=\"\"/>");
            }
            format!(
                "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"counts\" guid=\"g\">\
                 <CoSimulation modelIdentifier=\"counts\" canHandleVariableCommunicationStepSize=\"{any}\" canGetAndSetFMUstate=\"{states}\"/>\
                 <DefaultExperiment startTime=\"0\"{step}/><ModelVariables>{text}</ModelVariables>\
                 <ModelStructure><Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure></fmiModelDescription>"
            )
        }
        FmiVersion::V3 => {
            for (r, (name, causality, variability, x)) in variables.iter().enumerate() {
                let x = start(x);
                let _ = writeln!(
                    text,
                    "<Float64 name=\"{name}\" valueReference=\"{r}\" causality=\"{causality}\" variability=\"{variability}\"{x}/>"
                );
            }
            let internal = attribute("fixedInternalStepSize", offers.internal);
            let early = offers.early;
            for (kind, r) in
                ["Output", "InitialUnknown"].iter().flat_map(|k| (0..OUTPUTS.len()).map(move |r| (k, r)))
            {
                let _ = write!(unknowns, "<{kind} valueReference=\"{r}\" dependencies=\"\"/>");
            }
            format!(
                "<fmiModelDescription fmiVersion=\"3.0\" modelName=\"counts\" instantiationToken=\"t\">\
                 <CoSimulation modelIdentifier=\"counts\" canHandleVariableCommunicationStepSize=\"{any}\" canGetAndSetFMUState=\"{states}\" \
                 mightReturnEarlyFromDoStep=\"{early}\"{internal}/><DefaultExperiment startTime=\"0\"{step}/>\
                 <ModelVariables>{text}</ModelVariables><ModelStructure>{unknowns}</ModelStructure></fmiModelDescription>"
            )
        }
    }
}

/// The compiled library of a version; `None`, with a message, without a C compiler.
fn library(version: FmiVersion) -> Option<&'static [u8]> {
    static BUILT: [OnceLock<Option<Vec<u8>>>; 2] = [const { OnceLock::new() }; 2];
    let (at, define) = if version == FmiVersion::V2 { (0, "-DFMI=2") } else { (1, "-DFMI=3") };
    let built = BUILT[at].get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("counts.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/steps/counts.c");
        let done = Command::new("cc")
            .args(["-shared", "-fPIC", "-O1", define, "-o"])
            .arg(&file)
            .arg(source)
            .arg("-lm")
            .status();
        done.is_ok_and(|status| status.success()).then(|| std::fs::read(&file).unwrap())
    });
    if built.is_none() {
        eprintln!("SKIPPED: no C compiler (cc)");
    }
    built.as_deref()
}

/// An unpacked FMU of this name in a folder; `None` without a C compiler.
fn unpacked(folder: &Path, name: &str, offers: Offers) -> Option<()> {
    let library = library(offers.version)?;
    let binaries = folder.join(name).join("binaries").join(offers.version.platform());
    std::fs::create_dir_all(&binaries).unwrap();
    std::fs::write(binaries.join("counts.so"), library).unwrap();
    std::fs::write(folder.join(name).join("modelDescription.xml"), description(offers)).unwrap();
    Some(())
}

/// Runs a TOML text.
fn run(folder: &Path, text: &str) -> Result<(SeriesMemory, RunLog), CosimError> {
    let file = folder.join("system.toml");
    std::fs::write(&file, text).unwrap();
    let plan = check(&CosimSystem::read(&file)?)?;
    let mut results = SeriesMemory::default();
    let log = Master::new(plan)?.run(&mut results)?;
    Ok((results, log))
}

fn last(results: &SeriesMemory, name: &str) -> f64 {
    *results.column(name).unwrap_or_else(|| panic!("no {name}")).last().unwrap()
}

/// FMUs of these names in a circle, or alone.
fn circle(names: &[&str], run: &str, each: &str) -> String {
    let mut text = String::from("connections = [");
    for (i, name) in names.iter().enumerate().filter(|_| names.len() > 1) {
        let to = names[(i + 1) % names.len()];
        // One of them turns the sign, so that it rests.
        let (factor, offset) = if i == 0 { (-1.0, 1.0) } else { (1.0, 0.0) };
        let _ = write!(
            text,
            "{{ from = \"{name}.y\", to = \"{to}.u\", factor = {factor:?}, offset = {offset:?} }},"
        );
    }
    let _ = writeln!(text, "]\n[run]\n{run}");
    for name in names {
        let _ = writeln!(text, "[components.{name}]\nfmu = \"{name}\"\n{each}");
    }
    text
}

/// A controller at 10 Hz next to a plant at 100 Hz, whichever of them may be given parts of a step.
#[test]
fn two_rates_are_exact_counts_and_are_told() {
    let declared = Offers { version: FmiVersion::V3, early: true, ..PLAIN };
    for plant in [PLAIN, declared] {
        let folder = tempfile::tempdir().unwrap();
        let made = [("ctrl", PLAIN), ("plant", plant)].map(|(name, o)| unpacked(folder.path(), name, o));
        if made.contains(&None) {
            return;
        }
        let text = circle(&["ctrl", "plant"], "stop = 5", "")
            .replace("fmu = \"ctrl\"", "fmu = \"ctrl\"\nstep = 0.1");
        let text = text.replace("fmu = \"plant\"", "fmu = \"plant\"\nstep = 0.01");
        let (results, log) = run(folder.path(), &text).unwrap();
        assert_eq!((last(&results, "ctrl.calls"), last(&results, "plant.calls")), (50.0, 500.0));
        let told: Vec<String> = log.calls.iter().map(|c| format!("{}: {}", c.component, c.calls)).collect();
        assert_eq!(told, ["ctrl: 50 calls of 0.1 s", "plant: 500 calls of 0.01 s"]);
        // Nothing between these two goes on lines: what samples neither follows nor is followed.
        assert_eq!(log.algorithm, Algorithm::Jacobi, "{}", log.reason);
    }
}

/// Parts of a step belong to FMUs that declare them, and to a requested algorithm of lines.
#[test]
fn parts_are_for_those_that_declare_them_or_ask() {
    let v3 = Offers { version: FmiVersion::V3, ..PLAIN };
    let stored = Offers { states: true, ..PLAIN };
    for (offers, algorithm, calls) in [
        (PLAIN, "", 20),
        (v3, "", 20),
        (stored, "", 20),
        // The default step is the shortest one that is known to be sound.
        (Offers { default_step: Some(0.1), ..stored }, "", 20),
        (Offers { default_step: Some(0.05), ..stored }, "", 40),
        (Offers { default_step: Some(0.05), ..PLAIN }, "", 20),
        (Offers { early: true, ..v3 }, "", 40),
        (Offers { early: true, any_step: false, ..v3 }, "", 20),
        // Parts of 0.05 s are no internal steps of 0.1 s, but two of 0.025 s.
        (Offers { early: true, internal: Some(0.1), ..v3 }, "", 20),
        (Offers { early: true, internal: Some(0.025), ..v3 }, "", 40),
        (PLAIN, "jacobi", 20),
        (PLAIN, "extrapolate", 40),
        (v3, "gauss-seidel", 40),
        (Offers { internal: Some(0.1), ..v3 }, "extrapolate", 20),
        (Offers { any_step: false, ..PLAIN }, "extrapolate", 20),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let made = ["a", "b"].map(|name| unpacked(folder.path(), name, offers));
        if made.contains(&None) {
            return;
        }
        let algorithm =
            if algorithm.is_empty() { String::new() } else { format!("algorithm = \"{algorithm}\"") };
        let text =
            circle(&["a", "b"], &format!("stop = 2\nstep = 0.1\n{algorithm}"), "start = { gain = 0.1 }");
        let (results, log) = run(folder.path(), &text).unwrap();
        // The first step has no slopes, so it is made whole, of all FMUs but those whose inputs are known at its end.
        let found = last(&results, "a.calls").max(last(&results, "b.calls"));
        assert!(
            f64::from(calls) - found <= 1.0 && found <= f64::from(calls),
            "{offers:?} {algorithm}: {found} of {calls}"
        );
        for c in &log.calls {
            assert_eq!(c.calls.total() as f64, last(&results, &format!("{}.calls", c.component)));
        }
        let expected = if calls == 20 { 0.1 } else { 0.05 };
        assert!((last(&results, "a.shortest") - expected).abs() < 1e-9, "{offers:?} {algorithm}");
        assert!((last(&results, "a.covered") - 2.0).abs() < 1e-9);
    }
}

/// An internal step is obeyed by every call, whether user or master chooses the algorithm; what cannot be obeyed is refused with the remedy.
#[test]
fn internal_steps_are_obeyed_or_the_run_is_refused() {
    let mut draw = draw::Draw::new("internal steps");
    for _ in 0..12 {
        let h = [0.1, 0.01, 0.025, 1e-3][draw.below(4)];
        let offers =
            Offers { version: FmiVersion::V3, early: draw.coin(), states: true, internal: Some(h), ..PLAIN };
        let folder = tempfile::tempdir().unwrap();
        let made = ["a", "b"].map(|name| unpacked(folder.path(), name, offers));
        if made.contains(&None) {
            return;
        }
        let (n, steps) = (1 + draw.below(6), 2 + draw.below(20));
        let step = h * n as f64;
        // The last step may be shorter, but by whole internal steps.
        let stop = step * steps as f64 + h * draw.below(n) as f64;
        let each = format!("start = {{ kind = 1, internal = {h:?}, gain = 0.05 }}");
        for algorithm in ["", "jacobi", "gauss-seidel", "extrapolate", "iterative"] {
            let line =
                if algorithm.is_empty() { String::new() } else { format!("algorithm = \"{algorithm}\"") };
            let text = circle(&["a", "b"], &format!("stop = {stop:?}\nstep = {step:?}\n{line}"), &each);
            match run(folder.path(), &text) {
                Ok((results, _)) => {
                    let rest = last(&results, "a.rest").max(last(&results, "b.rest"));
                    assert!(rest < 1e-6, "{offers:?} step {step} stop {stop} {algorithm}: {rest}");
                }
                // Repetition that does not settle takes no shorter steps of such FMUs.
                Err(error) => {
                    assert!(error.to_string().contains("takes no shorter step"), "{algorithm}: {error}")
                }
            }
        }
        let odd = step + h * (0.1 + 0.8 * draw.part());
        let refused = run(
            folder.path(),
            &circle(&["a", "b"], &format!("stop = {:?}\nstep = {odd:?}", 10.0 * odd), &each),
        );
        let said = refused.err().unwrap().to_string();
        let mend = format!(
            "choose a step of {} s or {} s",
            trueup_numerics::ShortNumber(step),
            trueup_numerics::ShortNumber(step + h)
        );
        assert!(said.contains("fixedInternalStepSize") && said.contains(&mend), "{said}");
        let refused = run(
            folder.path(),
            &circle(&["a", "b"], &format!("stop = {:?}\nstep = {step:?}", stop + 0.4 * h), &each),
        );
        let said = refused.err().unwrap().to_string();
        assert!(said.contains("fixedInternalStepSize") && said.contains("choose another stop"), "{said}");
        let text = format!("stop = {stop:?}\nstep = {step:?}\nalgorithm = \"adaptive\"");
        let said = run(folder.path(), &circle(&["a", "b"], &text, &each)).err().unwrap().to_string();
        assert!(
            said.contains("fixedInternalStepSize") && said.contains("choose another algorithm"),
            "{said}"
        );
    }
}

/// A jump of an input between communication points cuts no step of an FMU that does not declare that it may be cut, and this is reported.
#[test]
fn jumps_cut_no_step_of_a_sampler() {
    let early = Offers { version: FmiVersion::V3, early: true, ..PLAIN };
    for (offers, calls) in [(PLAIN, 10.0), (early, 11.0)] {
        let folder = tempfile::tempdir().unwrap();
        if unpacked(folder.path(), "m", offers).is_none() {
            return;
        }
        std::fs::write(folder.path().join("in.csv"), "time,m.d\n0,0\n0.33,1\n1,1\n").unwrap();
        let text = format!("inputs = \"in.csv\"\n{}", circle(&["m"], "stop = 1\nstep = 0.1", ""));
        let (results, log) = run(folder.path(), &text).unwrap();
        assert_eq!(last(&results, "m.calls"), calls, "{offers:?}");
        let told =
            log.notes.iter().any(|n| n.contains("first at 0.33 s") && n.contains("`m` is not declared"));
        assert_eq!(told, calls == 10.0, "{:?}", log.notes);
    }
}

/// With whole steps only, the middle of lines is as exact as parts: what FMU state and a default step declare.
#[test]
fn whole_steps_at_the_middle_of_lines_are_of_second_order() {
    if !trueup_testkit::compiler() {
        return;
    }
    let error = |block: fn(BlockFmu) -> BlockFmu| {
        let problem = problems::two_mass().map(block);
        let folder = tempfile::tempdir().unwrap();
        let mut text = format!(
            "connections = {:?}\n[run]\nstop = 10\nstep = 0.01\n",
            problem.connections.iter().map(|(a, b)| format!("{a} -> {b}")).collect::<Vec<_>>()
        );
        for block in &problem.blocks {
            let file = block.build(trueup_testkit::BlockVersion::Two, folder.path()).unwrap();
            let _ = writeln!(text, "[components.{}]\nfmu = {file:?}", block.name);
        }
        let (results, log) = run(folder.path(), &text).unwrap();
        let exact = problem.exact(10.0, &["left.x1", "right.x2"]).unwrap();
        let off = ["left.x1", "right.x2"].iter().zip(exact).map(|(name, x)| (last(&results, name) - x).abs());
        let calls: Vec<String> = log.calls.iter().map(|c| c.calls.to_string()).collect();
        (off.fold(0.0, f64::max), log.algorithm, calls)
    };
    let stored: fn(BlockFmu) -> BlockFmu = |b| BlockFmu { degree: 0, ..b };
    let (off, algorithm, calls) = error(stored);
    println!("FMU state and a default step of the step: {off:e}, {calls:?}");
    assert!(off < 5.3e-5 && algorithm == Algorithm::Extrapolate, "{off:e} {algorithm}");
    assert_eq!(calls, ["1000 calls of 0.01 s"; 2]);
    let (off, algorithm, calls) = error(BlockFmu::plain);
    println!("nothing declared: {off:e}, {calls:?}");
    assert!(off < 3.3e-3 && algorithm == Algorithm::Jacobi, "{off:e} {algorithm}");
    assert_eq!(calls, ["1000 calls of 0.01 s"; 2]);
}
