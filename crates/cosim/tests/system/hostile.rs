//! Files that mean harm or are broken at random: an answer, never a panic, and nothing outside of its folder.

use proptest::prelude::*;
use trueup_cosim::check;
use trueup_cosim::system::CosimSystem;

use crate::system::ssp::{archive, ssd};
use crate::system::{Desk, said};

/// The result of reading and checking these bytes under this name.
fn says(desk: &Desk, name: &str, bytes: &[u8]) -> Vec<String> {
    said(CosimSystem::read(&desk.write(name, bytes)).and_then(|s| check(&s)), desk.path())
}

const COMPONENT: &str =
    r#"<a:System name="r"><a:Elements><a:Component name="p" source="SOURCE"/></a:Elements></a:System>"#;

#[test]
fn archives_never_lead_out_of_their_folder() {
    let desk = Desk::new();
    let fmu = std::fs::read(desk.path().join("all.fmu/modelDescription.xml")).unwrap();
    for (source, said) in [
        ("../all.fmu", "../all.fmu leads out of s.ssp"),
        ("resources/../../all.fmu", "leads out of s.ssp"),
        ("/etc/passwd", "/etc/passwd leads out of s.ssp"),
        ("file:///etc/passwd", "file:///etc/passwd leads out of s.ssp"),
        ("..%2Fall.fmu", "leads out of s.ssp"),
        ("..\\all.fmu", "leads out of s.ssp"),
        ("%00", "is no valid URI"),
        ("resources/none.fmu", "the archive has no such file"),
        ("resources/x.ssp/y.ssp/z.fmu", "the archive has no such file"),
        ("", "p"),
    ] {
        let text = ssd(&COMPONENT.replace("SOURCE", source), "");
        let mistakes = says(&desk, "s.ssp", &archive(&[("SystemStructure.ssd", text.into_bytes())]));
        assert!(mistakes.iter().any(|m| m.contains(said)), "{source}: {mistakes:#?}");
    }
    for entry in ["../evil.fmu", "/evil.fmu", "a/../../evil.fmu", "..\\evil.fmu"] {
        let text = ssd(&COMPONENT.replace("SOURCE", "resources/p.fmu"), "");
        let bytes = archive(&[("SystemStructure.ssd", text.into_bytes()), (entry, fmu.clone())]);
        let mistakes = says(&desk, "s.ssp", &bytes);
        assert!(mistakes.iter().any(|m| m.contains("would be written outside")), "{entry}: {mistakes:#?}");
        assert!(
            !desk.path().join("evil.fmu").exists()
                && !desk.path().parent().unwrap().join("evil.fmu").exists()
        );
    }
}

/// A system of ten references to one of ten references to one ..., on so many levels.
fn laughing(levels: usize) -> String {
    let references = |to: usize| {
        let one = |k| format!("<a:Component name=\"c{k}\" source=\"#s{to}\"/>");
        (0..10).map(one).collect::<String>()
    };
    let inner = "<a:System name=\"s0\" id=\"s0\"><a:Elements><a:Component name=\"p\" source=\"all.fmu\"/></a:Elements></a:System>";
    let level = |k: usize| {
        format!(
            "<a:System name=\"s{k}\" id=\"s{k}\"><a:Elements>{}</a:Elements></a:System>",
            references(k - 1)
        )
    };
    let systems: String = (1..=levels).map(level).collect();
    format!("<a:System name=\"r\"><a:Elements>{inner}{systems}</a:Elements></a:System>")
}

/// The most memory that this process has used, in bytes.
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap();
    1024 * line.trim().trim_end_matches(" kB").parse::<usize>().unwrap()
}

