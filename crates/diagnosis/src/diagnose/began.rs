//! Where the last model's free runs began: a replay requires these states, some of which no sensor shows.

use crate::engine::coordinate::CoordinateReadings;
use crate::engine::problem::Compared;
use crate::engine::replay::{CompleteModel, FittedReplay};
use crate::engine::search::CaseSearch;

/// Its file.
pub const FILE: &str = "first-states.csv";

/// What was estimated of one recording.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeRunStart {
    /// Its name.
    pub recording: String,
    /// First states by FMU variable, in its unit.
    pub states: Vec<(String, f64)>,
    /// Those that no channel shows.
    pub hidden: Vec<String>,
    /// What constant offsets add to readings, by channel.
    pub offsets: Vec<(String, f64)>,
}

impl FreeRunStart {
    /// Of a recording that this model runs freely.
    pub(super) fn new(
        search: &CaseSearch<'_>,
        model: &CompleteModel,
        run: &Compared,
        fitted_replay: &FittedReplay,
    ) -> Self {
        let subject = &search.case.subject;
        let names = subject.parameters(&model.stated.model);
        let coordinates = subject.coordinates(&model.stated.model, &model.stated.nominal);
        let shown = |output: usize| run.run.channels.iter().find(|c| c.output == output);
        let hidden = hidden(&coordinates, |output| shown(output).is_some());
        // No channel shows the state of an effect.
        let effects =
            model.stated.posed.iter().flat_map(|p| p.initial.iter().map(|k| p.unknowns[*k].name.clone()));
        let mut hidden: Vec<String> =
            hidden.into_iter().filter_map(|at| Some(names.get(at)?.name.clone())).chain(effects).collect();
        hidden.dedup();
        let first = names.into_iter().zip(fitted_replay.parameters.iter().copied());
        let states = first.filter(|(q, _)| q.is_initial()).map(|(q, value)| (q.name, value)).collect();
        let channel = |&(output, value): &(usize, f64)| Some((shown(output)?.name.clone(), value));
        let offsets = fitted_replay.offsets.iter().filter_map(channel).collect();
        Self { recording: run.run.name.clone(), states, hidden, offsets }
    }
}

/// Parameters of the first states that no output shows: a position shows how fast it changes, a velocity not where it is.
fn hidden(coordinates: &[CoordinateReadings], shown: impl Fn(usize) -> bool) -> Vec<usize> {
    let any = |outputs: &[(usize, f64)]| outputs.iter().any(|(output, _)| shown(*output));
    let of = |c: &CoordinateReadings| {
        let [position, velocity] = c.start?;
        let placed = any(&c.positions);
        let moving = placed || any(&c.velocities);
        Some([(position, placed), (velocity, moving)])
    };
    let all = coordinates.iter().filter_map(of).flatten();
    all.filter(|(_, shown)| !shown).map(|(at, _)| at).collect()
}

/// As a file: recording, what, value.
///
/// # Errors
/// Of the writer.
pub fn csv(all: &[FreeRunStart]) -> Result<Vec<u8>, std::io::Error> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(["recording", "variable", "value"])?;
    for began in all {
        let offsets = began.offsets.iter().map(|(channel, v)| (format!("offset of {channel}"), v));
        for (name, value) in began.states.iter().map(|(n, v)| (n.clone(), v)).chain(offsets) {
            csv.write_record([&began.recording, &name, &format!("{value:?}")])?;
        }
    }
    csv.into_inner().map_err(csv::IntoInnerError::into_error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_a_line_for_each() {
        let began = FreeRunStart {
            recording: "a, again.csv".into(),
            states: vec![("initialBaseRate".into(), 0.25)],
            hidden: vec!["initialBaseRate".into()],
            offsets: vec![("jointAngle[1]".into(), -1e-3)],
        };
        let expected = "recording,variable,value\n\"a, again.csv\",initialBaseRate,0.25\n\
                      \"a, again.csv\",offset of jointAngle[1],-0.001\n";
        assert_eq!(String::from_utf8(csv(&[began]).unwrap()).unwrap(), expected);
    }

    #[test]
    fn a_velocity_does_not_show_where_it_began() {
        // Outputs 0 and 1 show position and velocity, parameters 10 and 11 set them first.
        let coordinate = CoordinateReadings {
            positions: vec![(0, 1.0)],
            velocities: vec![(1, 1.0)],
            start: Some([10, 11]),
            ..CoordinateReadings::default()
        };
        let follows = CoordinateReadings { start: None, ..coordinate.clone() };
        let of = |channels: &[usize]| {
            hidden(&[coordinate.clone(), follows.clone()], |output| channels.contains(&output))
        };
        assert_eq!(of(&[]), [10, 11]);
        assert_eq!(of(&[1]), [10]);
        assert_eq!(of(&[0]), [0; 0]);
        assert_eq!(of(&[0, 1]), [0; 0]);
    }
}
