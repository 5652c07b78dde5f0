//! The motion of a diagnosed case: measured, before, after, laid over each other, the part at fault lit.

use trueup_diagnosis::diagnose::{ChannelTrace, Diagnosed};
use trueup_diagnosis::outcome::{Diagnosis, Verdict};
use trueup_identification::model::SimulatedPlant;
use trueup_models::joint::parameter;
use trueup_scene::{MissingColumn, MotionRecord, PartLook, Scene, exaggeration, joint_as_is, planar_scene};
use trueup_signals::Loaded;

/// The first of the motions: the others are drawn by their differences from it.
const MEASURED: &str = "measured";

/// Of the first recording that is compared; `None`: a coordinate of the plant was not measured, or the plant has no picture.
pub(super) fn scene(loaded: &Loaded, found: &Diagnosed) -> Option<Scene> {
    let model = SimulatedPlant::of_case(&loaded.case, &[]).ok()?;
    let p = model.set(&model.defaults(), &loaded.case.parameters).ok()?;
    let recording = &found.traces.first()?.recording;
    let traces: Vec<_> = found.traces.iter().filter(|t| t.recording == *recording).collect();
    let time = &traces.first()?.time;
    if traces.iter().any(|t| t.time.len() != time.len()) {
        return None;
    }
    let gear = if model.joint().is_some() { p[parameter::GEAR_RATIO] } else { 1.0 };
    let with_effects = !found.diagnosis.effects.is_empty();
    let after = |t: &ChannelTrace| if with_effects { t.after.clone() } else { t.tuned.clone() };
    let name = if with_effects { "with the effects" } else { "own parameters refitted" };
    let same = matches!(found.diagnosis.verdict, Verdict::NoGap);
    // Of angles the largest difference, at the load.
    let channels = loaded.recordings.get(recording).into_iter().flat_map(|r| &r.channels);
    let angles: Vec<&str> = channels.filter(|c| c.unit == "rad").map(|c| c.name.as_str()).collect();
    let angle = |t: &&&ChannelTrace| angles.contains(&t.channel.as_str());
    let size = |t: &&ChannelTrace| {
        let unit = if t.channel == "motorAngle" { gear } else { 1.0 };
        let both = t.before.iter().chain(&t.after).zip(t.measured.iter().chain(&t.measured));
        both.map(|(x, m)| ((x - m) / unit).abs()).filter(|d| d.is_finite()).fold(0.0, f64::max)
    };
    let factor = exaggeration(traces.iter().filter(angle).map(size).fold(0.0, f64::max));
    let draw = |pick: &dyn Fn(&ChannelTrace) -> Vec<f64>| -> Result<Scene, MissingColumn> {
        let drawn = |t: &&ChannelTrace| -> Vec<f64> {
            let own = pick(t);
            own.iter().zip(&t.measured).map(|(x, m)| m + factor * (x - m)).collect()
        };
        let columns: Vec<(&str, Vec<f64>)> = traces.iter().map(|t| (t.channel.as_str(), drawn(t))).collect();
        let find = |name: &str| columns.iter().find(|c| c.0 == name).map(|c| c.1.as_slice());
        let record = MotionRecord::new(time, &find);
        match model.arm() {
            Some(arm) => planar_scene(arm, &p, &record),
            None => joint_as_is(gear, &record, 1.0),
        }
    };
    model.arm().map(|_| ()).or(model.joint().map(|_| ()))?;
    let mut scene = Scene::default();
    scene.lay_over(MEASURED, draw(&|t| t.measured.clone()).ok()?);
    scene.lay_over("before", draw(&|t| t.before.clone()).ok()?);
    if !same {
        scene.lay_over(name, draw(&after).ok()?);
    }
    scene.symbolic = model.joint().is_some();
    if factor > 1.0 {
        scene.notes.push(format!("Differences from what was measured are drawn {factor} times as large."));
    }
    let lit = lit(&found.diagnosis, model.joint().is_some());
    let parts = scene.parts.iter_mut().filter(|part| part.layer == 0 && lit.contains(&part.name));
    parts.for_each(|part| part.look = PartLook::Lit);
    Some(scene)
}

/// Names of the parts that a diagnosis names: of what it claims, else of where an unknown cause is.
fn lit(d: &Diagnosis, is_joint: bool) -> Vec<String> {
    let place = d.unknown.place.as_deref().filter(|_| d.verdict == Verdict::Unknown);
    let claims = d.effects.iter().map(|e| (e.component.as_str(), e.joint));
    let all = claims.chain(place.map(|place| (place, None)));
    all.filter_map(|(component, joint)| part(component, joint, is_joint)).collect()
}

/// The part of a picture that a component is in.
fn part(component: &str, joint: Option<usize>, is_joint: bool) -> Option<String> {
    match (component, joint) {
        ("actuator" | "motor-friction", _) if is_joint => Some("motor".into()),
        ("transmission", _) if is_joint => Some("joint".into()),
        ("load" | "tip", _) if is_joint => Some("load".into()),
        ("base", _) => Some("satellite".into()),
        (_, Some(joint)) => Some(format!("link {joint}")),
        _ => None,
    }
}
