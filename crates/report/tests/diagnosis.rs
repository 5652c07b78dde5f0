//! The page of a diagnosis: its text, and that it is one file.

#![allow(clippy::unwrap_used, clippy::print_stderr, clippy::print_stdout)]

use std::collections::BTreeMap;

use trueup_diagnosis::locate::map::{curve, surface};
use trueup_diagnosis::locate::{ResidualOrder, ResidualSeries, bands};
use trueup_diagnosis::outcome::*;
use trueup_identification::packed::{PackedModel, PackedValue};
use trueup_report::{
    Evidence, EvidenceMap, EvidenceTrace, IntakeEvidence, RecordingEvidence, diagnosis_page, sentence,
};

fn amount(value: f64, unit: &str, ci95: [Option<f64>; 2]) -> ClaimedAmount {
    ClaimedAmount { value, unit: unit.into(), ci95, ..Default::default() }
}

fn part(part: &str, gap_without: Option<f64>, share: f64) -> ErrorPart {
    ErrorPart { part: part.into(), component: None, joint: None, gap_without, share }
}

pub(crate) fn gap() -> HeldOutGap {
    HeldOutGap {
        before: 0.21,
        tuned: 0.12,
        after: 0.013,
        floor: 0.011,
        closed: Some(0.99),
        ci95: Some([0.98, 1.0]),
        ..Default::default()
    }
}

fn rms() -> ChannelRms {
    ChannelRms { unit: "rad".into(), before: 0.02, tuned: 0.01, after: 1e-3, floor: 9e-4 }
}

fn packed() -> PackedModel {
    let start = [("stiffness", 3.07e-5), ("staticFriction", 2.9e-4), ("stribeckVelocity", 12.0)];
    PackedModel {
        model: "TwoMassJoint".into(),
        effects: vec!["stribeck-friction".into()],
        start: start.map(|(name, x)| (name.to_owned(), PackedValue::Number(x))).into(),
        ..Default::default()
    }
}

pub(crate) fn diagnosis(verdict: Verdict) -> Diagnosis {
    let claimed = |id: &str, probability| Claimed {
        id: id.into(),
        component: "motor-friction".into(),
        joint: Some(1),
        probability,
        parameters: [
            ("staticFriction".to_owned(), amount(2.9e-4, "N.m", [Some(2.7e-4), Some(3.1e-4)])),
            ("stribeckVelocity".to_owned(), amount(12.0, "rad/s", [None, Some(25.0)])),
        ]
        .into(),
        closed_alone: Some(0.95),
    };
    let candidate = |id: &str, component: &str, probability, evidence, holdout_gap| CandidateCause {
        id: id.into(),
        component: component.into(),
        joint: Some(1),
        probability,
        evidence,
        holdout_gap,
    };
    let effects = match verdict {
        Verdict::Effects => vec![claimed("stribeck-friction", 0.97)],
        Verdict::Ambiguous => vec![claimed("stribeck-friction", 0.6), claimed("presliding-friction", 0.35)],
        _ => vec![],
    };
    Diagnosis {
        schema: SCHEMA.into(),
        model: "TwoMassJoint".into(),
        verdict,
        gap: GapReport {
            overall: Some(gap()),
            channels: BTreeMap::from([("motorAngle".to_owned(), gap()), ("loadAngle".to_owned(), gap())]),
            left_out: vec!["tipAngle".into()],
            derived: BTreeMap::from([("twist".to_owned(), HeldOutGap { rms: Some(rms()), ..gap() })]),
        },
        sensors: SensorFindings {
            classes: vec![
                vec!["actuator".into(), "motor-friction".into(), "sensor:motorCurrent".into()],
                vec!["transmission".into()],
            ],
            hidden: vec![],
        },
        location: GapLocation {
            components: vec![
                ComponentShare { id: "motor-friction".into(), share: 0.94, joint: Some(1) },
                ComponentShare { id: "load".into(), share: 0.04, joint: None },
            ],
            channels: vec![
                ChannelShare { name: "motorAngle".into(), share: 0.55 },
                ChannelShare { name: "loadAngle".into(), share: 0.45 },
            ],
            intervals: vec![IntervalShare {
                recording: "holdout-1.csv".into(),
                start: 2.1,
                end: 3.4,
                share: 0.5,
            }],
            regimes: vec![RegimeShare {
                variable: "motorVelocity".into(),
                low: Some(-0.4),
                high: Some(0.4),
                unit: "rad/s".into(),
                share: 0.7,
            }],
            bands: vec![BandShare { low_hz: 0.0, high_hz: 2.0, share: 0.9 }],
            cause: Some("internal".into()),
        },
        effects,
        candidates: vec![
            candidate("stribeck-friction", "motor-friction", 0.97, 412.3, Some(0.013)),
            candidate("presliding-friction", "motor-friction", 0.02, 371.0, Some(0.05)),
            candidate("backlash", "transmission", 0.0, 3.0, None),
        ],
        parameters: BTreeMap::from([(
            "stiffness".to_owned(),
            ClaimedAmount {
                nominal: Some(3.0e-5),
                nominal_deviation: Some(3.0e-6),
                sides: Some(GearSides { motor: 3.07e-5, load: 60358.0 }),
                ..amount(3.07e-5, "N.m/rad", [Some(3.0e-5), None])
            },
        )]),
        correlation: Some(EstimateCorrelation {
            names: vec!["stiffness".into(), "damping".into(), "staticFriction".into()],
            matrix: vec![vec![1.0, -0.2, 0.875], vec![-0.2, 1.0, 0.1], vec![0.875, 0.1, 1.0]],
        }),
        budget: vec![
            part("stribeck-friction", Some(0.2), 0.9),
            part(PARAMETERS, Some(0.06), 0.08),
            part(NOISE, None, 0.015),
            part(UNEXPLAINED, None, 0.005),
        ],
        pack: Some(packed()),
        indistinguishable: vec![vec!["stribeck-friction".into(), "presliding-friction".into()]],
        watch: None,
        unknown: UnknownShare { present: verdict == Verdict::Unknown, probability: 0.02, place: None },
        next_experiment: Some(NextExperiment {
            why: "Slow reversals of small amplitude show the spring before sliding.".into(),
            separates: vec!["stribeck-friction".into(), "presliding-friction".into()],
            input: "next-experiment.csv".into(),
            probability: Some(0.93),
        }),
        augmented: Some(vec!["TwoMassJoint.augmented.fmi3.fmu".into()]),
        capped: false,
        not_compared: None,
        findings: vec![NoticedMistake {
            severity: OutcomeSeverity::Warning,
            kind: "stuck".into(),
            file: "train-1.csv".into(),
            line: Some(7),
            channel: Some("loadAngle".into()),
            text: "it sticks".into(),
        }],
        inputs: Some(DiagnosisInputs {
            sha256: "abc".into(),
            files: [("train-1.csv".to_owned(), "0123456789abcdef".to_owned())].into(),
        }),
        notes: vec!["No repeats were given: <declared> noise is the floor.".into()],
    }
}

