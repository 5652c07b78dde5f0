//! Attributes of XML elements (URDF, MJCF), with their lines.

use roxmltree::Node;

use super::tree::FileFault;

/// Line of the file in which an element begins.
pub(super) fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

/// An attribute that its element has to have.
pub(super) fn needed<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, FileFault> {
    let why = || format!("<{}> has no attribute `{name}`; give it one", node.tag_name().name());
    node.attribute(name).ok_or_else(|| (line(node), why()))
}

/// Finite numbers with blanks between; `None`: something else is among them.
fn finite(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect()
}

/// The numbers of an attribute, as many as there are.
pub(super) fn numbers(node: Node<'_, '_>, name: &str, text: &str) -> Result<Vec<f64>, FileFault> {
    let why = || format!("{name}=\"{text}\": give finite numbers, with blanks between");
    finite(text).ok_or_else(|| (line(node), why()))
}

/// The `N` numbers of an attribute.
pub(super) fn fixed<const N: usize>(
    node: Node<'_, '_>,
    name: &str,
    text: &str,
) -> Result<[f64; N], FileFault> {
    let why = || format!("{name}=\"{text}\": give {N} finite number(s), with blanks between");
    finite(text).and_then(|list| list.try_into().ok()).ok_or_else(|| (line(node), why()))
}
