//! `trueup identify`

mod json;
mod page;
pub(crate) mod statics;
mod table;

use trueup_identification::fmu::FmuModel;
use trueup_identification::identify::{Settings, identify, identify_fmu};

use crate::args::Identify;
use crate::case::{Purpose, load, load_for};
use crate::error::Error;
use crate::output::say;

pub(crate) fn run(args: &Identify) -> Result<(), Error> {
    let progress = |what: &str| eprintln!("{what} ...");
    let settings = Settings { method: args.method, profile: !args.fast, progress: &progress };
    let (loaded, found) = match &args.fmu {
        Some(file) => {
            let model = FmuModel::open(file).map_err(|e| Error::at(file, e))?;
            let loaded = load_for(&args.case, &model)?;
            let found = identify_fmu(&loaded, model, &settings);
            (loaded, found)
        }
        None => {
            let (loaded, _) = load(&args.case, Purpose::Identify)?;
            let found = identify(&loaded, &settings);
            (loaded, found)
        }
    };
    let found = found.map_err(|e| Error::at(&loaded.case.file, e))?;
    if let Some(file) = &args.plot {
        crate::output::write(file, page::page(&loaded.case, &found).as_bytes())?;
    }
    say(&if args.json { format!("{:#}\n", json::json(&found)) } else { table::text(&found) })
}