/// Everything that a page can hold.
pub(crate) fn page(verdict: Verdict) -> String {
    let n = 5000;
    let t: Vec<f64> = (0..n).map(|k| 0.002 * f64::from(k)).collect();
    let noise: Vec<f64> =
        (0..n).map(|k| 0.004 * ((f64::from(k) * 12.9898).sin() * 43758.547).fract()).collect();
    let truth: Vec<f64> = t.iter().map(|t| (1.3 * t).sin() + 0.4 * (3.1 * t).cos()).collect();
    let speed: Vec<f64> = t.iter().map(|t| 1.3 * (1.3 * t).cos() - 1.24 * (3.1 * t).sin()).collect();
    let measured: Vec<f64> = truth.iter().zip(&noise).map(|(x, e)| x + e).collect();
    let before: Vec<f64> = truth.iter().zip(&t).map(|(x, t)| x + 0.2 * (0.7 * t).sin()).collect();
    let tuned: Vec<f64> = truth.iter().zip(&t).map(|(x, t)| x + 0.1 * (0.7 * t).sin()).collect();
    let torque: Vec<f64> =
        speed.iter().zip(&noise).map(|(v, e)| 0.3 * v.tanh() + 0.1 * v + 5.0 * e).collect();
    let left: Vec<f64> = noise.iter().map(|e| 5.0 * e).collect();
    let (law, rest) = (curve(&speed, &torque, 24).unwrap(), curve(&speed, &left, 24).unwrap());
    let cells = surface(&truth, &speed, &torque, 14).unwrap();
    let residual: Vec<f64> = before.iter().zip(&measured).map(|(b, m)| b - m).collect();
    let spectrum =
        bands(&[ResidualSeries { recording: "a", time: &t, value: &residual, floor: 0.0023 }], None).unwrap();
    let orders: Vec<ResidualOrder> = (1..40)
        .map(|k| 0.5 * f64::from(k))
        .map(|order| {
            let cosine = if order == 2.0 { 0.08 } else { 0.004 / order };
            ResidualOrder { order, cosine, sine: 0.0, share: 0.0 }
        })
        .collect();
    let trace = |channel| EvidenceTrace {
        recording: "holdout-1.csv",
        channel,
        unit: "rad",
        time: &t,
        measured: &measured,
        before: &before,
        tuned: &tuned,
        after: &truth,
        floor: 0.0023,
    };
    let evidence = Evidence {
        scene: None,
        case: "a <case>",
        traces: vec![trace("motorAngle"), trace("loadAngle")],
        twists: vec![trace("twist")],
        replay: Some(["--input", "replay.csv", "--stop", "9.998"].map(str::to_owned).to_vec()),
        maps: vec![
            EvidenceMap::Curve {
                title: "Braking torque against speed",
                x: ["speed", "rad/s"],
                unit: "N.m",
                before: &law,
                after: Some(&rest),
            },
            EvidenceMap::Surface {
                title: "Transmission torque over twist and rate",
                x: ["twist", "rad"],
                y: ["rate", "rad/s"],
                unit: "N.m",
                surface: &cells,
            },
            EvidenceMap::Spectrum { title: "Residual of motorAngle", unit: "rad", bands: &spectrum },
            EvidenceMap::Orders { title: "Orders of the motor angle", unit: "rad", orders: &orders },
            EvidenceMap::Course {
                title: "Unknown torque at the motor",
                recording: "train-1.csv",
                unit: "N.m",
                time: &t,
                value: &torque,
            },
        ],
        floors: vec![["motorAngle".into(), "0.0023 rad".into(), "declared noise and resolution".into()]],
        next: vec![("motorCurrent", "A", &t, &speed)],
        intake: IntakeEvidence {
            recordings: vec![RecordingEvidence {
                name: "train-1.csv".into(),
                role: "fitting".into(),
                duration: "20 s".into(),
                rate: "4000 at 200 Hz".into(),
                channels: 3,
            }],
            channels: vec![["loadAngle", "rad", "output: is compared", "noise 1e-5 rad"].map(Into::into)],
            assumptions: vec!["Straight lines between samples of motorCurrent.".into()],
            command: "trueup diagnose 'a <case>'".into(),
        },
        files: vec![],
        settings: vec![["seed".into(), "1".into()]],
        versions: vec![["trueup".into(), "0.1.0".into()]],
    };
    diagnosis_page(&diagnosis(verdict), &evidence)
}

