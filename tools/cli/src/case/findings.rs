//! What is wrong with a case, reported in few lines.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use trueup_signals::Finding;

/// Findings that are reported one by one; of each kind one is, however many kinds there are.
const MOST: usize = 20;

/// Lines to be reported, the worst first. Where findings are too many, those of the kinds that are most are counted: none of
/// them may hide another kind.
pub(super) fn lines(findings: &[Finding]) -> Vec<String> {
    let mut kinds: Vec<Vec<&Finding>> = Vec::new();
    for f in findings {
        match kinds.iter_mut().find(|k| (k[0].severity, k[0].kind) == (f.severity, f.kind)) {
            Some(kind) => kind.push(f),
            None => kinds.push(vec![f]),
        }
    }
    kinds.sort_by_key(|kind| Reverse(kind[0].severity));
    let told = |each: usize| kinds.iter().map(|kind| kind.len().min(each)).sum::<usize>();
    let each = (2..=MOST).take_while(|each| told(*each) <= MOST).last().unwrap_or(1);
    let of_kind = |kind: &Vec<&Finding>| {
        let (shown, rest) = kind.split_at(each.min(kind.len()));
        let more = rest.first().map(|next| {
            let files: BTreeSet<_> = rest.iter().map(|f| &f.file).collect();
            let place = match files.len() {
                1 => format!("in {}", next.file.display()),
                n => format!("in {n} files, {} the first of them", next.file.display()),
            };
            format!("{} more of this kind ({}) {place}", rest.len(), next.kind.id())
        });
        let severity = kind[0].severity.id();
        let lines = shown.iter().map(ToString::to_string).chain(more);
        lines.map(|line| format!("{severity}: {line}")).collect::<Vec<_>>()
    };
    kinds.iter().flat_map(of_kind).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use trueup_signals::FindingKind;

    fn gap(file: &str, channel: usize) -> Finding {
        Finding::warning(FindingKind::Dropout, Path::new(file), "a gap", "").channel(format!("x[{channel}]"))
    }
    fn nan() -> Finding {
        Finding::note(FindingKind::NotANumber, Path::new("b.csv"), "nan is taken as an empty cell", "")
    }

    #[test]
    fn no_kind_is_hidden_and_none_is_lost() {
        let mut findings =
            vec![nan(), Finding::error(FindingKind::NoInput, Path::new("c.csv"), "no input", "")];
        findings.extend((0..15).map(|i| gap("a.csv", i)));
        findings.extend((0..15).map(|i| gap(if i < 14 { "b.csv" } else { "c.csv" }, i)));
        let lines = lines(&findings);
        assert_eq!(lines[0], "error: c.csv: no input");
        assert_eq!(lines[1], "warning: a.csv: x[0]: a gap");
        assert_eq!(lines[18], "warning: b.csv: x[2]: a gap");
        assert_eq!(lines[19], "warning: 12 more of this kind (dropout) in 2 files, b.csv the first of them");
        assert_eq!(lines[20..], ["note: b.csv: nan is taken as an empty cell"]);
    }

    #[test]
    fn few_are_told_one_by_one() {
        let findings: Vec<_> = (0..MOST).map(|i| gap("a.csv", i)).collect();
        assert_eq!(lines(&findings).len(), MOST);
        let findings: Vec<_> = (0..=MOST).map(|i| gap("a.csv", i)).collect();
        assert_eq!(lines(&findings).last().unwrap(), "warning: 1 more of this kind (dropout) in a.csv");
    }

    /// Of many kinds with many findings each, errors and notes: one of each and how many more.
    #[test]
    fn many_kinds_have_a_line_each() {
        let kinds = [
            FindingKind::Constant,
            FindingKind::Clipped,
            FindingKind::Stuck,
            FindingKind::Spike,
            FindingKind::Dropout,
            FindingKind::NoNoise,
        ];
        let make = [Finding::error, Finding::warning, Finding::note];
        let findings: Vec<_> = (0..10)
            .flat_map(|_| make.iter().flat_map(|make| kinds.map(|k| make(k, Path::new("a.csv"), "it", ""))))
            .collect();
        let lines = lines(&findings);
        assert_eq!(lines.len(), 2 * 3 * kinds.len());
        assert_eq!(lines.iter().filter(|l| l.contains(": 9 more of this kind")).count(), 3 * kinds.len());
    }
}
