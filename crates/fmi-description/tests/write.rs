//! The written description, checked through an independent XML reader.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common;
use roxmltree::Document;
use trueup_fmi::configuration::Configuration;
use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::write::{WriteError, model_description, terminals, with_token};

fn find<'a>(doc: &'a Document, name: &str) -> roxmltree::Node<'a, 'a> {
    doc.descendants().find(|n| n.attribute("name") == Some(name)).unwrap_or_else(|| panic!("no {name}"))
}

fn list<'a>(doc: &'a Document, element: &str, attribute: &str) -> Vec<&'a str> {
    let parent = doc.descendants().find(|n| n.has_tag_name(element)).unwrap();
    parent.children().filter(|n| n.is_element()).map(|n| n.attribute(attribute).unwrap_or("absent")).collect()
}

#[test]
fn fmi_2_flattens_arrays_with_indices_from_one() {
    let xml = model_description(&common::table(), FmiVersion::V2, "{t}").unwrap();
    let doc = Document::parse(&xml).unwrap();
    assert_eq!(doc.root_element().attribute("guid"), Some("{t}"));
    assert_eq!(doc.root_element().attribute("numberOfEventIndicators"), Some("2"));
    assert_eq!(find(&doc, "offset[2,1]").attribute("valueReference"), Some("14"));
    assert_eq!(find(&doc, "offset[2,1]").first_element_child().unwrap().attribute("start"), Some("3.0"));
    assert_eq!(find(&doc, "mass[2]").first_element_child().unwrap().attribute("start"), Some("2e-7"));
    // 1-based index of the state w[2] among all scalars
    assert_eq!(find(&doc, "der(w[2])").first_element_child().unwrap().attribute("derivative"), Some("23"));
}

#[test]
fn derivatives_stand_in_the_order_of_the_states() {
    let xml = model_description(&common::table(), FmiVersion::V2, "").unwrap();
    let doc = Document::parse(&xml).unwrap();
    // der(x)[1..2] before der(w)[1..2], though the table has them the other way round
    assert_eq!(list(&doc, "Derivatives", "index"), ["26", "27", "24", "25"]);
    assert_eq!(list(&doc, "Derivatives", "dependencies"), ["2 22", "3 23", "absent", "absent"]);
    let xml = model_description(&common::table(), FmiVersion::V3, "").unwrap();
    let doc = Document::parse(&xml).unwrap();
    let rates = doc.descendants().filter(|n| n.has_tag_name("ContinuousStateDerivative"));
    assert_eq!(rates.map(|n| n.attribute("valueReference").unwrap()).collect::<Vec<_>>(), ["25", "23"]);
}

#[test]
fn no_dependency_is_empty_and_all_is_absent() {
    let xml = model_description(&common::table(), FmiVersion::V2, "").unwrap();
    let doc = Document::parse(&xml).unwrap();
    let expected = ["20", "21", "2 20 21 22 23", "3 20 21 22 23", "", "absent"];
    assert_eq!(list(&doc, "Outputs", "dependencies"), expected);
}