pub(crate) const CHARTS: usize = 14;
pub(crate) const VERDICTS: [(Verdict, &str); 5] = [
    (Verdict::NoGap, "agrees with the recordings"),
    (Verdict::Parameters, "parameters are off"),
    (Verdict::Effects, "lacks is break-away (Stribeck) friction"),
    (Verdict::Ambiguous, "which these recordings cannot distinguish"),
    (Verdict::Unknown, "no known effect explains"),
];

#[test]
fn the_first_sentence_says_the_verdict_and_the_figures() {
    for (verdict, words) in VERDICTS {
        let d = diagnosis(verdict);
        let text = sentence(&d);
        assert!(text.contains(words), "{text}");
        let html = page(verdict);
        let at = html.find(words).unwrap();
        assert!(at < html.find("<h2>What to do now").unwrap(), "the verdict comes first");
    }
    let text = sentence(&diagnosis(Verdict::Effects)).replace('\u{a0}', " ");
    assert!(text.contains("from 21.0 % to 1.30 %") && text.contains("alone leaves 1.10 %"), "{text}");
}

#[test]
fn it_is_one_file_with_everything_in_it_and_text_is_text() {
    let html = page(Verdict::Effects).replace('\u{a0}', " ");
    for elsewhere in [" src=", "@import", "url("] {
        assert!(!html.contains(elsewhere), "{elsewhere}");
    }
    // Links lead to sections of the page and to files next to it.
    let links: Vec<&str> = html.split("href=").skip(1).collect();
    assert!(links.len() > 10 && links.iter().all(|l| l.starts_with("\"#section-") || l.starts_with("\"./")));
    for part in [
        "a &lt;case&gt;",
        "&lt;declared&gt; noise",
        "motor-friction",
        "motorVelocity from -0.4 to 0.4 rad/s",
        "holdout-1.csv: 2.1 s to 3.4 s",
        "at most 25 rad/s",
        "not run",
        "99.0 % (98.0 % to 100 %)",
        "Predicted to decide with probability 93.0 %",
        "next-experiment.csv",
        "only by the form of an effect",
        "Form-based",
        "the cause is inside the arm",
        "tipAngle",
        "0.1.0",
        "TwoMassJoint.augmented.fmi3.fmu",
        "first-states.csv",
        "href=\"./TwoMassJoint.augmented.fmi3.fmu\"",
        "trueup simulate TwoMassJoint.augmented.fmi3.fmu --input replay.csv --stop 9.998 -o run.csv",
        // Yours, found, change in percent and in standard deviations of yours; both sides; correlations; RMS in degrees.
        ">3e-5 N.m/rad<",
        ">3.07e-5 N.m/rad<",
        ">+2.33<",
        ">+0.23<",
        ">60358 N.m/rad<",
        "not in your model",
        "between stiffness and staticFriction: +0.875",
        ">deg<",
        ">1.146<",
        "twist, holdout-1.csv: simulated minus measured",
        "gap of the complete model without it",
        // To paste.
        "stiffness = 3.07e-5",
        "[effects]",
        "trueup fmu pack TwoMassJoint --effect stribeck-friction --set staticFriction=0.00029",
        "Raise the current slowly until the motor breaks loose",
        "SHA-256 <code>abc</code>",
        "trueup diagnose 'a &lt;case&gt;'",
        "4000 at 200 Hz",
        "0123456789ab<",
        "warning: train-1.csv:7: loadAngle: it sticks",
        "left unexplained",
    ] {
        assert!(html.contains(part), "{part} is missing");
    }
    // A share of 4 % is not worth a line.
    assert!(!html.contains(">load<"));
    // Two channels and the twist with three charts each (both residuals, the signal), four maps with axes, one input; and the surface.
    assert_eq!(html.matches("<figure class=\"chart\">").count(), CHARTS);
    assert_eq!(html.matches("<svg ").count(), CHARTS + 1);
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
}

