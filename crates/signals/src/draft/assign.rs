//! Which variable a column measures, by its name and unit, and by ranges where those say nothing.

use std::collections::BTreeMap;

use super::look::{LogColumn, LookedLog};
use super::words::{NameMeaning, Quantity, Side};
use crate::names::base_name;
use crate::unit::SignalUnit;
use crate::variable::{SignalVariable, VariableRole};

/// A column that measures a variable.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Assigned {
    pub(super) column: String,
    pub(super) variable: String,
    /// Unit to be written; `None`: the file gives it itself, or it is SI.
    pub(super) unit: Option<String>,
    pub(super) scale: Option<f64>,
    /// What was guessed; empty: nothing.
    pub(super) guesses: Vec<String>,
}

/// All columns of a log with what they may be.
pub(super) fn assign(log: &LookedLog, known: &[SignalVariable]) -> Vec<Assigned> {
    let zero = counted_from_zero(&log.columns);
    let variables: Vec<(&SignalVariable, NameMeaning)> = known
        .iter()
        .filter(|v| v.role != VariableRole::Parameter)
        .map(|v| (v, NameMeaning::of(&v.name, None)))
        .collect();
    let mut pairs: Vec<(i32, usize, usize, Assigned)> = Vec::new();
    for (at, column) in log.columns.iter().enumerate() {
        let mut meaning = column.meaning.clone();
        if zero.contains(&family(&column.name)) {
            meaning.index = meaning.index.map(|k| k + 1);
        }
        for (of, (variable, own)) in variables.iter().enumerate() {
            if let Some((score, assigned)) = pair(column, &meaning, (variable, own), &variables) {
                pairs.push((score, at, of, assigned));
            }
        }
    }
    // The best first; of equal ones the first in the file and in the model.
    pairs.sort_by_key(|(score, at, of, _)| (-score, *at, *of));
    let mut all: Vec<(usize, usize, Assigned)> = Vec::new();
    for (_, at, of, assigned) in pairs {
        if !all.iter().any(|(a, o, _)| *a == at || *o == of) {
            all.push((at, of, assigned));
        }
    }
    all.sort_by_key(|(at, ..)| *at);
    let mut all: Vec<Assigned> = all.into_iter().map(|(.., assigned)| assigned).collect();
    motor_turns_more(log, &mut all);
    all
}

/// The name without its numbers, wherever they are: `joint_0_pos` and `joint_1_pos` are of one family.
fn family(name: &str) -> String {
    name.chars().filter(|c| !c.is_ascii_digit() && !matches!(c, '[' | ']')).collect()
}

/// Families of numbered names whose first is 0.
fn counted_from_zero(columns: &[LogColumn]) -> Vec<String> {
    columns.iter().filter(|c| c.meaning.index == Some(0)).map(|c| family(&c.name)).collect()
}

/// How well a column goes with a variable; `None`: not at all.
fn pair(
    column: &LogColumn,
    meaning: &NameMeaning,
    (variable, own): (&SignalVariable, &NameMeaning),
    all: &[(&SignalVariable, NameMeaning)],
) -> Option<(i32, Assigned)> {
    let mut out = Assigned {
        column: column.name.clone(),
        variable: variable.name.clone(),
        unit: None,
        scale: None,
        guesses: Vec::new(),
    };
    if column.name == variable.name {
        return Some((1000, out));
    }
    let mut score = quantity(meaning.quantity?, own.quantity?)?;
    if own.rest.iter().any(|word| !meaning.rest.contains(word)) {
        return None;
    }
    let input = variable.role == VariableRole::Input;
    match (meaning.command, own.command) {
        (true, false) if input => {
            score -= 3;
            out.guesses.push("a command, taken as what was applied".into());
        }
        (true, false) | (false, true) => return None,
        _ => {}
    }
    // The only one of its quantity is meant, whatever its side.
    let base = base_name(&variable.name);
    let same = |(v, meaning): &(&SignalVariable, NameMeaning)| {
        base_name(&v.name) != base && meaning.quantity == own.quantity
    };
    score += match meaning.side {
        None if !far(own.side) && !all.iter().any(same) => 8,
        log => side(log, own.side, &mut out.guesses)?,
    };
    // Of an array the element, of a numbered column whichever is left.
    let elements = all.iter().filter(|(v, _)| base_name(&v.name) == base).count();
    match (meaning.index, own.index) {
        (Some(a), Some(b)) if a == b => score += 2,
        (Some(_), Some(_)) => return None,
        (None, Some(_)) if elements > 1 => return None,
        _ => {}
    }
    score += unit(column, meaning, variable, &mut out)?;
    // Words without a meaning here, and a column that does not move, speak against it.
    score -= i32::try_from(meaning.rest.len().min(5)).unwrap_or(5);
    if column.span == 0.0 {
        score -= 10;
    }
    Some((score, out))
}

