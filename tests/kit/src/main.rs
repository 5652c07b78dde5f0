//! `trueup-testkit DIR` builds all blocks of all problems into DIR, `<problem>/<block>.fmi2.fmu` and `.fmi3.fmu`.

use std::path::Path;
use std::process::ExitCode;

use trueup_testkit::{BlockFmu, BlockVersion, problems};

#[allow(clippy::print_stderr)]
fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: trueup-testkit DIR");
        return ExitCode::from(2);
    };
    match build(folder.as_ref()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn build(folder: &Path) -> std::io::Result<()> {
    for (name, problem) in [
        ("two-mass", problems::two_mass()),
        ("two-mass-plain", problems::two_mass().map(BlockFmu::plain)),
        ("two-mass-stiff", problems::stiff_two_mass()),
        ("quarter-car", problems::quarter_car()),
        ("lotka-volterra", problems::lotka_volterra()),
        ("feedthrough-loop", problems::feedthrough_loop(-0.9)),
        ("feedthrough-loop-unstable", problems::feedthrough_loop(1.1)),
        ("equation-pair", problems::equation_pair(false)),
        ("drift", problems::drift()),
        ("jumps", problems::jumps()),
    ] {
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder)?;
        for block in &problem.blocks {
            for version in BlockVersion::ALL {
                block.build(version, &folder)?;
            }
        }
    }
    Ok(())
}