#[test]
fn too_many_elements_are_refused_before_they_are_built() {
    let desk = Desk::new();
    let before = peak();
    let mistakes = says(&desk, "s.ssd", ssd(&laughing(12), "").as_bytes());
    assert_eq!(mistakes.len(), 1, "{mistakes:#?}");
    assert!(mistakes[0].contains("use fewer references"), "{mistakes:#?}");
    // In files instead of in one: the same.
    for level in 1..=12 {
        let inner = if level == 1 { "all.fmu".to_owned() } else { format!("l{}.ssd", level - 1) };
        let one = |k| format!("<a:Component name=\"c{k}\" source=\"{inner}\"/>");
        let ten: String = (0..10).map(one).collect();
        let system = format!("<a:System name=\"r\"><a:Elements>{ten}</a:Elements></a:System>");
        desk.write(&format!("l{level}.ssd"), ssd(&system, ""));
    }
    let text = std::fs::read(desk.path().join("l12.ssd")).unwrap();
    let mistakes = says(&desk, "l12.ssd", &text);
    assert!(mistakes.iter().any(|m| m.contains("use fewer references")), "{mistakes:#?}");
    // Built, 200000 elements take 700 MB. The kernel's count lags by a few pages, so it can also fall.
    let more = peak().saturating_sub(before) >> 20;
    assert!(more < 300, "{more} MiB more");
}

#[test]
fn nesting_ends() {
    let desk = Desk::new();
    let deep = |open: &str, close: &str, n: usize| ssd(&format!("{}{}", open.repeat(n), close.repeat(n)), "");
    let itself = r##"<a:System name="r" id="r"><a:Elements><a:Component name="p" source="#r"/><a:Component name="q" source="#r"/></a:Elements></a:System>"##;
    let laughs = r#"<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><x>&b;</x>"#;
    for (text, said) in [
        (
            deep("<a:System name=\"s\"><a:Elements>", "</a:Elements></a:System>", 200),
            "nested more than 32 deep",
        ),
        (deep("<a:x>", "</a:x>", 200_000), "nested too deeply"),
        ("<a>".repeat(500_000), "nested too deeply"),
        (ssd(itself, ""), "nested more than 32 deep; does one contain itself?"),
        (ssd(&laughing(12), ""), "there are more than 200000 elements, nested ones counted as often"),
        (laughs.into(), "not well-formed XML"),
    ] {
        let mistakes = says(&desk, "s.ssd", text.as_bytes());
        assert!(
            mistakes.iter().any(|m| m.contains(said)),
            "{said}: {:#?}",
            &mistakes[..mistakes.len().min(3)]
        );
    }
    // A package that names itself.
    let text = ssd(
        &COMPONENT.replace(
            "source=\"SOURCE\"",
            "type=\"application/x-ssp-definition\" source=\"SystemStructure.ssd\"",
        ),
        "",
    );
    let mistakes = says(&desk, "s.ssp", &archive(&[("SystemStructure.ssd", text.into_bytes())]));
    assert!(mistakes.iter().any(|m| m.contains("nested more than 32 deep")), "{mistakes:#?}");
    for toml in [
        format!("x = {}{}", "[".repeat(100_000), "]".repeat(100_000)),
        format!("[components.a]\nfmu = \"all.fmu\"\nstart = {}1{}", "{ a = ".repeat(40), " }".repeat(40)),
        format!("[{}]", vec!["a"; 100_000].join(".")),
    ] {
        assert!(!says(&desk, "s.toml", toml.as_bytes()).is_empty());
    }
}

#[test]
fn connectors_that_drive_each_other_are_no_endless_loop() {
    let desk = Desk::new();
    let connector = |name| format!("<a:Connector name=\"{name}\" kind=\"unspecified\"/>");
    let text = ssd(
        &format!(
            r#"<a:System name="r"><a:Connectors>{}{}</a:Connectors><a:Elements><a:Component name="p" source="all.fmu"/></a:Elements><a:Connections>
            <a:Connection startConnector="s" endConnector="t"/><a:Connection startConnector="t" endConnector="s"/>
            <a:Connection startConnector="s" endElement="p" endConnector="u"/></a:Connections>
            <a:ParameterBindings/></a:System>"#,
            connector("s"),
            connector("t")
        ),
        "",
    );
    let mistakes = says(&desk, "s.ssd", text.as_bytes());
    assert!(
        mistakes.iter().any(|m| m.contains("`u` is driven by itself, through connectors alone")),
        "{mistakes:#?}"
    );
}

