//! Whether ports fit the FMU's description: names, causality, units, one role for each variable.

use std::path::Path;

use trueup_cosim::system::SourceSpan;
use trueup_cosim::{InputMistake, suggestion};
use trueup_fmi_description::description::DescriptionCausality;

use crate::kind::PortKind;
use crate::quantity::{FmuQuantities, FmuQuantity, causality};
use crate::roles::{FmuPorts, PortRole, PortVariable};

/// Every mistake of a user's file.
pub fn mistakes(ports: &FmuPorts, all: &FmuQuantities, file: &Path, fmu: &Path) -> Vec<InputMistake> {
    let mut found = Vec::new();
    let mut wrong = |line: u32, message: String| {
        found.push(InputMistake { place: SourceSpan { file: file.into(), line }, message });
    };
    let name = fmu.file_name().unwrap_or_default().to_string_lossy();
    let given = Path::new(&ports.fmu).file_name().unwrap_or_default().to_string_lossy();
    if given != name {
        wrong(
            0,
            format!(
                "these are the ports of `{}`, compared with `{name}`; name the same FMU in both",
                ports.fmu
            ),
        );
    }
    for (at, v) in ports.variables.iter().enumerate() {
        if let Some(first) = ports.variables[..at].iter().find(|other| collide(other, v)) {
            let what = format!(
                "`{}` is {} of [{}] already, in line {}; keep the one that is right",
                v.variable,
                first.role.key(),
                first.place.table(),
                first.line
            );
            wrong(v.line, what);
        } else if let Err(what) = role_fits(v, all) {
            wrong(v.line, what);
        }
    }
    for s in &ports.sensors {
        if let Err(what) = find(&s.variable, DescriptionCausality::Output, "a sensor", all) {
            wrong(s.line, what);
        }
    }
    found
}

/// Two roles on one variable. Motor and link of a rigid joint may be one.
fn collide(a: &PortVariable, b: &PortVariable) -> bool {
    let one = |x: PortRole, y: PortRole| (a.role, b.role) == (x, y) || (b.role, a.role) == (x, y);
    let rigid = a.place == b.place
        && (one(PortRole::MotorAngle, PortRole::LinkAngle)
            || one(PortRole::MotorVelocity, PortRole::LinkVelocity));
    a.variable == b.variable && !rigid
}

fn find<'a>(
    name: &str,
    wanted: DescriptionCausality,
    what: &str,
    all: &'a FmuQuantities,
) -> Result<&'a FmuQuantity, String> {
    let lists = [&all.inputs, &all.outputs, &all.parameters];
    let fitting = lists.into_iter().flatten().filter(|q| q.causality == wanted);
    if let Some(q) = lists.into_iter().flatten().find(|q| q.name == name) {
        if q.causality == wanted {
            return Ok(q);
        }
        let names: Vec<&str> = fitting.map(|q| q.name.as_str()).collect();
        let mend = suggestion(name, names);
        return Err(format!(
            "`{name}` is {}, and {what} is {}{mend}",
            causality(q.causality),
            causality(wanted)
        ));
    }
    if let Some((_, is)) = all.others.iter().find(|(other, _)| other == name) {
        let mend = match wanted {
            DescriptionCausality::Output => "export it as an output of type Float64 (Real)",
            _ => "name another variable",
        };
        return Err(format!("`{name}` is {is}, and {what} is {}; {mend}", causality(wanted)));
    }
    let of = format!("{name}[");
    if let Some(element) = lists.into_iter().flatten().find(|q| q.name.starts_with(&of)) {
        return Err(format!("`{name}` is an array; name one element, such as `{}`", element.name));
    }
    let mend = suggestion(name, fitting.map(|q| q.name.as_str()));
    let mend = if mend.is_empty() { "; `trueup fmu info` lists its variables".to_owned() } else { mend };
    Err(format!("the FMU has no variable `{name}`{mend}"))
}

fn role_fits(v: &PortVariable, all: &FmuQuantities) -> Result<(), String> {
    let what = format!("`{}` of [{}]", v.role.key(), v.place.table());
    let q = find(&v.variable, v.role.causality(), &what, all)?;
    let kinds = v.role.kinds();
    // Without a unit anything may be meant.
    if kinds.contains(&q.kind) || q.by_name {
        return Ok(());
    }
    let kinds: Vec<&str> = kinds.iter().map(|k| k.name()).collect();
    let is = match q.kind {
        PortKind::Other => format!("has the unit {}", q.unit),
        kind => format!("is {} ({})", kind.name(), q.unit),
    };
    Err(format!("`{}` {is}, and {what} is {}; name another variable", v.variable, kinds.join(" or ")))
}
