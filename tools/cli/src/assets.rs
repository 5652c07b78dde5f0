//! Pictures, icons, equations and licences that go into the FMUs.

/// Files of one model.
pub(crate) struct Assets {
    pub(crate) equations: &'static str,
    pub(crate) picture: &'static str,
    pub(crate) icon_svg: &'static str,
    pub(crate) icon_png: &'static [u8],
}

macro_rules! assets {
    ($folder:literal) => {
        Assets {
            equations: include_str!(concat!("../../../", $folder, "/equations.html")),
            picture: include_str!(concat!("../../../", $folder, "/mechanism.svg")),
            icon_svg: include_str!(concat!("../../../", $folder, "/icon.svg")),
            icon_png: include_bytes!(concat!("../../../", $folder, "/icon.png")),
        }
    };
}

/// The files of this model.
pub(crate) fn of(model: &str) -> Option<Assets> {
    Some(match model {
        "TwoMassJoint" => assets!("fmu-plant/assets/TwoMassJoint"),
        "PlanarManipulator" => assets!("fmu-plant/assets/PlanarManipulator"),
        "SpatialFreeFlyer" => assets!("fmu-plant/assets/SpatialFreeFlyer"),
        "FlexibleArm" => assets!("fmu-plant/assets/FlexibleArm"),
        "SpaceController" => assets!("fmu-plant/assets/SpaceController"),
        "FreeBody" => assets!("fmu-plant/assets/FreeBody"),
        "GripperContact" => assets!("fmu-plant/assets/GripperContact"),
        "CaptureScene" => assets!("fmu-plant/assets/CaptureScene"),
        "JointController" => assets!("fmu-controller/assets/JointController"),
        "ManipulatorController" => assets!("fmu-controller/assets/ManipulatorController"),
        _ => return None,
    })
}

const EFFECTS: &str = include_str!("../../../docs/effects.md");

/// What the effect is and its equation, as HTML, from the document on effects.
pub(crate) fn effect(id: &str) -> Option<String> {
    let id = id.split(':').next()?;
    let section = EFFECTS.split("\n### ").find_map(|s| s.strip_prefix(&format!("`{id}`\n")))?;
    let mut paragraphs = section.split("\n\n").map(str::trim).filter(|p| !p.is_empty());
    let summary = html(paragraphs.next()?);
    let equation = html(paragraphs.next()?.strip_prefix("> ")?);
    Some(format!("<p><code>{id}</code>: {summary}</p>\n<blockquote>{equation}</blockquote>\n"))
}

/// Text of a Markdown paragraph: its escaped bars and code.
fn html(markdown: &str) -> String {
    let text = markdown.replace("\\|", "|").replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let parts = text.split('`').enumerate();
    parts.map(|(i, s)| if i % 2 == 1 { format!("<code>{s}</code>") } else { s.to_owned() }).collect()
}

/// Names and texts.
pub(crate) const LICENCES: &[(&str, &str)] = &[
    ("LICENSE-MIT.txt", include_str!("../../../LICENSE-MIT")),
    ("LICENSE-APACHE.txt", include_str!("../../../LICENSE-APACHE")),
];

#[cfg(test)]
mod tests {
    #[test]
    fn every_effect_has_its_equation() {
        for e in crate::catalog::effects() {
            let text = super::effect(e.id).unwrap_or_default();
            assert!(text.contains("<blockquote>(EF-") && !text.contains("\\|"), "{}: {text}", e.id);
        }
    }
}
