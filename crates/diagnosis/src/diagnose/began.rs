//! Where the last model's free runs began: whoever replays it has this to go by, and some of it no sensor shows.

use trueup_identification::predict::PredictError;

use crate::engine::problem::Compared;
use crate::engine::replay::Complete;
use crate::engine::search::Search;

/// Its file.
pub const FILE: &str = "first-states.csv";

/// What was estimated of one recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Began {
    /// Its name.
    pub recording: String,
    /// First states by FMU variable, in its unit.
    pub states: Vec<(String, f64)>,
    /// Those that no channel shows.
    pub hidden: Vec<String>,
    /// What constant offsets add to readings, by channel.
    pub offsets: Vec<(String, f64)>,
}

impl Began {
    /// Of a recording that this model runs freely.
    pub(super) fn of(search: &Search<'_>, model: &Complete, run: &Compared) -> Result<Self, PredictError> {
        let begins = search.begins(model, run)?;
        let subject = &search.case.subject;
        let names: Vec<String> =
            subject.parameters(&model.stated.model).into_iter().map(|n| n.name).collect();
        let shown = |list: &[(usize, f64)]| {
            list.iter().any(|(output, _)| run.run.channels.iter().any(|c| c.output == *output))
        };
        let coordinates = subject.coordinates(&model.stated.model, &model.stated.nominal);
        let hidden = coordinates.iter().filter(|c| !shown(&c.positions)).filter_map(|c| c.start);
        let hidden = hidden.flatten().filter_map(|at| names.get(at).cloned()).collect();
        let first = names.into_iter().zip(begins.parameters);
        let states = first.filter(|(name, _)| name.starts_with("initial")).collect();
        let channel = |(output, value)| {
            let name = run.run.channels.iter().find(|c| c.output == output)?.name.clone();
            Some((name, value))
        };
        let offsets = begins.offsets.into_iter().filter_map(channel).collect();
        Ok(Self { recording: run.run.name.clone(), states, hidden, offsets })
    }
}

/// As a file: recording, what, value.
pub fn csv(all: &[Began]) -> String {
    let mut out = "recording,variable,value\n".to_owned();
    for began in all {
        let offsets = began.offsets.iter().map(|(channel, v)| (format!("offset of {channel}"), v));
        for (name, value) in began.states.iter().map(|(n, v)| (n.clone(), v)).chain(offsets) {
            out += &format!("{},{name},{value:?}\n", began.recording);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_a_line_for_each() {
        let began = Began {
            recording: "a.csv".into(),
            states: vec![("initialBaseRate".into(), 0.25)],
            hidden: vec!["initialBaseRate".into()],
            offsets: vec![("jointAngle[1]".into(), -1e-3)],
        };
        let wanted =
            "recording,variable,value\na.csv,initialBaseRate,0.25\na.csv,offset of jointAngle[1],-0.001\n";
        assert_eq!(csv(&[began]), wanted);
    }
}
