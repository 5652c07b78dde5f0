//! Broken recordings and cases, each with its finding: severity, kind, place, and the remedy.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, clippy::type_complexity)]

use std::fmt::Write as _;

use crate::common::{HEALTHY, found, joint, says, with_links};
use trueup_signals::{Case, FindingKind, Severity, SignalVariable, SignalsError, VariableRole};

#[test]
fn files_that_cannot_be_read_as_they_are() {
    use FindingKind::*;
    let utf16: Vec<u8> = "\u{feff}time,x\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let latin = b"time,winkel_\xb0\n0,1\n";
    let broken: &[(&str, &[u8], FindingKind, &[&str])] = &[
        ("empty", b"", EmptyFile, &["run.csv", "the file is empty", "export"]),
        ("header alone", b"time,motorAngle\n", EmptyFile, &["no row after the header"]),
        ("UTF-16", &utf16, Encoding, &["UTF-16", "save it as UTF-8"]),
        ("binary", b"PK\x03\x04\0\0\0\0", Encoding, &["zero bytes", "CSV"]),
        ("Latin-1 header", latin, Encoding, &["run.csv:1", "not UTF-8"]),
        ("Latin-1 cell", b"time,motorAngle\n0,1\xb0\n", Encoding, &["run.csv:2", "motorAngle", "not UTF-8"]),
        ("blanks", b"time motorAngle\n0 1\n", Separator, &["run.csv:1", "separated by blanks", "commas"]),
        (
            "both marks",
            b"time;motorAngle\n0;1.5\n1;2,5\n",
            NotANumber,
            &["run.csv:3", "decimal comma here", "point in line 2"],
        ),
        ("thousands", b"time;motorAngle\n0;1\n1;1.234,5\n", NotANumber, &["run.csv:3", "\"1.234,5\""]),
        ("no header", b"0,1,2\n0.1,1,2\n", NoHeader, &["run.csv:1", "name the columns", "time"]),
        ("nameless column", b",time,motorAngle\n0,0,1\n", NoHeader, &["column 1 has no name", "index"]),
        (
            "decimal commas",
            b"time,motorAngle\n0,5,1,5\n",
            RaggedRow,
            &["run.csv:2", "4 cells under 2", "point"],
        ),
        ("quoted decimal comma", b"time,motorAngle\n0,\"1,5\"\n", NotANumber, &["\"1,5\"", "0.5, not 0,5"]),
        (
            "short row",
            b"time,motorCurrent,motorAngle\n0,0,0\n1,1\n",
            RaggedRow,
            &["run.csv:3", "2 cells under 3"],
        ),
        ("a word", b"time,motorAngle\n0,1\n1,oops\n", NotANumber, &["run.csv:3", "motorAngle", "\"oops\""]),
        ("array cell", b"time,motorAngle\n0,1 2\n1,1 2 3\n", ArrayCell, &["run.csv:3", "3 values", "2 in"]),
        (
            "twice a name",
            b"time,motorAngle,motorAngle\n0,1,2\n",
            DuplicateName,
            &["two columns", "`motorAngle`"],
        ),
        (
            "twice a name under comments",
            b"# bench 3\n# by hand\ntime,motorAngle,motorAngle\n0,1,2\n",
            DuplicateName,
            &["run.csv:3", "two columns"],
        ),
        (
            "a word under comments",
            b"# bench 3\n# time,motorAngle\n0,1\n1,oops\n",
            NotANumber,
            &["run.csv:4", "motorAngle", "\"oops\""],
        ),
        ("no time", b"t,motorAngle\n0,1\n", NoTime, &["no column `time`", "rename `t`", "\"t\" = \"time\""]),
        ("time is NaN", b"time,motorAngle\n0,1\nnan,2\n", MissingTime, &["run.csv:3", "remove the row"]),
        ("time is empty", b"time,motorAngle\n0,1\n,2\n", MissingTime, &["run.csv:3"]),
        (
            "clock back",
            b"time,motorAngle\n0,1\n2,1\n1,1\n",
            ClockBack,
            &["run.csv:4", "from 2 s to 1 s", "sort"],
        ),
        (
            "constant clock",
            b"time,motorAngle\n0,1\n1,1\n1,1\n1,2\n2,1\n",
            ClockRepeats,
            &["run.csv:4", "repeats 1 s", "3 rows", "rate = N"],
        ),
        (
            "coarse clock",
            b"time,motorAngle\n0,1\n0,1\n1,1\n1,2\n",
            ClockRepeats,
            &["run.csv:3", "2 of 2 times", "rate = N"],
        ),
        (
            "no date",
            b"time,motorAngle\nsoon,1\nlater,2\n",
            NotANumber,
            &["run.csv:2", "\"soon\"", "nor a date"],
        ),
        ("infinite", b"time,motorAngle\n0,1\n1,inf\n", InfiniteValue, &["run.csv:3", "motorAngle at 1 s"]),
        ("overflow", b"time,motorAngle\n0,1\n1,1e999\n", InfiniteValue, &["run.csv:3"]),
        ("no value", b"time,motorAngle\n0,\n1,nan\n", NoValue, &["motorAngle", "no value"]),
    ];
    for (label, bytes, kind, parts) in broken {
        says(label, &found(&[("run.csv", bytes)], &joint(), &[]), Severity::Error, *kind, parts);
    }
}

