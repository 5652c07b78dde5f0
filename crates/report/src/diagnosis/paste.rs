//! Lines to paste: what was found as lines of `case.toml`, and as a command that packs it.

use trueup_diagnosis::outcome::{Claimed, ClaimedAmount, Diagnosis};
use trueup_identification::packed::PackedModel;

use super::shell::command_line;
use crate::page::{Page, escape};

/// Deviations within which 95 % of a normal distribution are.
const NORMAL: f64 = 1.96;

/// What was found, ready for case.toml and for the shell.
pub(super) fn lines(page: &mut Page, d: &Diagnosis) {
    let Some(pack) = d.pack.as_ref().filter(|_| !(d.effects.is_empty() && d.parameters.is_empty())) else {
        return;
    };
    page.html("<h3>To paste</h3>");
    let [own, effects] = of_case(d, pack);
    let mut block = |text: &str, lines: &str| {
        if !lines.is_empty() {
            page.text(text);
            page.html(&format!("<pre class=\"paste\"><code>{}</code></pre>", escape(lines)));
        }
    };
    block(
        "Into [parameters] of case.toml, in place of your values: from then on the nominal simulation is the refitted one.",
        &own.join("\n"),
    );
    if !effects.is_empty() {
        let text = format!("[effects]\n{}", effects.join("\n"));
        block("Into case.toml, so that the effects belong to the nominal model:", &text);
    }
    let arguments = pack.arguments();
    let command = std::iter::once("trueup").chain(arguments.iter().map(String::as_str));
    block(
        "The same model as FMUs, anywhere (from this folder `trueup fmu pack --from diagnosis.json` is shorter):",
        &command_line(command),
    );
}

/// Lines of `[parameters]`, and of `[effects]`. An effect of the joint's structure, and what the nominal model has already,
/// are parameters.
fn of_case(d: &Diagnosis, pack: &PackedModel) -> [Vec<String>; 2] {
    let key = |name: &str| if name.contains('[') { format!("{name:?}") } else { name.to_owned() };
    let line = |name: &str, a: &ClaimedAmount| format!("{} = {:?}", key(name), a.value);
    let own = d.parameters.iter().filter(|(name, _)| pack.start.contains_key(*name));
    let mut own: Vec<String> = own.map(|(name, a)| line(name, a)).collect();
    let mut effects: Vec<(String, Vec<String>)> = Vec::new();
    let mut structure = false;
    for e in d.effects.iter() {
        let full = |stem: &str| {
            let indexed = e.joint.map(|j| format!("{stem}[{j}]")).filter(|n| pack.start.contains_key(n));
            indexed.unwrap_or_else(|| stem.to_owned())
        };
        let known = |stem: &str| pack.start.contains_key(&full(stem));
        if !e.parameters.keys().all(|stem| known(stem)) {
            continue; // a member of a set that is not in the model
        }
        let Some(id) = packed_id(e, pack) else {
            structure |= e.id == "joint-flexibility";
            own.extend(e.parameters.iter().map(|(stem, a)| line(&full(stem), a)));
            continue;
        };
        let (given, added): (Vec<_>, Vec<_>) = e.parameters.iter().partition(|(_, a)| a.nominal.is_some());
        own.extend(given.iter().map(|(stem, a)| line(&full(stem), a)));
        let joint = e.joint.filter(|_| added.iter().any(|(stem, _)| full(stem) != **stem));
        let table = table(&added, joint);
        match effects.iter_mut().find(|(known, _)| *known == id) {
            Some((_, tables)) => tables.push(table),
            None => effects.push((id, vec![table])),
        }
    }
    if structure {
        let each: Vec<String> = pack.flexible.iter().map(bool::to_string).collect();
        own.push(format!("jointFlexible = [{}]", each.join(", ")));
    }
    let effects = effects.into_iter().map(|(id, tables)| {
        let id = if id.contains(':') { format!("{id:?}") } else { id };
        match &tables[..] {
            [one] => format!("{id} = {one}"),
            all => format!("{id} = [\n  {},\n]", all.join(",\n  ")),
        }
    });
    [own, effects.collect()]
}