fn quantity(a: Quantity, b: Quantity) -> Option<i32> {
    match (a, b) {
        (Quantity::Time, _) | (_, Quantity::Time) => None,
        _ if a == b => Some(20),
        (Quantity::Position, Quantity::Angle) | (Quantity::Angle, Quantity::Position) => Some(19),
        _ => None,
    }
}

/// Of no joint: only a name with that word measures it.
fn far(side: Option<Side>) -> bool {
    matches!(side, Some(Side::External | Side::Base | Side::Tip))
}

fn side(log: Option<Side>, own: Option<Side>, guesses: &mut Vec<String>) -> Option<i32> {
    let mut guess = |score: i32, text: &str| {
        guesses.push(text.to_owned());
        Some(score)
    };
    match (log, own) {
        (Some(a), Some(b)) if a == b => Some(12),
        (a, b) if far(a) || far(b) => None,
        (Some(Side::Joint), Some(Side::Load)) => {
            guess(5, "a joint's reading, taken as the load side of the gear")
        }
        (Some(Side::Load), Some(Side::Joint)) => Some(6),
        (Some(Side::Joint), Some(Side::Motor)) => guess(4, "a joint's reading, taken as the motor's"),
        (Some(Side::Motor), Some(Side::Joint)) => guess(3, "a motor's reading, taken as the joint's"),
        (None, Some(Side::Motor | Side::Joint)) => guess(4, "its name has no side"),
        (None, Some(Side::Load)) => guess(3, "its name has no side"),
        (None, None) => Some(8),
        (Some(_), None) => Some(2),
        (_, Some(_)) => None,
    }
}

/// The unit of the file or of the name has to fit; without one SI is a guess, which values may contradict.
fn unit(
    column: &LogColumn,
    meaning: &NameMeaning,
    variable: &SignalVariable,
    out: &mut Assigned,
) -> Option<i32> {
    let own = SignalUnit::parse(&variable.unit)?;
    if let Some(text) = &column.unit {
        let fits = SignalUnit::parse(text).is_some_and(|u| u.fits(&own));
        return fits.then_some(4);
    }
    if meaning.counts {
        out.guesses.push("counts of an encoder: write `scale` = 2 pi / counts per turn".into());
        out.scale = Some(1.0);
        return Some(1);
    }
    if let Some(text) = &meaning.unit {
        let unit = SignalUnit::parse(text)?;
        if !unit.fits(&own) {
            return None;
        }
        if unit != own {
            out.unit = Some(text.clone());
        }
        return Some(4);
    }
    let most = column.most;
    let whole = column.whole && most > 50.0;
    match (variable.unit.as_str(), whole) {
        ("A", _) if most > 200.0 => {
            out.unit = Some("mA".into());
            out.guesses.push(format!("values up to {most}: taken as mA"));
        }
        ("rad", true) => {
            out.scale = Some(1.0);
            out.guesses
                .push("whole numbers, counts of an encoder: write `scale` = 2 pi / counts per turn".into());
        }
        (si, _) => out.guesses.push(format!("its unit is not given: taken as {si}")),
    }
    Some(0)
}

/// Two angles without a side, of a motor and its load: the one that turns more is the motor's.
fn motor_turns_more(log: &LookedLog, all: &mut [Assigned]) {
    let mut sides: BTreeMap<&str, usize> = BTreeMap::new();
    for (i, a) in all.iter().enumerate() {
        if a.guesses.iter().any(|g| g == "its name has no side") {
            sides.insert(a.variable.as_str(), i);
        }
    }
    let pairs: Vec<[usize; 2]> = [["motorAngle", "loadAngle"], ["motorVelocity", "loadVelocity"]]
        .iter()
        .filter_map(|[motor, load]| Some([*sides.get(motor)?, *sides.get(load)?]))
        .collect();
    for [motor, load] in pairs {
        let moves = |i: usize| {
            let column = log.columns.iter().find(|c| c.name == all[i].column);
            let unit = all[i].unit.as_deref().and_then(SignalUnit::parse).unwrap_or(SignalUnit::ONE);
            column.map_or(0.0, |c| unit.to_si(c.span))
        };
        if moves(load) > moves(motor) {
            let (a, b) = (all[motor].variable.clone(), all[load].variable.clone());
            (all[motor].variable, all[load].variable) = (b, a);
        }
        for i in [motor, load] {
            all[i].guesses.retain(|g| g != "its name has no side");
            all[i]
                .guesses
                .push("its name has no side: the column that turns more is taken as the motor's".into());
        }
    }
}
