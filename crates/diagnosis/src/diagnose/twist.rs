//! The twist of a transmission as a channel: motor angle over the gear ratio less load angle. Compliance and play show in it, and
//! what moves both ends alike does not.

use trueup_models::effect::PlantKind;
use trueup_models::joint::parameter;

use super::ChannelTrace;
use crate::engine::problem::Compared;
use crate::engine::recordings::PreparedCase;

/// A transmission whose ends may be recorded: name of the twist, channels of motor and load, motor turns per load turn.
struct TransmissionEnds {
    name: String,
    motor: String,
    load: String,
    ratio: f64,
}

fn transmissions(case: &PreparedCase) -> Vec<TransmissionEnds> {
    let subject = &case.subject;
    match subject.plant {
        PlantKind::Joint => vec![TransmissionEnds {
            name: "twist".into(),
            motor: "motorAngle".into(),
            load: "loadAngle".into(),
            ratio: case.nominal.get(parameter::GEAR_RATIO).copied().unwrap_or(1.0),
        }],
        // An arm's motor angles are joint-referred.
        PlantKind::Arm | PlantKind::Space => (1..=subject.joints())
            .map(|j| TransmissionEnds {
                name: format!("twist[{j}]"),
                motor: format!("motorAngle[{j}]"),
                load: format!("jointAngle[{j}]"),
                ratio: 1.0,
            })
            .collect(),
    }
}

/// The twists of recordings in which both ends were read at the same times; rad on the load's side. Their floor is that of the
/// sensors: noise of inputs that is carried along moves both ends alike.
pub(super) fn twists(case: &PreparedCase, runs: &[Compared], traces: &[ChannelTrace]) -> Vec<ChannelTrace> {
    let ends = transmissions(case);
    let noise = |t: &ChannelTrace| {
        let run = runs.iter().find(|r| r.run.name == t.recording);
        run.and_then(|r| r.run.channels.iter().find(|c| c.name == t.channel)).map_or(t.floor, |c| c.sigma)
    };
    let of = |end: &TransmissionEnds, motor: &ChannelTrace| {
        let same = |t: &&ChannelTrace| t.recording == motor.recording && t.channel == end.load;
        let load = traces.iter().find(same).filter(|load| load.time == motor.time)?;
        let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a / end.ratio - b).collect();
        Some(ChannelTrace {
            recording: motor.recording.clone(),
            channel: end.name.clone(),
            time: motor.time.clone(),
            measured: difference(&motor.measured, &load.measured),
            before: difference(&motor.before, &load.before),
            tuned: difference(&motor.tuned, &load.tuned),
            after: difference(&motor.after, &load.after),
            floor: (noise(motor) / end.ratio).hypot(noise(load)),
        })
    };
    let motors =
        |end: &TransmissionEnds| traces.iter().filter(|t| t.channel == end.motor).collect::<Vec<_>>();
    ends.iter()
        .flat_map(|end| motors(end).into_iter().filter_map(|m| of(end, m)).collect::<Vec<_>>())
        .collect()
}