#[test]
fn other_formats() {
    use FindingKind::*;
    let case = |name: &str| format!("model = \"TwoMassJoint\"\ntrain = [\"{name}\"]\n");
    let v73 = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".to_vec();
    let mut truncated = b"MATLAB 5.0 MAT-file".to_vec();
    truncated.resize(126, b' ');
    truncated.extend(b"IM\x0f\0\0\0\xff\0\0\0abc");
    let broken: &[(&str, &str, &[u8], FindingKind, &[&str])] = &[
        (
            "not Parquet",
            "run.parquet",
            b"time,x\n",
            Unreadable,
            &["run.parquet", "no Parquet file", "pandas"],
        ),
        (
            "MAT 7.3 cut off",
            "run.mat",
            &v73,
            Unreadable,
            &["no MAT file of level 5 or 7.3", "'-v7'", "savemat"],
        ),
        ("HDF5 that is none", "run.mat", b"\x89HDF\r\n\x1a\nabc", Unreadable, &["HDF5 (MAT 7.3)", "'-v7'"]),
        ("no MAT", "run.mat", b"hello", Unreadable, &["no MAT file of level 5"]),
        ("truncated MAT", "run.mat", &truncated, EmptyFile, &["no numeric array"]),
        (
            "unknown format",
            "run.xlsx",
            b"PK",
            Unreadable,
            &["`.xlsx` is no recording", ".csv, .parquet, .mat, .h5 or .mcap"],
        ),
        ("packed", "run.csv.gz", b"\x1f\x8b", Unreadable, &["`.gz`", "unpack"]),
    ];
    for (label, name, bytes, kind, parts) in broken {
        let case = case(name);
        let files: &[(&str, &[u8])] = &[("case.toml", case.as_bytes()), (name, bytes)];
        says(label, &found(files, &joint(), &[]), Severity::Error, *kind, parts);
    }
}

#[test]
fn sidecars() {
    use FindingKind::*;
    let broken: &[(&str, &str, FindingKind, &[&str])] = &[
        ("syntax", "[columns\n", Syntax, &["run.toml:1"]),
        (
            "unknown key",
            "[colums]\nx = 1\n",
            UnknownKey,
            &["run.toml:1", "`colums`", "did you mean `columns`"],
        ),
        (
            "unknown column",
            "\n[columns]\nmotorAngel = \"motorAngle\"\n",
            UnknownColumn,
            &["run.toml:3", "did you mean `motorAngle`"],
        ),
        (
            "unknown variable",
            "[columns]\nmotorAngle = \"rotorAngle\"\n",
            UnknownColumn,
            &["run.toml:2", "did you mean `motorAngle`"],
        ),
        (
            "no unit",
            "[columns]\nmotorAngle = { unit = \"degrees\" }\n",
            Unit,
            &["run.toml:2", "`degrees` is no unit", "deg"],
        ),
        (
            "wrong unit",
            "[columns]\nmotorAngle = { unit = \"N.m\" }\n",
            Unit,
            &["run.toml:2", "`N.m` cannot be the unit", "`rad`"],
        ),
        (
            "volts for amperes",
            "[columns]\nmotorCurrent = { unit = \"V\" }\n",
            Unit,
            &["`V` cannot be", "`scale` from V to A"],
        ),
        (
            "frequency for speed",
            "[columns]\nmotorAngle = { variable = \"motorVelocity\", unit = \"Hz\" }\n",
            Unit,
            &["`Hz` cannot be"],
        ),
        (
            "time in degrees",
            "[columns]\ntime = { variable = \"time\", unit = \"deg\" }\n",
            Unit,
            &["`deg` is no unit of time"],
        ),
        ("scale of text", "[columns]\nmotorAngle = { scale = \"2\" }\n", BadValue, &["`scale`", "number"]),
        ("scale 0", "[columns]\nmotorAngle = { scale = 0 }\n", BadValue, &["`scale` is 0"]),
        (
            "one variable twice",
            "[columns]\nmotorCurrent = \"motorAngle\"\n",
            DuplicateName,
            &["two columns are `motorAngle`"],
        ),
        (
            "unknown channel",
            "[channels.loadAngle]\nnoise = 1\n",
            UnknownChannel,
            &["run.toml:1", "no channel `loadAngle`"],
        ),
        (
            "unknown sensor key",
            "[channels.motorAngle]\nresolutoin = 1\n",
            UnknownKey,
            &["did you mean `resolution`"],
        ),
        ("negative noise", "[channels.motorAngle]\nnoise = -1\n", BadValue, &["`noise` is -1", "below 0"]),
        ("offset", "[channels.motorAngle]\noffset = 0.1\n", BadValue, &["\"estimate\"", "[columns]"]),
        (
            "interpolation",
            "[channels.motorAngle]\ninterpolation = \"cubic\"\n",
            BadValue,
            &["\"linear\" or \"hold\""],
        ),
        (
            "unknown parameter",
            "[parameters]\nstifness = 1\n",
            UnknownParameter,
            &["run.toml:2", "did you mean `stiffness`"],
        ),
        ("output as parameter", "[parameters]\nloadAngle = 1\n", UnknownParameter, &["no parameter"]),
    ];
    for (label, text, kind, parts) in broken {
        let files: &[(&str, &[u8])] = &[("run.csv", HEALTHY.as_bytes()), ("run.toml", text.as_bytes())];
        says(label, &found(files, &joint(), &[]), Severity::Error, *kind, parts);
    }
    let both: &[(&str, &[u8])] = &[("run.csv", HEALTHY.as_bytes()), ("run.toml", b""), ("run.csv.toml", b"")];
    says("two sidecars", &found(both, &joint(), &[]), Severity::Error, DuplicateName, &["another sidecar"]);
}

