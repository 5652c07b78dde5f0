//! The joint of an FMU for the engine: channels by what they are, usual sizes, nominal parameters.

use std::sync::Arc;

use trueup_hypotheses::innovations::foreign::{ForeignJoint, JointRoles};
use trueup_plant::Plant;
use trueup_signals::{Channel, Loaded};

use super::names::ChannelVariable;

/// Share of the speeds that are not larger than the usual one.
const USUAL: f64 = 0.97;

/// Channels under the names that the engine has for what they are; others are left out.
pub(super) fn named(loaded: &Loaded, channels: &[ChannelVariable]) -> Loaded {
    let mut loaded = loaded.clone();
    for r in loaded.recordings.values_mut() {
        let known = |c: &Channel| channels.iter().find(|(_, variable)| *variable == c.name).map(|k| k.0);
        let own = std::mem::take(&mut r.channels);
        let named = |c: Channel| known(&c).map(|name| Channel { name: name.to_owned(), ..c });
        r.channels = own.into_iter().filter_map(named).collect();
    }
    loaded
}

/// The joint with the parameters of the case, and its usual speed, rad/s.
pub(super) fn joint(
    loaded: &Loaded,
    plant: &Arc<dyn Plant>,
    roles: &JointRoles,
    refused: Vec<String>,
) -> Result<(ForeignJoint, f64), String> {
    let case = &loaded.case;
    if let Some(id) = case.known_effects().first() {
        return Err(format!(
            "`{id}` of [effects] is known of models of this project only; remove it, or give it to the FMU"
        ));
    }
    let ratio = roles.ratio.map(|k| plant.table().parameters[k].name.clone());
    if let Some(name) = ratio.filter(|name| case.doubt(name).is_some()) {
        return Err(format!(
            "the gear ratio `{name}` of an FMU is taken as known; remove it from [uncertain]"
        ));
    }
    let value = |name: &str, start: f64| case.number(name).unwrap_or(start);
    let nominal: Vec<f64> = plant.table().parameters.iter().map(|q| value(&q.name, q.start)).collect();
    let gear = roles.ratio.map_or(roles.gear_ratio, |k| nominal[k]);
    let speed = usual_speed(loaded, gear);
    let joint = ForeignJoint::new(plant, roles, case, nominal, [speed, usual_drive(loaded)], refused);
    Ok((joint.map_err(|e| format!("{}: {e}", case.model))?, speed))
}

fn all<'a>(loaded: &'a Loaded, name: &'a str) -> impl Iterator<Item = &'a Channel> {
    loaded.train().into_iter().filter_map(move |r| r.channel(name))
}

fn usual_speed(loaded: &Loaded, gear: f64) -> f64 {
    let slopes = |name: &'static str, turns: f64| {
        all(loaded, name).flat_map(move |c| {
            let every = (c.len() / 200).max(1);
            let at: Vec<(f64, f64)> = c.time.iter().copied().zip(c.believed()).step_by(every).collect();
            at.windows(2).map(|w| (turns * (w[1].1 - w[0].1) / (w[1].0 - w[0].0)).abs()).collect::<Vec<_>>()
        })
    };
    let mut speeds: Vec<f64> = slopes("motorAngle", 1.0).chain(slopes("loadAngle", gear)).collect();
    speeds.retain(|v| v.is_finite());
    speeds.sort_by(f64::total_cmp);
    let at = (USUAL * speeds.len() as f64) as usize;
    speeds.get(at).copied().filter(|v| *v > 0.0).unwrap_or(1.0)
}

fn usual_drive(loaded: &Loaded) -> f64 {
    let squares: Vec<f64> = all(loaded, "motorCurrent").flat_map(Channel::believed).map(|u| u * u).collect();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    Some(mean.sqrt()).filter(|u| *u > 0.0).unwrap_or(1.0)
}
