//! Attributes of elements, with their lines.

use roxmltree::Node;

use crate::robot::tree::FileFault;

pub(super) fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

pub(super) fn needed<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, FileFault> {
    let why = || format!("<{}> has no attribute `{name}`; give it one", node.tag_name().name());
    node.attribute(name).ok_or_else(|| (line(node), why()))
}

/// Numbers of an attribute.
pub(super) fn numbers(node: Node<'_, '_>, name: &str, text: &str) -> Result<Vec<f64>, FileFault> {
    let list: Option<Vec<f64>> =
        text.split_whitespace().map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    list.ok_or_else(|| (line(node), format!("{name}=\"{text}\": give finite numbers, with blanks between")))
}

pub(super) fn fixed<const N: usize>(
    node: Node<'_, '_>,
    name: &str,
    text: &str,
) -> Result<[f64; N], FileFault> {
    let list = numbers(node, name, text)?;
    <[f64; N]>::try_from(list).map_err(|_| {
        (line(node), format!("{name}=\"{text}\": give {N} finite number(s), with blanks between"))
    })
}
