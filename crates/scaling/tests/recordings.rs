//! Recordings.

use trueup_scaling::{ScalingLaw, UnitDimension, recording};

fn scaled(text: &str, back: bool) -> Result<String, String> {
    let law = ScalingLaw { lambda: 0.5, back, given: Vec::new() };
    let mut out = Vec::new();
    let of = |name: &str| match name {
        "force" => law.of(name, UnitDimension::named("N")).map_err(|e| e.to_string()),
        "angle" => law.of(name, UnitDimension::named("rad")).map_err(|e| e.to_string()),
        _ => Err("it names no variable".to_owned()),
    };
    recording::scale("r.csv".as_ref(), text.as_bytes(), &mut out, &law, of).map_err(|e| e.to_string())?;
    Ok(String::from_utf8(out).unwrap())
}

#[test]
fn time_and_columns_scale_and_gaps_stay() {
    let text = "time,force,angle\n0.0,8.0,0.1\n1.0,,nan\n1.0,-4.0,0.3\n";
    let there = scaled(text, false).unwrap();
    assert_eq!(there, "time,force,angle\n0.0,2.0,0.1\n0.5,,nan\n0.5,-1.0,0.3\n");
    assert_eq!(scaled(&there, true).unwrap(), text);
}

#[test]
fn mistakes_name_line_and_column() {
    for (text, said) in [
        ("t,force\n0,1\n", "r.csv: line 1: the first column is `time`"),
        (
            "time,torque,mass\n0,1,2\n",
            "r.csv: line 1: column `torque`: it names no variable\nr.csv: line 1: column `mass`",
        ),
        ("time,force\n0,1\n1\n", "r.csv: line 3: "),
        (
            "time,force\n0,1\n1,1.0 2.0\n",
            "r.csv: line 3: column `force`: \"1.0 2.0\" is no number; write one",
        ),
    ] {
        let why = scaled(text, false).unwrap_err();
        assert!(why.starts_with(said), "{why}");
    }
}
