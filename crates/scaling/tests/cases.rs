//! Cases.

use trueup_scaling::{GivenExponent, ScalingLaw, case};
use trueup_signals::{SignalVariable, VariableRole};

const CASE: &str = r#"model = "TwoMassJoint" # DELIAN
train = ["r.csv"]

[parameters]
stiffness = 8 # N.m/rad
torqueConstant = 2.0
linkMass = [4.0, 3.0]
flexible = [true, false]

[uncertain]
stiffness = 0.1

[channels.motorCurrent]
noise = 0.5
delay = 0.002
offset = "estimate"
"#;

fn variables() -> Vec<SignalVariable> {
    let of = |name: &str, unit: &str| SignalVariable::new(name, unit, VariableRole::Parameter);
    vec![
        of("stiffness", "N.m/rad"),
        of("torqueConstant", "N.m/A"),
        of("motorCurrent", "A"),
        of("linkMass[1]", "kg"),
        of("linkMass[2]", "kg"),
        of("damping", "N.m.s/rad"),
        of("gearRatio", "1"),
    ]
}

fn scaled(text: &str, given: &[(&str, f64)]) -> Result<String, String> {
    let given =
        given.iter().map(|(name, exponent)| GivenExponent { name: (*name).into(), exponent: *exponent });
    let law = ScalingLaw { lambda: 0.5, back: false, given: given.collect() };
    let left_out = [("damping".to_owned(), 16.0), ("gearRatio".to_owned(), 3.0)];
    case::scaled(text, "case.toml".as_ref(), &law, &variables(), &left_out).map_err(|e| e.to_string())
}

/// By hand, with amperes as they are: N.m and N.m/rad 1/8, kg 1/8, N.m.s/rad 1/16, s 1/2.
#[test]
fn parameters_sensors_and_what_is_left_out() {
    let by_hand = CASE
        .replace("stiffness = 8 ", "stiffness = 1.0 ")
        .replace("torqueConstant = 2.0", "torqueConstant = 0.25")
        .replace("[4.0, 3.0]", "[0.5, 0.375]")
        .replace("[true, false]\n", "[true, false]\ndamping = 1.0\n")
        .replace("0.002", "0.001");
    assert_eq!(scaled(CASE, &[("A", 0.0)]).unwrap(), by_hand);
}

/// Times of stretches of `weight` scale as times, the weights do not.
#[test]
fn stretches_of_weight_scale_in_time() {
    let head = CASE.split("[channels").next().unwrap();
    let of = |a: &str, b: &str| {
        [
            format!(
                "{head}[fit]\nparameters = [\"stiffness\"]\nweight = [{{ start = {a}, end = {b}, weight = 0.25 }}]\n"
            ),
            format!(
                "{head}[[fit.weight]]\nstart = {a}\nweight = 0.25\n[[fit.weight]]\nend = {b}\nweight = 0.5\n"
            ),
        ]
    };
    for (full, small) in of("5.0", "8.0").iter().zip(of("2.5", "4.0")) {
        let text = scaled(full, &[("A", 0.0)]).unwrap();
        let from = |text: &str| text[text.find("[fit").unwrap()..].to_owned();
        assert_eq!(from(&text), from(&small));
    }
}

#[test]
fn mistakes_have_their_line_and_their_mend() {
    let why = scaled(CASE, &[]).unwrap_err();
    let lines: Vec<&str> = why.lines().collect();
    assert!(lines[0].starts_with("case.toml:6: `torqueConstant`: in N.m/A: the scale of A is not defined; give an exponent with --exponent A=W"), "{why}");
    assert!(lines[1].starts_with("case.toml:14: `noise` of `motorCurrent`: in A: the scale of A"), "{why}");
    assert_eq!(lines.len(), 2);
    let why = scaled(&format!("{CASE}gain = 2.0\n[effects]\nbacklash = 1\n"), &[("A", 0.0)]).unwrap_err();
    assert!(why.contains("case.toml:17: `gain` of `motorCurrent`: it cannot be scaled"), "{why}");
    assert!(why.contains("`effects` cannot be scaled; take it out"), "{why}");
}