#[test]
fn a_diagnosis_with_nothing_in_it_is_a_page() {
    let mut d = diagnosis(Verdict::NoGap);
    d.gap = GapReport::default();
    d.location = GapLocation::default();
    (d.candidates, d.indistinguishable, d.next_experiment, d.augmented) = (vec![], vec![], None, None);
    let html = diagnosis_page(&d, &Evidence::default());
    assert!(html.contains("agrees with the recordings") && html.contains("trueup.diagnosis/1"));
    d.gap.overall = Some(HeldOutGap {
        before: f64::NAN,
        tuned: 0.0,
        after: 0.0,
        floor: 0.0,
        closed: None,
        ci95: None,
        ..Default::default()
    });
    assert!(diagnosis_page(&d, &Evidence::default()).contains("no figure (the run diverges)"));
}

#[test]
fn residuals_come_before_the_signals_and_twists_before_all() {
    let html = page(Verdict::Effects);
    let at = |text: &str| html.find(&format!("<figcaption>{text}")).unwrap();
    let residual = "motorAngle, holdout-1.csv: simulated minus measured";
    assert!(at("twist, holdout-1.csv: simulated minus measured") < at(residual));
    assert!(at(residual) < at("motorAngle, holdout-1.csv<"));
}

#[test]
fn less_than_noise_alone_leaves_is_explained() {
    let mut d = diagnosis(Verdict::Effects);
    let text = "is below what noise alone leaves";
    assert!(!diagnosis_page(&d, &Evidence::default()).contains(text));
    d.gap.overall = Some(HeldOutGap { after: 0.005, ..gap() });
    assert!(diagnosis_page(&d, &Evidence::default()).contains(text));
}

#[test]
fn without_a_gap_nothing_is_divided_among_causes() {
    let html = page(Verdict::NoGap);
    assert!(!html.contains("left unexplained") && html.contains("There is no gap to be divided"));
    assert!(page(Verdict::Parameters).contains("left unexplained"));
}

#[test]
fn a_set_is_worded_as_a_set_and_its_parts_add_up() {
    let text = sentence(&diagnosis(Verdict::Ambiguous)).replace('\u{a0}', " ");
    let set = "lacks is either break-away (Stribeck) friction (motor-friction) or spring-like friction before sliding";
    assert!(text.contains(set) && text.contains("(together probability 95.0 %)"), "{text}");
    let html = page(Verdict::Ambiguous).replace('\u{a0}', " ");
    assert!(
        html.contains("One of its members is there with probability 95.0 %"),
        "the set is in the summary"
    );
}

#[test]
fn what_is_unknown_says_why_and_what_drifts_away_has_no_share() {
    let mut d = diagnosis(Verdict::Unknown);
    d.unknown.place = Some("transmission".into());
    let html = diagnosis_page(&d, &Evidence::default()).replace('\u{a0}', " ");
    for part in [
        "Beyond noise: on recordings never used for fitting the nominal model misses 21.0 %, refitted 12.0 %; noise alone leaves 1.10 %, 11 times it.",
        "of 3 effects compared the best, break-away (Stribeck) friction (motor-friction), gains",
        "In one place: most of it shows at transmission.",
        "none of these: a cause that no known effect explains",
        "What acts at <b>transmission</b>",
    ] {
        assert!(html.contains(part) || part.starts_with("none of these"), "{part} is missing");
    }
    let mut d = diagnosis(Verdict::Effects);
    let away = HeldOutGap { before: 77.3, closed: None, ci95: None, ..gap() };
    d.gap.overall = Some(away);
    let html = diagnosis_page(&d, &Evidence::default()).replace('\u{a0}', " ");
    assert!(html.contains("falls from 77 times the signal to 1.30 %"));
    assert!(html.contains("no figure: the nominal run drifts away") && !html.contains("7730"));
}