#[test]
fn cases() {
    use FindingKind::*;
    use Severity::*;
    let train = "train = [\"run.csv\"]\n";
    let with = |more: &str| format!("model = \"TwoMassJoint\"\n{train}{more}");
    let broken: &[(&str, String, Severity, FindingKind, &[&str])] = &[
        ("no model", train.into(), Error, UnknownModel, &["no `model`", "TwoMassJoint"]),
        ("no train", "model = \"x\"\n".into(), Error, NoTraining, &["train = ["]),
        (
            "train no list",
            "model = \"x\"\ntrain = \"run.csv\"\n".into(),
            Error,
            BadValue,
            &["case.toml:2", "no list"],
        ),
        (
            "hold-out in train",
            with("holdout = [\"run.csv\"]\n"),
            Error,
            HoldoutInTrain,
            &["case.toml:3", "`run.csv`"],
        ),
        ("same data held out", with("holdout = [\"copy.csv\"]\n"), Error, HoldoutInTrain, &["same samples"]),
        (
            "same data twice",
            "model = \"x\"\ntrain = [\"run.csv\", \"copy.csv\"]\n".into(),
            Warning,
            SameRecording,
            &["count twice"],
        ),
        (
            "named twice",
            "model = \"x\"\ntrain = [\"run.csv\", \"run.csv\"]\n".into(),
            Warning,
            SameRecording,
            &["twice in `train`"],
        ),
        (
            "missing file",
            with("holdout = [\"gone.csv\"]\n"),
            Error,
            MissingFile,
            &["gone.csv", "write its name"],
        ),
        (
            "lonely repeat",
            with("repeats = [[\"run.csv\"]]\n"),
            Error,
            BadValue,
            &["group of one", "two runs"],
        ),
        ("repeats no lists", with("repeats = \"run.csv\"\n"), Error, BadValue, &["no list of lists"]),
        (
            "repeats a list",
            with("repeats = [\"run.csv\", \"other.csv\"]\n"),
            Error,
            BadValue,
            &["case.toml:3", "no list of lists", "repeats = [[\"run.csv\", \"other.csv\"]]"],
        ),
        (
            "fit of an empty list",
            with("[fit]\nparameters = []\n"),
            Error,
            BadValue,
            &["case.toml:4", "nothing to estimate", "remove the line to fit the usual ones"],
        ),
        (
            "other repeat",
            with("repeats = [[\"run.csv\", \"other.csv\"]]\n"),
            Warning,
            RepeatDiffers,
            &["other.csv", "motorCurrent", "differs from that of run.csv by"],
        ),
        (
            "longer repeat",
            with("repeats = [[\"run.csv\", \"long.csv\"]]\n"),
            Warning,
            RepeatDiffers,
            &["long.csv", "lasts 9 s"],
        ),
        (
            "not at rest",
            with("rest = [\"long.csv\"]\n"),
            Warning,
            NotAtRest,
            &["long.csv", "motorAngle", "declared at rest"],
        ),
        (
            "unknown key",
            with("[parameter]\n"),
            Error,
            UnknownKey,
            &["case.toml:3", "did you mean `parameters`"],
        ),
        (
            "unknown parameter",
            with("[parameters]\nstifness = 1\n"),
            Error,
            UnknownParameter,
            &["case.toml:4", "did you mean `stiffness`"],
        ),
        (
            "array and element",
            with("[parameters]\nlinkMass = [1.0, 2.0]\n\"linkMass[1]\" = 2.0\n"),
            Error,
            DuplicateName,
            &["two values"],
        ),
        (
            "parameter not finite",
            with("[parameters]\nstiffness = inf\n"),
            Error,
            BadValue,
            &["stiffness", "finite"],
        ),
        (
            "uncertainty of nothing",
            with("[uncertain]\nstiffness = 0.1\n"),
            Error,
            UnknownParameter,
            &["has no value of it"],
        ),
        (
            "negative uncertainty",
            with("[parameters]\nstiffness = 1\n[uncertain]\nstiffness = -0.1\n"),
            Error,
            BadValue,
            &["-0.1", "10 %"],
        ),
        (
            "fit of nothing",
            with("[fit]\nparameters = [\"dampin\"]\n"),
            Error,
            UnknownParameter,
            &["did you mean `damping`"],
        ),
        (
            "unknown channel",
            with("[channels.motorAngel]\n"),
            Error,
            UnknownChannel,
            &["did you mean `motorAngle`"],
        ),
        ("no noise", with(""), Warning, NoNoise, &["motorAngle", "noise", "rest"]),
        (
            "delay beyond the recording",
            with("[channels.motorAngle]\ndelay = -1e9\n"),
            Error,
            BadValue,
            &["run.csv", "motorAngle", "its delay is -1000000000 s, the recording lasts 2 s"],
        ),
        (
            "hardly a motion",
            with("[channels.motorAngle]\nnoise = 100.0\n"),
            Warning,
            LittleExcitation,
            &["motorAngle", "errs by 100", "larger or longer"],
        ),
        ("not UTF-8", String::new(), Error, Encoding, &["case.toml", "not UTF-8"]),
    ];
    let mut long = String::from("time,motorCurrent,motorAngle\n");
    for i in 0..40 {
        writeln!(long, "{},1,{}", f64::from(i) * 9.0 / 39.0, f64::from(i * i) * 0.1).unwrap();
    }
    let other = HEALTHY.replace("1,1,1", "1,-3,1");
    for (label, text, severity, kind, parts) in broken {
        let case = if text.is_empty() { b"model = \"\xff\"".as_slice() } else { text.as_bytes() };
        let files = [
            ("case.toml", case),
            ("run.csv", HEALTHY.as_bytes()),
            ("copy.csv", HEALTHY.as_bytes()),
            ("other.csv", other.as_bytes()),
            ("long.csv", long.as_bytes()),
        ];
        says(label, &found(&files, &with_links(), &[]), *severity, *kind, parts);
    }
}

