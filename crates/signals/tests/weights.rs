//! `weight` of `[fit]`: what is read, and each mistake with its line and its remedy.

use std::path::Path;

use trueup_signals::{Case, Finding, FitWeight, SignalsError};

fn read(fit: &str) -> Result<Vec<FitWeight>, Vec<Finding>> {
    let text =
        format!("model = \"TwoMassJoint\"\ntrain = [\"run.csv\", \"b.csv\"]\nholdout = [\"h.csv\"]\n{fit}");
    match Case::parse(Path::new("case.toml"), &text, &[]) {
        Ok((case, _)) => Ok(case.weights),
        Err(SignalsError::Wrong(findings)) => Err(findings),
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn both_forms_of_a_list_are_read() {
    let inline = read(
        "[fit]\nweight = [{ start = 5, weight = 0.1 }, { end = 1.5, weight = 0, recordings = [\"b.csv\"] }]\n",
    );
    let tables = read(
        "[[fit.weight]]\nstart = 5\nweight = 0.1\n[[fit.weight]]\nend = 1.5\nweight = 0\nrecordings = [\"b.csv\"]\n",
    );
    let (inline, tables) = (inline.unwrap(), tables.unwrap());
    let figures =
        |all: &[FitWeight]| all.iter().map(|w| (w.span, w.weight, w.recordings.clone())).collect::<Vec<_>>();
    assert_eq!(figures(&inline), figures(&tables));
    assert_eq!((inline[0].line, tables[1].line), (5, 7));
    let held = |w: &FitWeight, name, t| w.holds(name, t);
    assert!(held(&inline[0], "run.csv", 5.0) && !held(&inline[0], "run.csv", 4.999));
    assert!(
        held(&inline[1], "b.csv", 1.5)
            && !held(&inline[1], "run.csv", 1.5)
            && !held(&inline[1], "b.csv", 1.6)
    );
    assert_eq!(inline[1].to_string(), "readings of b.csv until 1.5 s count for 0 each");
    assert!(read("[fit]\nweight = []\n").unwrap().is_empty());
}

#[test]
fn mistakes_have_their_line_and_their_remedy() {
    let cases: &[(&str, u64, &[&str])] = &[
        (
            "[fit]\nweight = 0.1\n",
            5,
            &["`weight` is a float, no list of tables", "weight = [{ start = 5.0, weight = 0.1 }]"],
        ),
        ("[fit]\nweight = [0.1]\n", 5, &["no list of tables"]),
        ("[fit]\nweight = [{ start = 1, weight = 2 }]\n", 5, &["`weight` is 2", "weigh the others less"]),
        (
            "[fit]\nweight = [{ start = 1, weight = -0.5 }]\n",
            5,
            &["`weight` is -0.5", "from 0 (left out) to 1"],
        ),
        ("[fit]\nweight = [{ start = 1, weight = nan }]\n", 5, &["`weight`", "no finite number"]),
        ("[[fit.weight]]\nstart = 1\n", 4, &["has no `weight`", "counts for a tenth"]),
        (
            "[[fit.weight]]\nstart = 1\nend = 1\nweight = 0.5\n",
            4,
            &["from 1 s to 1 s holds for nothing", "start below end"],
        ),
        ("[[fit.weight]]\nstart = \"now\"\nweight = 0.5\n", 5, &["`start` is a string"]),
        ("[[fit.weight]]\nweight = 0.5\n", 4, &["holds for every reading", "give `start`"]),
        (
            "[[fit.weight]]\nrecordings = [\"ran.csv\"]\nweight = 0.5\n",
            5,
            &["`ran.csv` is not in `train`", "did you mean `run.csv`"],
        ),
        (
            "[[fit.weight]]\nrecordings = [\"h.csv\"]\nweight = 0.5\n",
            5,
            &["`h.csv` is not in `train`: only what is fitted has a weight"],
        ),
        ("[[fit.weight]]\nfrom = 1\nend = 2\nweight = 0.5\n", 5, &["a stretch of weight has no `from`"]),
    ];
    for (fit, line, words) in cases {
        let findings = read(fit).expect_err(fit);
        let error = findings.iter().find(|f| f.is_error()).unwrap();
        let said = format!("{}; {}", error.what, error.mend);
        assert!(error.line == Some(*line) && words.iter().all(|w| said.contains(w)), "{fit}: {error:?}");
    }
}
