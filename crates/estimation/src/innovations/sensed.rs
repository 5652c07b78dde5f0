//! Known errors of readings: recordings as they are without them.
//!
//! ```text
//! y_(k+1) = r - (s(y_k, t) - y_k),  y_0 = r      s: what the sensor makes of y, r: the reading
//! ```
//!
//! A known delay is one of the channel. Sizes are those of the case: of errors other than delays none is refitted.

use std::borrow::Cow;

use trueup_models::effect::EffectChoice;
use trueup_models::plants;
use trueup_numerics::hybrid::At;
use trueup_signals::{Channel, Loaded, ParameterValue, PriorGuess, Recording};

use super::trajectory::structures::number_of;
use crate::case_structure::case_structure;

/// Rounds of the inversion: each multiplies what is left by the slope of the error, some hundredths.
const ROUNDS: usize = 6;

/// A case without the errors of readings that `[effects]` declares.
pub fn without_sensor_effects(loaded: &Loaded) -> Cow<'_, Loaded> {
    let case = &loaded.case;
    let Ok(mut structure) = case_structure(case, &[]) else { return Cow::Borrowed(loaded) };
    let Ok(plain) = plants::build(&plants::PlantStructure { effects: Vec::new(), ..structure.clone() })
    else {
        return Cow::Borrowed(loaded);
    };
    let kind = plants::effect_plant(&*plain);
    let choice = |id: &str| EffectChoice::parse(id, kind).ok();
    let of_sensor = |id: &str| choice(id).is_some_and(|c| c.component().starts_with("sensor"));
    structure.effects.retain(|id| of_sensor(id));
    let choices: Vec<EffectChoice> = structure.effects.iter().filter_map(|id| choice(id)).collect();
    if choices.is_empty() {
        return Cow::Borrowed(loaded);
    }
    let (late, wrong): (Vec<_>, Vec<_>) = choices.into_iter().partition(|c| c.spec().shifts);
    structure.effects = wrong.iter().map(EffectChoice::id).collect();
    let Ok(with) = plants::build(&structure) else { return Cow::Borrowed(loaded) };
    let (sizes, table, effects) = (with.sizes(), with.table(), plants::effects(&*with));
    let own_names: Vec<String> = (table.parameters.iter().map(|q| q.name.clone()))
        .filter(|name| plain.table().parameter(name).is_none())
        .chain(late.iter().filter_map(|c| Some(c.variable(c.parameters().first()?.name))))
        .collect();
    let mut own = loaded.clone();
    own.case.effects.retain(|e| !of_sensor(&e.id));
    for r in own.recordings.values_mut() {
        let value = |name: &str| given(loaded, r, name);
        let p: Vec<f64> = (table.parameters.iter())
            .map(|q| {
                let given = value(&q.name).and_then(|v| number_of(q, &v));
                given.unwrap_or_else(|| q.neutral.unwrap_or(q.start))
            })
            .collect();
        let (x, u, modes) = (vec![0.0; sizes.states], vec![0.0; sizes.inputs], vec![0; sizes.modes]);
        let mut shown = vec![0.0; sizes.outputs];
        let delays: Vec<Option<PriorGuess>> = (r.channels.iter())
            .map(|c| late.iter().find_map(|choice| delay_of(loaded, choice, c, &value)))
            .collect();
        r.parameters.retain(|name, _| {
            !own_names.iter().any(|own| name == own || name.split_once('[').is_some_and(|n| n.0 == own))
        });
        let begin = r.start;
        for (c, delay) in r.channels.iter_mut().zip(delays) {
            let seen = c.sensor.delay;
            if let Some(delay) = delay {
                c.sensor.delay += delay.value;
                c.sensor.late = later(c.sensor.late, delay, c.sensor.delay);
            }
            let Some(output) = table.outputs.iter().position(|q| q.name == c.name) else { continue };
            let (gain, offset) = (c.sensor.believed_gain(), c.sensor.believed_offset());
            for (t, reading) in c.time.iter().zip(&mut c.values) {
                let read = (*reading - offset) / gain;
                let mut y = read;
                for _ in 0..ROUNDS {
                    shown[output] = y;
                    effects
                        .sense(&At { t: t - seen - begin, x: &x, u: &u, p: &p, modes: &modes }, &mut shown);
                    y = read - (shown[output] - y);
                }
                *reading = gain * y + offset;
            }
        }
    }
    Cow::Owned(own)
}

/// What is estimated of a delay, `total` in all, to which a known one is added; `None`: nothing.
fn later(before: Option<PriorGuess>, added: PriorGuess, total: f64) -> Option<PriorGuess> {
    match (before, added.doubt) {
        (None, None) => None,
        (Some(PriorGuess { doubt: None, .. }), _) => Some(PriorGuess { value: total, doubt: None }),
        (before, doubt) => {
            let both = before.and_then(|b| b.doubt).unwrap_or(0.0).hypot(doubt.unwrap_or(0.0));
            // The assumed value of the channel's own estimate may differ from its delay.
            let value = before.map_or(total, |b| b.value + added.value);
            Some(PriorGuess { value, doubt: Some(both) })
        }
    }
}

/// A value that a recording has, or its case.
fn given(loaded: &Loaded, recording: &Recording, name: &str) -> Option<ParameterValue> {
    recording.parameters.get(name).or_else(|| loaded.case.parameters.get(name)).cloned()
}

/// The known delay of a channel by an effect of its own, with its standard deviation where one is declared, s.
fn delay_of(
    loaded: &Loaded,
    choice: &EffectChoice,
    channel: &Channel,
    value: &dyn Fn(&str) -> Option<ParameterValue>,
) -> Option<PriorGuess> {
    let place = choice.place()?.name;
    let index = channel.name.strip_prefix(place).filter(|i| i.is_empty() || i.starts_with('['))?;
    let name = format!("{}{index}", choice.variable(choice.parameters().first()?.name));
    let delay = value(&name)?.number()?;
    let doubt = loaded.case.doubt(&name).filter(|_| delay != 0.0);
    Some(PriorGuess { value: delay, doubt: doubt.map(|d| d * delay.abs()) })
}
