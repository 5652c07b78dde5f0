//! Classes of defaults: what an element has unless it gives it itself.

use std::collections::HashMap;

use roxmltree::Node;

use crate::attributes::line;
use crate::tree::FileFault;
use trueup_signals::did_you_mean;

/// Values by element and attribute.
type ElementDefaults = HashMap<(String, String), String>;

/// Per class, with what it inherits.
pub(super) struct DefaultClasses {
    classes: HashMap<String, ElementDefaults>,
}

/// The class of what names none.
const MAIN: &str = "main";

impl DefaultClasses {
    /// Of a model.
    pub(super) fn read(model: Node<'_, '_>) -> Result<Self, FileFault> {
        let mut all = Self { classes: HashMap::from([(MAIN.to_owned(), HashMap::new())]) };
        for section in model.children().filter(|c| c.has_tag_name("default")) {
            all.section(section)?;
            // Before MuJoCo 3.1 the class of all had a name of its own.
            if let (Some(name), Some(main)) = (section.attribute("class"), all.classes.get(MAIN)) {
                all.classes.insert(name.to_owned(), main.clone());
            }
        }
        Ok(all)
    }

    /// A `<default>` of the model with all that are within it. With a stack: as a recursion, rustc 1.95 compiles it
    /// wrongly at opt-level 1 and above (a class of a class inherits from main).
    fn section(&mut self, section: Node<'_, '_>) -> Result<(), FileFault> {
        let mut open = vec![(section, MAIN, MAIN)];
        while let Some((node, parent, name)) = open.pop() {
            if node != section && self.classes.contains_key(name) {
                let why = format!("the class `{name}` of <default> is there already; give it another name");
                return Err((line(node), why));
            }
            let mut own =
                self.classes.get(name).or_else(|| self.classes.get(parent)).cloned().unwrap_or_default();
            for element in node.children().filter(|c| c.is_element() && !c.has_tag_name("default")) {
                for attribute in element.attributes() {
                    let key = (element.tag_name().name().to_owned(), attribute.name().to_owned());
                    own.insert(key, attribute.value().to_owned());
                }
            }
            self.classes.insert(name.to_owned(), own);
            // The last one is taken first: reversed, they are read in the order of the file.
            for inner in node.children().filter(|c| c.has_tag_name("default")).rev() {
                let Some(inner_name) = inner.attribute("class") else {
                    return Err((
                        line(inner),
                        "a <default> within another one has no class; give it one".into(),
                    ));
                };
                open.push((inner, name, inner_name));
            }
        }
        Ok(())
    }

    /// An attribute of an element, its own or by its class, else by that of the body which it is in.
    pub(super) fn of<'a>(
        &'a self,
        node: Node<'a, '_>,
        attribute: &str,
        class: Option<&str>,
    ) -> Result<Option<&'a str>, FileFault> {
        self.of_element(node, node.tag_name().name(), attribute, class)
    }

    /// The same of an element that has its defaults under another name.
    pub(super) fn of_element<'a>(
        &'a self,
        node: Node<'a, '_>,
        element: &str,
        attribute: &str,
        class: Option<&str>,
    ) -> Result<Option<&'a str>, FileFault> {
        if let Some(own) = node.attribute(attribute) {
            return Ok(Some(own));
        }
        let name = node.attribute("class").or(class).unwrap_or(MAIN);
        let class = self.known(node, name)?;
        Ok(class.get(&(element.to_owned(), attribute.to_owned())).map(String::as_str))
    }

    /// A class by the name that an element gives.
    pub(super) fn known(&self, node: Node<'_, '_>, name: &str) -> Result<&ElementDefaults, FileFault> {
        self.classes.get(name).ok_or_else(|| {
            let names = self.classes.keys().map(String::as_str);
            let hint = did_you_mean(name, names, "add it to <default>");
            (line(node), format!("there is no class `{name}` of <default>; {hint}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_within_a_class_inherits_from_it() {
        let text = r#"<mujoco><default><joint axis="1 0 0"/><default class="a"><joint axis="0 1 0"/>
            <default class="b"><geom size="1"/></default></default><default class="c"/></default></mujoco>"#;
        let file = roxmltree::Document::parse(text).expect("XML");
        let classes = DefaultClasses::read(file.root_element()).expect("classes");
        let axis = |class| classes.classes[class][&("joint".to_owned(), "axis".to_owned())].as_str();
        assert_eq!(["main", "a", "b", "c"].map(axis), ["1 0 0", "0 1 0", "0 1 0", "1 0 0"]);
    }
}