#[test]
fn many_mistakes_of_one_kind_are_counted() {
    let mut text = String::from("time,motorAngle\n");
    (0..400).for_each(|i| writeln!(text, "{i},x").unwrap());
    let findings = found(&[("run.csv", text.as_bytes())], &joint(), &[]);
    assert_eq!(
        findings.iter().filter(|f| f.kind == FindingKind::NotANumber).count(),
        6,
        "five and a word of the rest"
    );
    says("many", &findings, Severity::Error, FindingKind::NotANumber, &["more of this kind"]);
}

#[test]
fn what_is_no_case_is_named_in_few_lines() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, text: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, text).unwrap();
        match Case::read(&file, &joint()) {
            Err(SignalsError::Wrong(findings)) => findings,
            other => panic!("{name}: {other:?}"),
        }
    };
    for name in ["run.csv", "run.tsv", "RUN.TXT", "run.csv.zst", "run.mcap", "run.parquet", "run.mat"] {
        let findings = read(name, HEALTHY);
        assert_eq!(findings.len(), 1, "{name}: {findings:?}");
        says(name, &findings, Severity::Error, FindingKind::Unreadable, &[name, "no case", "train ="]);
    }
    let findings = read("case.toml", &"no TOML at all\n".repeat(400));
    assert_eq!(findings.len(), 6, "five and a line on the rest");
    says("no TOML", &findings, Severity::Error, FindingKind::Syntax, &["case.toml:5", "395 more mistakes"]);
}

#[test]
fn kinds_have_names_for_machines() {
    assert_eq!(FindingKind::ClockBack.id(), "clock-back");
    assert_eq!(FindingKind::NotANumber.id(), "not-a-number");
    assert_eq!(SignalVariable::new("x", "", VariableRole::Input).nominal, None);
}
