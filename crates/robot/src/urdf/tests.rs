//! What is made of a robot's file.

use super::*;
use trueup_models::space::tree::JointType;

const ARM: &str = include_str!("../../tests/data/arm.urdf");

/// Against numbers by hand: what is fixed to a link is part of it, the base's axes have their origin in its centre of mass.
#[test]
fn an_arm_on_a_base() {
    let d = parsed(Path::new("arm.urdf"), ARM).unwrap().design;
    d.check().unwrap();
    assert_eq!((d.name.as_str(), d.held, d.links.len()), ("arm", false, 2));
    // 90 kg at the origin and 10 kg at x = 1.
    assert!((d.base_mass - 100.0).abs() < 1e-12 && (d.base_inertia[0][0] - 10.0).abs() < 1e-12);
    assert!((d.base_inertia[1][1] - (10.0 + 90.0 * 0.01 + 10.0 * 0.81)).abs() < 1e-12);
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near(&d.links[0].position, &[0.3, 0.0, 0.2]));
    // Turned by 90 degrees about z.
    let half = 0.5_f64.sqrt();
    assert!(near(&d.links[0].orientation, &[half, 0.0, 0.0, half]));
    assert_eq!((d.links[1].parent, d.links[1].joint), (1, JointType::Prismatic));
    assert_eq!((d.tips[0].name.as_str(), d.tips[0].body, d.tips[0].offset), ("hand", 2, [0.3, 0.0, 0.0]));
}

#[test]
fn what_is_no_tree_is_told_with_its_line() {
    for (from, to, said) in [
        ("<child link=\"slide\"/>", "<child link=\"slidee\"/>", "did you mean `slide`?"),
        ("type=\"prismatic\"", "type=\"planar\"", "type `planar` cannot be had"),
        ("<!-- mimic -->", "<mimic joint=\"turn\" offset=\"nan\"/>", "give 1 finite number(s)"),
        (
            "<!-- loop -->",
            "<joint name=\"loop\" type=\"fixed\"><parent link=\"slide\"/><child link=\"upper\"/></joint>",
            "a loop, which a tree has not",
        ),
        ("<mass value=\"2\"/>", "<mass value=\"0\"/>", "it moves and has no mass"),
        ("<mass value=\"2\"/>", "", "<inertial> has no <mass>"),
        ("xyz=\"0.4 0 0.2\"", "xyz=\"0.4 0\"", "give 3 finite number(s)"),
        ("<link name=\"hand\"/>", "<link name=\"slide\"/>", "the link `slide` is defined in line 30 already"),
        ("joint name=\"grip\"", "joint name=\"push\"", "the joint `push` is defined in line 36 already"),
        ("<!-- mimic -->", "<dynamics damping=\"-1\"/>", "damping=\"-1\" is below 0"),
        ("<mass value=\"90\"/>", "<mass value=\"-90\"/>", "no body has a mass below 0"),
        ("<robot name=\"arm\">", "<sdf name=\"arm\">", "expected"),
    ] {
        assert!(ARM.contains(from), "{from}");
        let text = ARM.replacen(from, to, 1);
        let why = parsed(Path::new("arm.urdf"), &text).map(|_| ()).unwrap_err();
        assert!(why.contains(said) && why.starts_with("arm.urdf:"), "{from}: {why}");
    }
}

fn made(change: &[(&str, &str)]) -> TreeRobot {
    let text = change.iter().fold(ARM.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    parsed(Path::new("arm.urdf"), &text).unwrap_or_else(|why| panic!("{why}"))
}

#[test]
fn what_is_not_read_is_named() {
    let whole = made(&[]);
    let said = whole.notes.join("\n");
    assert!(said.contains("<limit> of 1 joint (turn) is not read"), "{said}");
    assert!(whole.floats.unwrap().contains("the base (`bus`, 100 kg) floats; --held holds it"));
    assert_eq!(
        (whole.friction.as_slice(), made(&[]).without_friction()),
        ([JointFriction::default(); 2].as_slice(), None)
    );
    let lossy = made(&[("<!-- mimic -->", "<dynamics damping=\"1.5\" friction=\"0.25\"/>")]);
    assert_eq!(lossy.friction[1], JointFriction { viscous: 1.5, coulomb: 0.25 });
    assert!(lossy.without_friction().unwrap().contains("1 links (slide)"));
}

#[test]
fn what_is_fixed_to_the_world_is_held() {
    let joint = |kind: &str| {
        format!(
            "<!-- loop --><link name=\"world\"/><joint name=\"foot\" type=\"{kind}\"><parent link=\"world\"/><child link=\"bus\"/></joint>"
        )
    };
    // Of a base that is held the mass does not matter.
    for (kind, held, mass) in [("fixed", true, 1.0), ("floating", false, 100.0)] {
        let found = made(&[("<!-- loop -->", &joint(kind))]);
        assert_eq!((found.design.held, found.design.base_mass), (held, mass), "{kind}");
        assert_eq!(found.floats.is_some(), !held, "{kind}");
    }
}

/// Whatever a hand weighs, its place is that of the tip.
#[test]
fn a_hand_has_its_place_with_and_without_mass() {
    for mass in [None, Some(0.0), Some(0.4)] {
        let inertia = if mass == Some(0.0) { 0.0 } else { 1e-3 };
        let hand = mass.map_or("<link name=\"hand\"/>".to_owned(), |m| {
            format!("<link name=\"hand\"><inertial><mass value=\"{m}\"/><inertia ixx=\"{inertia}\" ixy=\"0\" ixz=\"0\" iyy=\"{inertia}\" iyz=\"0\" izz=\"{inertia}\"/></inertial></link>")
        });
        let tip = &made(&[("<link name=\"hand\"/>", &hand)]).design.tips[0];
        assert_eq!((tip.name.as_str(), tip.offset), ("hand", [0.3, 0.0, 0.0]), "{mass:?}");
    }
}
