//! `trueup demo`: packs the FMUs, lets the master run systems of them, draws what they did; before that it
//! identifies and diagnoses a case whose cause is sealed, and opens the seal.

mod gallery;
mod loops;
mod metric;
mod story;
mod waves;

use crate::args::{Demo, Pack};
use crate::error::CliError;
use crate::voice;
use trueup_report::Page;

pub(crate) fn demo(args: &Demo) -> Result<(), CliError> {
    let folder = &args.output;
    crate::output::folder(folder)?;
    voice::line("[1/6] packing all models for FMI 2.0 and 3.0");
    let pack = |models: &[&str], effects: &[&str]| {
        super::pack::run(&Pack {
            model: models.iter().map(|m| (*m).to_owned()).collect(),
            output: folder.clone(),
            effect: effects.iter().map(|e| (*e).to_owned()).collect(),
            ..Pack::default()
        })
    };
    pack(&[], &[])?;
    pack(&["TwoMassJoint"], &["flexible-link"])?;

    let mut page = Page::new(
        "Trueup: a gap explained, and the FMUs of this build at work",
        "First a simulation that does not match its recordings, and the missing effect. Then the models: every picture and curve below was made by packed FMUs that the master ran, as it runs FMUs of other vendors. The systems are next to this \
         page as TOML: trueup simulate --plot runs and draws them again.",
    );
    story::tell(folder, &mut page)?;
    voice::line("[5/6] the gallery: a joint, a floating arm, a satellite with panels, DELIAN, a capture");
    gallery::draw(folder, &mut page)?;
    voice::line("[6/6] JointController and TwoMassJoint: P/PI against wave-based control");
    waves::draw(folder, &mut page)?;

    let path = folder.join("index.html");
    trueup_fmi_description::pack::write_file(&path, page.finish().as_bytes())
        .map_err(|e| CliError::Failed(e.to_string()))?;
    crate::output::say(&format!("{}\n", path.display()))
}