#[test]
fn numbers_may_be_huge() {
    let desk = Desk::new();
    for (toml, said) in [
        ("[run]\nstop = 1e999\n", "`stop` is a finite number"),
        ("[run]\nstop = 99999999999999999999999999\nstep = 1\n", "no run from"),
        ("[components.a]\nfmu = \"all.fmu\"\nstart = { small = 99999999999999999999999999 }\n", "cannot be"),
        ("[components.a]\nfmu = \"all.fmu\"\nstart = { n = 18446744073709551615 }\n", "above its maximum"),
        ("run.step = 1\n[components.a]\nfmu = \"all.fmu\"\nstep = 1e300\n", "no whole multiple"),
        (
            "record = [{ variable = 'a.x', every = 1e20 }]\n[components.a]\nfmu = \"all.fmu\"\n",
            "`every` is a whole number",
        ),
    ] {
        let toml = if toml.contains("components") {
            toml.to_owned()
        } else {
            format!("{toml}[components.a]\nfmu = \"all.fmu\"\n")
        };
        let mistakes = says(&desk, "s.toml", toml.as_bytes());
        assert!(mistakes.iter().any(|m| m.contains(said)), "{toml}: {mistakes:#?}");
    }
    let array = r#"<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="t"><CoSimulation modelIdentifier="m"/><ModelVariables>
        <Float64 name="y" valueReference="1" causality="output"><Dimension start="99999999999"/><Dimension start="99999999999"/></Float64>
        </ModelVariables><ModelStructure/></fmiModelDescription>"#;
    desk.fmu("huge", array);
    let mistakes = says(&desk, "s.toml", b"[components.a]\nfmu = \"huge.fmu\"\n");
    assert!(mistakes.iter().any(|m| m.contains("the size of `y` is not known")), "{mistakes:#?}");
}

fn toml() -> String {
    "connections = [\"a.x -> b.u\", { from = \"b.angle\", to = 'a.degrees', factor = 2e0, map = { 1 = 2 } }]\nrecord = [\"a.*\"]\n[run]\nstop = 1\nstep = 0x1\n[components.a]\nfmu = \"all.fmu\"\nstart = { gain = 1, matrix = [[1, 2, 3], [4, 5, 6]] }\n[components.b]\nfmu = \"all.fmu\"\n".into()
}

fn xml() -> String {
    std::fs::read_to_string(
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/02-arm/arm.ssd"),
    )
    .unwrap()
}

/// Bytes replaced, pieces cut out, pieces doubled.
fn broken(whole: impl Into<Vec<u8>>) -> impl Strategy<Value = Vec<u8>> {
    let whole = whole.into();
    let n = whole.len();
    prop::collection::vec((0..n, 0..n, any::<u8>(), 0..4u8), 1..6).prop_map(move |edits| {
        let mut bytes = whole.clone();
        for (at, length, byte, what) in edits {
            let at = at.min(bytes.len().saturating_sub(1));
            let end = (at + length % 40).min(bytes.len());
            match what {
                0 => bytes[at] = byte,
                1 => drop(bytes.drain(at..end)),
                2 => {
                    let piece = bytes[at..end].to_vec();
                    bytes.splice(at..at, piece);
                }
                _ => bytes[at] = b"<>\"'=[]{}.,&%#0-"[usize::from(byte) % 16],
            }
            if bytes.is_empty() {
                bytes.push(b' ');
            }
        }
        bytes
    })
}

/// Fewer where `./test` limits the hostile sequences.
fn cases() -> u32 {
    std::env::var_os("TRUEUP_HOSTILE_SEQUENCES").map_or(300, |_| 60)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn broken_toml_is_answered(bytes in broken(toml())) {
        let desk = Desk::new();
        let _ = CosimSystem::read(&desk.write("s.toml", bytes)).and_then(|s| check(&s));
    }

    #[test]
    fn broken_descriptions_are_answered(bytes in broken(xml())) {
        let desk = Desk::new();
        let _ = CosimSystem::read(&desk.write("s.ssd", bytes)).and_then(|s| check(&s));
    }

    #[test]
    fn broken_packages_are_answered(bytes in broken(archive(&[("SystemStructure.ssd", xml().into_bytes())]))) {
        let desk = Desk::new();
        let _ = CosimSystem::read(&desk.write("s.ssp", bytes)).and_then(|s| check(&s));
    }
}
