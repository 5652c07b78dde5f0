//! Tables of quantities.

use trueup_scaling::{ScalingLaw, table};

const TABLE: &str = r#"# SIM2
target = { value = 7900, unit = "kg" } # of the LAR and all
port = { value = [5.0, 1.3], unit = "m" }
name = "SIM2"
rigid = true

[contact]
stiffness = { value = 20000, unit = "N/m" }
ratio = { value = 3, unit = "1" }
"#;

fn scaled(text: &str, back: bool) -> Result<String, String> {
    let law = ScalingLaw { lambda: 0.3, back, given: Vec::new() };
    table::scaled(text, "t.toml".as_ref(), &law).map_err(|e| e.to_string())
}

#[test]
fn numbers_change_where_they_stand_and_nothing_else_does() {
    let there = scaled(TABLE, false).unwrap();
    let by_hand =
        TABLE.replace("7900", "213.3").replace("[5.0, 1.3]", "[1.5, 0.39]").replace("20000", "6000.0");
    assert_eq!(there, by_hand);
    let back = scaled(&there, true).unwrap();
    assert_eq!(back, TABLE.replace("7900", "7900.0").replace("20000", "20000.0"));
}

#[test]
fn mistakes_have_their_line_and_their_mend() {
    for (from, to, said) in [
        (
            "{ value = 7900, unit = \"kg\" }",
            "7900",
            "t.toml:2: `target` has no unit, so its scale is not defined; write { value",
        ),
        ("[contact]", "[contact]\nk = [1, 2]", "t.toml:8: `contact.k` has no unit"),
        (
            "unit = \"N/m\"",
            "unit = \"N/mm3x\"",
            "t.toml:8: `contact.stiffness` in N/mm3x: its unit is not known",
        ),
        (
            "unit = \"N/m\"",
            "unit = \"V\"",
            "t.toml:8: `contact.stiffness` in V: the scale of A is not defined; give an exponent with --exponent A=W",
        ),
        ("value = 20000", "value = \"much\"", "t.toml:8: `contact.stiffness` is no quantity; write { value"),
        (", unit = \"N/m\"", "", "t.toml:8: `contact.stiffness` is no quantity"),
        ("name =", "name", "t.toml:4: "),
    ] {
        let text = TABLE.replacen(from, to, 1);
        assert_ne!(text, TABLE);
        let why = scaled(&text, false).unwrap_err();
        assert!(why.starts_with(said), "{why}");
    }
    let two = TABLE.replace("unit = \"N/m\"", "unit = \"V\"").replace("unit = \"kg\"", "unit = \"A\"");
    assert_eq!(scaled(&two, false).unwrap_err().lines().count(), 2);
}