#[test]
fn kinds_stand_beside_dependencies_in_their_order_where_something_is_known() {
    let of = |version, element: &str, attribute| {
        let xml = model_description(&common::table(), version, "").unwrap();
        let doc = Document::parse(&xml).unwrap();
        list(&doc, element, attribute).into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    let kinds = "tunable fixed";
    assert_eq!(of(FmiVersion::V2, "Derivatives", "dependenciesKind"), [kinds, kinds, "absent", "absent"]);
    assert!(of(FmiVersion::V2, "Outputs", "dependenciesKind").iter().all(|k| k == "absent"));
    let third = of(FmiVersion::V3, "ModelStructure", "dependenciesKind");
    let known: Vec<_> = third.iter().zip(of(FmiVersion::V3, "ModelStructure", "dependencies")).collect();
    let known: Vec<_> = known.into_iter().filter(|(kinds, _)| *kinds != "absent").collect();
    assert_eq!(known, [(&kinds.to_owned(), "1 21".to_owned())]);
}

#[test]
fn fmi_3_keeps_arrays_and_names_the_event_indicators() {
    let xml = model_description(&common::table(), FmiVersion::V3, "t").unwrap();
    let doc = Document::parse(&xml).unwrap();
    let offset = find(&doc, "offset");
    assert_eq!(offset.attribute("start"), Some("1.0 2.0 3.0 4.0"));
    assert_eq!(offset.children().filter(|n| n.has_tag_name("Dimension")).count(), 2);
    assert_eq!(find(&doc, "eventIndicator2").attribute("valueReference"), Some("28"));
    let structure: Vec<_> = doc.descendants().filter(|n| n.has_tag_name("EventIndicator")).collect();
    assert_eq!(structure.len(), 2);
    assert!(!doc.descendants().any(|n| n.has_tag_name("InitialUnknown")
        && ["27", "28"].contains(&n.attribute("valueReference").unwrap())));
    assert_eq!(find(&doc, "force").attribute("intermediateUpdate"), Some("true"));
    assert_eq!(find(&doc, "enable").attribute("intermediateUpdate"), None);
}

#[test]
fn only_used_units_are_defined() {
    let xml = model_description(&common::table(), FmiVersion::V3, "").unwrap();
    let doc = Document::parse(&xml).unwrap();
    assert_eq!(list(&doc, "UnitDefinitions", "name"), ["s", "m", "m/s", "m/s2", "rad", "kg", "N"]);
}

#[test]
fn the_token_is_a_fingerprint() {
    let table = common::table();
    let token = |table: &_, c: &Configuration, v| with_token(table, c, v).unwrap().1;
    let plain = Configuration::of("Sample");
    let first = token(&table, &plain, FmiVersion::V3);
    assert_eq!(first, token(&table, &plain, FmiVersion::V3));
    assert_eq!(first.len(), 36);
    assert!(token(&table, &plain, FmiVersion::V2).starts_with('{'));
    let mut other = table.clone();
    other.variables[7].start[0] = 1.0 + f64::EPSILON;
    assert_ne!(first, token(&other, &plain, FmiVersion::V3));
    let rigid = Configuration { joint_flexible: vec![false], ..plain };
    assert_ne!(first, token(&table, &rigid, FmiVersion::V3));
}

#[test]
fn a_defect_of_the_table_is_named() {
    let mut table = common::table();
    table.variables[1].unit = "kN";
    let error = model_description(&table, FmiVersion::V2, "").unwrap_err();
    assert!(matches!(error, WriteError::Unit { .. }) && error.to_string().contains("`force`"), "{error}");
    let mut table = common::table();
    table.variables[2].name = "force".to_owned();
    assert!(matches!(model_description(&table, FmiVersion::V2, ""), Err(WriteError::Twice(_))));
    let mut table = common::table();
    table.variables[1].start.pop();
    assert!(matches!(model_description(&table, FmiVersion::V3, ""), Err(WriteError::Start { given: 1, .. })));
    let mut table = common::table();
    table.variables[3] = table.variables[3].clone().on(&["mass"]);
    assert!(matches!(model_description(&table, FmiVersion::V3, ""), Err(WriteError::Name { .. })));
    let mut table = common::table();
    table.terminals[0].members[0].1 = "nothing".to_owned();
    assert!(matches!(terminals::terminals_and_icons(&table), Err(WriteError::Name { .. })));
}

/// For a look with other tools: files in the folder that TRUEUP_DUMP names.
#[test]
fn dump() {
    let Some(folder) = std::env::var_os("TRUEUP_DUMP").map(std::path::PathBuf::from) else { return };
    for version in FmiVersion::ALL {
        let (xml, _) = with_token(&common::table(), &Configuration::of("Sample"), version).unwrap();
        let dir = folder.join(format!("description-{}", version.major()));
        std::fs::create_dir_all(&dir).unwrap();
        std::fs::write(dir.join("modelDescription.xml"), xml).unwrap();
        let icons = dir.join("terminalsAndIcons");
        if version == FmiVersion::V3 {
            std::fs::create_dir_all(&icons).unwrap();
            let xml = terminals::terminals_and_icons(&common::table()).unwrap();
            std::fs::write(icons.join("terminalsAndIcons.xml"), xml).unwrap();
        }
    }
}
