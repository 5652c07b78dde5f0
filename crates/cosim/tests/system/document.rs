//! The examples of docs/systems.md are understood as they are.

use std::path::Path;

use trueup_cosim::CosimError;
use trueup_cosim::check;
use trueup_cosim::system::CosimSystem;

use crate::system::Desk;

#[test]
fn every_block_of_the_document() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let document = std::fs::read_to_string(root.join("docs/systems.md")).unwrap();
    let desk = Desk::new();
    for model in ["TwoMassJoint", "PlanarManipulator", "JointController"] {
        let text = std::fs::read_to_string(root.join(format!("modelDescription/{model}/fmi3.xml"))).unwrap();
        desk.fmu(&format!("{model}.fmi3"), &text);
    }
    let blocks: Vec<&str> =
        document.split("```toml\n").skip(1).filter_map(|b| b.split("```").next()).collect();
    assert_eq!(blocks.len(), 6);
    for block in blocks {
        let whole = block.contains("[components.");
        let text = if whole {
            block.to_owned()
        } else {
            format!("{block}\n[components.plant]\nfmu = \"all.fmu\"\n")
        };
        let read = CosimSystem::read(&desk.write("s.toml", &text)).map_err(|e| e.to_string());
        let plan = check(&read.unwrap_or_else(|e| panic!("{block}\n{e}")));
        match plan {
            Ok(_) => {}
            // Fragments name components that are not there.
            Err(CosimError::System(list)) if !whole => {
                let other = |m: &&trueup_cosim::InputMistake| {
                    !m.message.contains("there is no")
                        && !m.message.contains("drive.csv")
                        && !m.message.contains("has no variable")
                };
                assert_eq!(list.iter().find(other), None, "{block}");
            }
            Err(e) => panic!("{block}\n{e}"),
        }
    }
}
