//! What is wrong in a sweep's file: line, error, and remedy.

use trueup_sweep::SweepFile;

const GOOD: &str = r#"system = "a.fmu"
design = "grid"

[factors]
a = { from = 1, to = 2, points = 3 }
b = { values = [1, 2] }

[outputs]
y = { take = "max" }
"#;

#[test]
fn each_has_its_line_and_its_mend() {
    SweepFile::parse(GOOD, "s.toml".as_ref()).unwrap();
    for (from, to, said) in [
        ("system = \"a.fmu\"\n", "", "s.toml:1: missing field `system`"),
        ("\"grid\"", "\"gird\"", "s.toml:2: unknown variant `gird`, expected one of `grid`, `list`"),
        ("points = 3", "pionts = 3", "s.toml:5: unknown field `pionts`, expected one of"),
        (", points = 3", "", "s.toml:5: `a`: how many points has it? write `points = N`"),
        ("points = 3", "points = 1", "s.toml:5: `a`: how many points has it?"),
        ("to = 2", "to = inf", "s.toml:5: `a`: `from` and `to` are finite numbers"),
        (
            "from = 1, to = 2",
            "from = -1e308, to = 1e308",
            "s.toml:5: `a`: `from` and `to` are finite numbers",
        ),
        ("points = 3", "points = 3, values = [1]", "s.toml:5: `a`: which values does it take? write either"),
        ("from = 1, to = 2, points = 3", "to = 2", "s.toml:5: `a`: which values"),
        ("from = 1,", "from = 0, spacing = \"log\",", "s.toml:5: `a`: equal ratios lead to no 0"),
        ("[1, 2]", "[1, [2]]", "s.toml:6: `b`: values are finite numbers, true, false or texts"),
        ("[1, 2]", "[]", "there is no run"),
        ("\"grid\"", "\"grid\"\nruns = 5", "s.toml:3: of a grid or a list the factors define how many"),
        ("\"grid\"", "\"sobol\"", "this design needs `runs = N`"),
        ("\"grid\"", "\"sobol\"\nruns = 5", "s.toml:6: `a`: `points` belongs to a grid"),
        ("\"grid\"", "\"list\"", "s.toml:5: `a`: a list needs `values"),
        ("b = {", "y = {", "s.toml:9: the column `y` is there already"),
        (
            "b = {",
            "b = { variable = \"a\",",
            "s.toml:6: `a` is varied by `a` already, see s.toml:5; take it out of one of the two",
        ),
        (
            "b = {",
            "b = { variable = [\"c\", \"a[2]\"],",
            "s.toml:6: `a[2]` is varied by `a` already, see s.toml:5",
        ),
        ("b = {", "b = { variable = [\"c\", \"c\"],", "s.toml:6: `b` names `c` twice; take one out"),
        ("y = {", "reason = {", "s.toml:9: the column `reason` is there already"),
        ("take = \"max\"", "take = \"time\"", "s.toml:9: `y`: the time of what? write either `above = X`"),
        ("take = \"max\"", "take = \"max\", above = 1", "s.toml:9: `y`: `above` and `below` belong to"),
        ("take = \"max\"", "take = \"most\"", "s.toml:9: unknown variant `most`, expected one of `final`"),
        ("y = { take = \"max\" }", "", "s.toml:8: [outputs] is empty"),
        ("points = 3", "points = 300000000", "are the most"),
        (
            "[factors]",
            "[run]\nalgorithm = \"jacoby\"\n\n[factors]",
            "s.toml:5: `algorithm`: there is no algorithm \"jacoby\"; did you mean `jacobi`?",
        ),
    ] {
        let text = GOOD.replacen(from, to, 1);
        assert_ne!(text, GOOD, "{from}");
        let why = SweepFile::parse(&text, "s.toml".as_ref()).unwrap_err().to_string();
        assert!(why.contains(said), "{from} -> {to}: {why}");
    }
}

#[test]
fn all_of_them_come_at_once() {
    let text = GOOD.replace(", points = 3", "").replace("take = \"max\"", "take = \"time\"");
    let why = SweepFile::parse(&text, "s.toml".as_ref()).unwrap_err().to_string();
    assert_eq!(why.lines().count(), 2, "{why}");
}

#[test]
fn lists_of_a_list_are_equally_long() {
    let text =
        GOOD.replace("\"grid\"", "\"list\"").replace("from = 1, to = 2, points = 3", "values = [1, 2, 3]");
    let why = SweepFile::parse(&text, "s.toml".as_ref()).unwrap_err().to_string();
    assert!(why.contains("here are 2 of one and 3 of another"), "{why}");
}

/// The examples of the document are sweeps.
#[test]
fn the_document_shows_what_is_read() {
    let document = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/sweeps.md");
    let text = std::fs::read_to_string(document).unwrap();
    let whole: Vec<&str> = text
        .split("```toml\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next())
        .filter(|block| block.contains("design ="))
        .collect();
    assert!(!whole.is_empty());
    for block in whole {
        SweepFile::parse(block, "docs/sweeps.md".as_ref()).unwrap();
    }
}