/// The values of an effect as a table of `[effects]`: one standard deviation covers all of them.
fn table(values: &[(&String, &ClaimedAmount)], joint: Option<usize>) -> String {
    let deviation = |a: &ClaimedAmount| {
        let [low, high] = [a.ci95[0]?, a.ci95[1]?];
        (a.value != 0.0).then(|| (high - low) / (2.0 * NORMAL * a.value.abs()))
    };
    let mut cells: Vec<String> = values.iter().map(|(stem, a)| format!("{stem} = {:?}", a.value)).collect();
    let widest = values.iter().filter_map(|(_, a)| deviation(a)).reduce(f64::max);
    cells.extend(widest.map(|d| format!("doubt = {}", (1e4 * d).ceil() / 1e4)));
    cells.extend(joint.map(|j| format!("joint = {j}")));
    if cells.is_empty() { "{}".to_owned() } else { format!("{{ {} }}", cells.join(", ")) }
}

/// The effect as the model is packed with it; `None`: it is in the structure.
fn packed_id(e: &Claimed, pack: &PackedModel) -> Option<String> {
    let place = |packed: &str| packed.split_once(':').map(|(_, place)| place.to_owned());
    let own = || pack.effects.iter().filter(|p| p.split(':').next() == Some(e.id.as_str()));
    let here = |p: &&String| {
        place(p).is_none_or(|place| e.component.trim_start_matches("sensor:").starts_with(&place))
    };
    own().find(here).or_else(|| own().next()).cloned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_identification::packed::PackedValue;

    fn amount(value: f64, nominal: Option<f64>) -> ClaimedAmount {
        let ci95 = [Some(0.9 * value), Some(1.1 * value)];
        ClaimedAmount { value, ci95, nominal, ..Default::default() }
    }

    fn claimed(id: &str, component: &str, joint: usize, values: &[(&str, ClaimedAmount)]) -> Claimed {
        Claimed {
            id: id.into(),
            component: component.into(),
            joint: Some(joint),
            probability: 1.0,
            parameters: values.iter().map(|(name, a)| ((*name).to_owned(), a.clone())).collect(),
            closed_alone: None,
        }
    }

    fn model(effects: &[&str], names: &[&str]) -> PackedModel {
        PackedModel {
            effects: effects.iter().map(|e| (*e).to_owned()).collect(),
            start: names.iter().map(|n| ((*n).to_owned(), PackedValue::Number(1.0))).collect(),
            ..Default::default()
        }
    }

    #[test]
    fn what_the_model_has_is_a_parameter_and_what_it_lacks_an_effect() {
        let mut d: Diagnosis = serde_json::from_str(NOTHING).unwrap();
        d.parameters.insert("stiffness".into(), amount(2.0, Some(1.0)));
        d.parameters.insert("motorCurrent.gain".into(), amount(2.0, Some(1.0)));
        d.effects = vec![
            claimed(
                "stribeck-friction",
                "motor-friction",
                1,
                &[("staticFriction", amount(3.0, Some(1.0))), ("stribeckVelocity", amount(4.0, None))],
            ),
            claimed("sensor-delay", "sensor:loadAngle", 1, &[("loadAngleDelay", amount(0.5, None))]),
        ];
        let pack = model(
            &["stribeck-friction", "sensor-delay:motorAngle", "sensor-delay:loadAngle"],
            &["stiffness", "staticFriction", "stribeckVelocity", "loadAngleDelay"],
        );
        let [own, effects] = of_case(&d, &pack);
        assert_eq!(own, ["stiffness = 2.0", "staticFriction = 3.0"]);
        assert_eq!(
            effects,
            [
                "stribeck-friction = { stribeckVelocity = 4.0, doubt = 0.0511 }",
                "\"sensor-delay:loadAngle\" = { loadAngleDelay = 0.5, doubt = 0.0511 }",
            ]
        );
        // Of an arm each joint has a table of its own.
        d.effects = vec![
            claimed("backlash", "transmission", 1, &[("backlashGap", amount(1.0, None))]),
            claimed("backlash", "transmission", 3, &[("backlashGap", amount(2.0, None))]),
        ];
        let [_, effects] = of_case(&d, &model(&["backlash"], &["backlashGap[1]", "backlashGap[3]"]));
        let expected = "backlash = [\n  { backlashGap = 1.0, doubt = 0.0511, joint = 1 },\n  \
                        { backlashGap = 2.0, doubt = 0.0511, joint = 3 },\n]";
        assert_eq!(effects, [expected]);
    }

    const NOTHING: &str = r#"{"schema": "", "model": "M", "verdict": "effects",
        "gap": {"overall": null, "channels": {}},
        "where": {"components": [], "channels": [], "intervals": [], "regimes": [], "bands": []},
        "effects": [], "candidates": [], "parameters": {}, "indistinguishable": [],
        "unknown": {"present": false, "probability": 0.0}, "next_experiment": null, "augmented": null}"#;
}
