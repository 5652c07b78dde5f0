//! Short runs by a sweep, with its log, compared with a bare loop over the same systems: prints the ratio of both times.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

use std::time::Instant;

use trueup_cosim::{Files, Master, SeriesMemory, check_with};
use trueup_sweep::{Runner, Shard};
use trueup_testkit::{BlockVersion, problems};

const SWEEP: &str = "system = \"left.fmi3.fmu\"\ndesign = \"sobol\"\nruns = 4000\n[run]\nstop = 0.1\nstep = 0.01\n\
    [factors]\nx1Start = { from = -1, to = 1 }\n[outputs]\nx1 = {}\n";

fn main() {
    if !trueup_testkit::compiler() {
        println!("no C compiler (cc): nothing measured");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    problems::two_mass().blocks[0].build(BlockVersion::Three, folder.path()).unwrap();
    let file = folder.path().join("s.toml");
    std::fs::write(&file, SWEEP).unwrap();
    let mut ratios = Vec::new();
    for _ in 0..5 {
        let mut runner = Runner::open(&file).unwrap();
        let clock = Instant::now();
        assert_eq!(runner.shard(Shard { index: 1, of: 1 }, |_| {}).unwrap().failed, 0);
        let sweep = clock.elapsed();
        std::fs::remove_dir_all(runner.sweep().folder()).unwrap();
        let mut files = Files::default();
        let clock = Instant::now();
        for run in 1..=runner.design().runs() {
            let plan = check_with(&runner.system(run).unwrap(), &mut files).unwrap();
            Master::new(plan).unwrap().run(&mut SeriesMemory::default()).unwrap();
        }
        ratios.push(sweep.as_secs_f64() / clock.elapsed().as_secs_f64());
    }
    ratios.sort_by(f64::total_cmp);
    println!("sweep with its log / bare loop: {:.2} (median of {})", ratios[2], ratios.len());
}
