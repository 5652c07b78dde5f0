//! What the command line requests, in addition to the file's settings.

use trueup_cosim::InputMistake;
use trueup_cosim::system::{CosimSystem, InputFile, RecordedVariable, SourceSpan};

use crate::args::Simulate;

/// Reads the file and puts the options of the command line over it.
pub(super) fn system(args: &Simulate) -> Result<CosimSystem, trueup_cosim::CosimError> {
    let mut system = CosimSystem::read(&args.file)?;
    let mut mistakes = Vec::new();
    for text in &args.set {
        let place = said(&format!("--set {text}"));
        let done = match text.split_once('=') {
            Some((name, value)) => system.set(name.trim(), value.trim(), &place),
            None => Err(InputMistake { place, message: "write NAME=VALUE".into() }),
        };
        mistakes.extend(done.err());
    }
    let run = &mut system.run;
    for (asked, slot, flag) in [
        (args.start, &mut run.start, "--start"),
        (args.stop, &mut run.stop, "--stop"),
        (args.step, &mut run.step, "--step"),
        (args.tolerance, &mut run.tolerance, "--tolerance"),
    ] {
        if let Some(value) = asked {
            *slot = Some(value);
            run.place = said(&format!("{flag} {value:?}"));
        }
    }
    run.algorithm = args.algorithm.or(run.algorithm);
    if let Some(interface) = args.interface {
        system.components.iter_mut().for_each(|c| c.interface = Some(interface));
    }
    if let Some(file) = &args.input {
        let place = SourceSpan { file: file.clone(), line: 0 };
        // Columns that the system gives a meaning keep it.
        let columns = system.inputs.take().map(|i| i.columns).unwrap_or_default();
        system.inputs = Some(InputFile { file: file.clone(), columns, place });
    }
    if !args.outputs.is_empty() {
        let place = said("--outputs");
        let names = args.outputs.iter().flat_map(|list| names(list));
        system.record = names
            .map(|name| RecordedVariable { name, place: place.clone(), ..RecordedVariable::default() })
            .collect();
    }
    if mistakes.is_empty() { Ok(system) } else { Err(trueup_cosim::CosimError::System(mistakes)) }
}

/// The command line as a place.
fn said(option: &str) -> SourceSpan {
    SourceSpan { file: option.into(), line: 0 }
}

/// All of it concerns the command line, not a file.
pub(super) fn is_usage(mistakes: &[InputMistake]) -> bool {
    mistakes.iter().all(|m| m.place.file.to_string_lossy().starts_with("--"))
}

/// Names separated by commas; those in brackets belong to an element, `a[1,2]`.
fn names(list: &str) -> Vec<String> {
    let (mut names, mut depth) = (vec![String::new()], 0_u32);
    for c in list.chars() {
        depth = match c {
            '[' => depth + 1,
            ']' => depth.saturating_sub(1),
            _ => depth,
        };
        match names.last_mut() {
            Some(last) if c != ',' || depth > 0 => last.push(c),
            _ => names.push(String::new()),
        }
    }
    names.into_iter().map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::names;

    #[test]
    fn commas_in_brackets_separate_nothing() {
        assert_eq!(names("a, b[1,2],c[3]"), ["a", "b[1,2]", "c[3]"]);
        assert_eq!(names("a,"), ["a"]);
    }
}
