//! Variables by the names that a user writes.

use trueup_fmi_description::description::{Description, DescriptionVariable, StartValues, VariableType};

use crate::buffer::ValueBuffer;

/// The variable of that name and, of an array of FMI 3.0, the position of the element in `name[1,2]`.
pub(crate) fn find<'a>(
    d: &'a Description,
    name: &str,
) -> Result<(&'a DescriptionVariable, Option<usize>), String> {
    let unknown = || format!("the FMU has no variable `{name}`; `trueup fmu info` lists them");
    if let Some(v) = d.find(name) {
        return Ok((v, None));
    }
    let (array, indices) = name.strip_suffix(']').and_then(|n| n.rsplit_once('[')).ok_or_else(unknown)?;
    let v = d.find(array).ok_or_else(unknown)?;
    let lengths = d.lengths(v).ok_or_else(|| format!("the size of `{array}` is not known"))?;
    let outside = || format!("`{name}` is outside of `{array}`, whose size is {lengths:?} (indices from 1)");
    let indices: Vec<usize> =
        indices.split(',').map(|i| i.trim().parse().map_err(|_| outside())).collect::<Result<_, _>>()?;
    if indices.len() != lengths.len() || indices.iter().zip(&lengths).any(|(i, n)| *i < 1 || i > n) {
        return Err(outside());
    }
    Ok((v, Some(indices.iter().zip(&lengths).fold(0, |at, (i, n)| at * n + i - 1))))
}

/// Names of a variable's elements: `a[1,2]`, row by row; its own if it is a scalar.
pub(crate) fn elements(d: &Description, v: &DescriptionVariable) -> Option<Vec<String>> {
    if v.dimensions.is_empty() {
        return Some(vec![v.name.clone()]);
    }
    let mut names = vec![String::new()];
    for length in d.lengths(v)? {
        let with = |name: &String| {
            (1..=length)
                .map(|i| format!("{name}{}{i}", if name.is_empty() { "" } else { "," }))
                .collect::<Vec<_>>()
        };
        names = names.iter().flat_map(with).collect();
    }
    Some(names.into_iter().map(|indices| format!("{}[{indices}]", v.name)).collect())
}

/// The start values as the description gives them.
pub(crate) fn start(d: &Description, v: &DescriptionVariable) -> Option<ValueBuffer> {
    let mut buffer = ValueBuffer::new(v.kind, d.version, d.elements(v)?)?;
    let texts: Vec<String> = match v.start.as_ref()? {
        StartValues::Real(x) => x.iter().map(|x| format!("{x:?}")).collect(),
        StartValues::Signed(x) => x.iter().map(ToString::to_string).collect(),
        StartValues::Unsigned(x) => x.iter().map(ToString::to_string).collect(),
        StartValues::Boolean(x) => x.iter().map(ToString::to_string).collect(),
        StartValues::Text(x) => x.clone(),
        StartValues::Binary(_) => return None,
    };
    (texts.len() == d.elements(v)?).then_some(())?;
    texts.iter().enumerate().all(|(i, text)| buffer.parse(i, text)).then_some(buffer)
}

/// Sets one element from what a user writes; items of an enumeration by name or number.
pub(crate) fn assign(
    d: &Description,
    v: &DescriptionVariable,
    buffer: &mut ValueBuffer,
    at: usize,
    text: &str,
) -> Result<(), String> {
    let items = v.declared_type.as_deref().and_then(|t| d.declared_type(t)).map_or(&[][..], |t| &t.items);
    let text = text.trim();
    let item = items.iter().find(|item| item.name == text).map(|item| item.value.to_string());
    let known = item.is_some() || items.is_empty() || items.iter().any(|i| i.value.to_string() == text);
    let finite = !v.kind.is_float() || text.parse::<f64>().is_ok_and(f64::is_finite);
    if known && finite && buffer.parse(at, item.as_deref().unwrap_or(text)) {
        return Ok(());
    }
    let wanted = if v.kind == VariableType::Enumeration && !items.is_empty() {
        items.iter().map(|i| i.name.as_str()).collect::<Vec<_>>().join(", ")
    } else {
        format!("{:?}", v.kind)
    };
    Err(format!("`{}` cannot be {text:?}; expected: {wanted}", v.name))
}
