//! Elements of arrays, and variables by another of their names.

use crate::system::Desk;
use crate::system::ssp::{all, con, link, plan, ssd, system, wire};

#[test]
fn a_connector_may_be_named_as_an_element() {
    let desk = Desk::new();
    // As OMSimulator writes arrays: a connector per element. The wire is written from the input to the output.
    let p = all("p", &format!("<a:Connectors>{}</a:Connectors>", con("vector[2]", "output", "deg")));
    let q = all("q", &format!("<a:Connectors>{}</a:Connectors>", con("u", "input", "rad")));
    let units = r#"<a:Units><b:Unit name="deg"><b:BaseUnit rad="1" factor="0.017453292519943295"/></b:Unit><b:Unit name="rad"><b:BaseUnit rad="1"/></b:Unit></a:Units>"#;
    let text = ssd(&system(&(p + &q), &wire(("q", "u"), ("p", "vector[2]"), "")), units);
    let plan = plan(&desk, &text);
    let (from, factor, _) = link(&plan, "q.u");
    assert_eq!((from.as_str(), plan.links[0].from.element), ("p.vector", 1));
    assert!((factor - std::f64::consts::PI / 180.0).abs() < 1e-15, "{factor}");
}

/// `named.fmu`: a scalar and an array, each with an alias.
const NAMED: &str = r#"<fmiModelDescription fmiVersion="3.0" modelName="named" instantiationToken="t"><CoSimulation modelIdentifier="named"/><ModelVariables>
    <Float64 name="h" valueReference="1" causality="output"><Alias name="height of the ball"/></Float64>
    <Float64 name="v" valueReference="2" causality="output"><Dimension start="2"/><Alias name="w"/></Float64>
    </ModelVariables><ModelStructure/></fmiModelDescription>"#;

#[test]
fn a_variable_is_recorded_under_the_name_that_was_asked_for() {
    let desk = Desk::new();
    desk.fmu("named", NAMED);
    let columns = |record: &str| {
        let plan = desk.plan(&format!("record = {record}\n[components.a]\nfmu = \"named.fmu\"\n"));
        let plan = plan.map_err(|e| e.to_string()).unwrap();
        plan.recorded.iter().map(|r| (r.name.clone(), r.from.variable, r.from.element)).collect::<Vec<_>>()
    };
    let is = |found: Vec<(String, usize, usize)>, expected: &[(&str, usize, usize)]| {
        let found: Vec<_> = found.iter().map(|(name, v, e)| (name.as_str(), *v, *e)).collect();
        assert_eq!(found, expected);
    };
    is(columns(r#"["a.h", "a.height of the ball"]"#), &[("a.h", 0, 0), ("a.height of the ball", 0, 0)]);
    is(columns(r#"["a.v[2]", "a.w"]"#), &[("a.v[2]", 1, 1), ("a.w[1]", 1, 0), ("a.w[2]", 1, 1)]);
    is(columns(r#"["a.w[2]"]"#), &[("a.w[2]", 1, 1)]);
    is(columns(r#"[{ variable = "a.w", as = "z" }]"#), &[("z[1]", 1, 0), ("z[2]", 1, 1)]);
}
