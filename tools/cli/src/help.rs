//! What `--help` prints in addition to usage and options: what the command does comes first, then usage, examples, exit status.

use clap::Command;

/// Commands with examples of each.
const EXAMPLES: &[(&str, &[&str])] = &[
    (
        "trueup",
        &[
            "trueup demo",
            "trueup fmu pack -o out",
            "trueup simulate out/TwoMassJoint.fmi3.fmu -o run.csv",
            "trueup diagnose recordings -o found",
        ],
    ),
    (
        "fmu",
        &[
            "trueup fmu list",
            "trueup fmu pack TwoMassJoint -o out",
            "trueup fmu info out/TwoMassJoint.fmi3.fmu",
        ],
    ),
    (
        "fmu pack",
        &[
            "trueup fmu pack -o out",
            "trueup fmu pack TwoMassJoint --fmi 3 --effect backlash --set backlashGap=2 -o out",
            "trueup fmu pack PlanarManipulator --flexible true,false --set linkMass=4,3 -o out",
            "trueup fmu pack SpatialFreeFlyer --robot arm.toml -o out",
            "trueup fmu pack --from found/diagnosis.json -o out",
            "trueup fmu pack GripperContact --structure numberOfBalls=1 --structure endBallMount=elastic -o out",
        ],
    ),
    ("fmu list", &["trueup fmu list"]),
    (
        "fmu info",
        &["trueup fmu info out/TwoMassJoint.fmi3.fmu", "trueup fmu info out/TwoMassJoint.fmi3.fmu --json"],
    ),
    ("fmu validate", &["trueup fmu validate out/TwoMassJoint.fmi2.fmu"]),
    (
        "simulate",
        &[
            "trueup simulate out/TwoMassJoint.fmi3.fmu --set motorCurrent=-0.02 --stop 1 -o run.csv",
            "trueup simulate out/TwoMassJoint.fmi3.fmu --input inputs.csv --plot run.html",
            "trueup simulate examples/01-joint/joint.toml --set controller.strategy=WBC -o joint.csv",
            "trueup simulate examples/02-arm/arm.toml --check",
        ],
    ),
    (
        "scale",
        &[
            "trueup scale examples/02-arm/arm.toml --lambda 0.3",
            "trueup scale examples/06-backlash --lambda 0.3 --exponent A=0 -o bench",
            "trueup scale out/TwoMassJoint.fmi3.fmu --lambda 0.3 --exponent A=0 -o bench.toml",
            "trueup scale bench.csv --lambda 0.3 --back --units examples/02-arm/arm.toml -o orbit.csv",
        ],
    ),
    (
        "sweep",
        &[
            "trueup sweep examples/03-sweep/sweep.toml",
            "trueup sweep examples/03-sweep/sweep.toml --shard 1/2",
            "trueup sweep examples/03-sweep/sweep.toml --slurm=64",
            "trueup sweep examples/03-sweep/sweep.toml --run 17 -o run.csv",
        ],
    ),
    (
        "sweep map",
        &[
            "trueup sweep map examples/04-capture/capture-cells.toml --beside examples/04-capture/capture-cells.csv -o cells.html",
        ],
    ),
    ("sweep merge", &["trueup sweep merge examples/03-sweep/sweep.toml -o runs.parquet"]),
    (
        "init",
        &[
            "trueup init logs/*.csv",
            "trueup init run.mcap --model TwoMassJoint",
            "trueup init lerobot-data-set --print",
        ],
    ),
    (
        "check",
        &[
            "trueup check recordings",
            "trueup check recordings --json",
            "trueup check recordings --plot check.html",
        ],
    ),
    (
        "identify",
        &[
            "trueup identify recordings",
            "trueup identify recordings --json",
            "trueup identify recordings --fast --plot fit.html",
        ],
    ),
    (
        "ports",
        &[
            "trueup ports arm.fmu",
            "trueup ports arm.fmu --ports ports.toml",
            "trueup ports arm.fmu --interface cs --json",
        ],
    ),
    ("statics", &["trueup statics deflections.toml"]),
    ("gearbox", &["trueup gearbox gearbox.toml", "trueup gearbox gearbox.toml --json"]),
    (
        "inverse",
        &[
            "trueup inverse motion.csv -o torques.csv",
            "trueup inverse motion.csv --noise 1e-4 --set motorInertia=0,0,0",
            "trueup inverse motion.csv --flexible true,false,false --fixed-base",
        ],
    ),
    (
        "robot",
        &[
            "trueup robot chaser --pose 0.3,-0.9,1.4,0.2,-0.6,0.5 --sweep 3=-3..3",
            "trueup robot arm.toml --json",
            "trueup robot table-1 --surface 2,3 --torque-joints 1,2 -o surface.csv --plot surface.html",
        ],
    ),
    ("arm", &["trueup arm map", "trueup arm map --pose 0,1.408749,-1.408749,0,0,0"]),
    (
        "arm map",
        &[
            "trueup arm map -o out",
            "trueup arm map --pose 0,1.408749,-1.408749,0,0,0",
            "trueup arm map --payload 5 --schedule 2 -o out",
            "trueup arm map arm.toml --joints 1,2 --from 0,-2 --to 1.5,2 --steps 15,20 --payload 1.5 -o out",
        ],
    ),
    (
        "diagnose",
        &["trueup diagnose recordings -o found", "trueup diagnose recordings/case.toml -o found --json"],
    ),
    ("demo", &["trueup demo", "trueup demo -o somewhere"]),
    (
        "trial",
        &[
            "trueup trial generate -o trials --plant joint --split single --count 20",
            "trueup trial run trials",
            "trueup trial score trials -o card.md",
        ],
    ),
    (
        "bench",
        &[
            "trueup bench make -o bench --tier joint,arm --count 100",
            "trueup bench run bench/public -o trueup.csv",
            "trueup bench submit bench/public trueup.csv -o receipt.toml",
            "trueup bench score bench trueup.csv -o page.md",
        ],
    ),
    ("bench make", &["trueup bench make -o bench --tier joint,arm --count 100"]),
    ("bench run", &["trueup bench run bench/public -o trueup.csv"]),
    ("bench submit", &["trueup bench submit bench/public entry.csv -o receipt.toml"]),
    ("bench score", &["trueup bench score bench trueup.csv other.csv -o page.md"]),
    (
        "lab",
        &[
            "trueup lab new -o lab",
            "trueup diagnose lab/case -o found",
            "trueup lab run found/next-experiment.csv --rig lab",
        ],
    ),
    ("lab new", &["trueup lab new -o lab --seed 5"]),
    ("lab run", &["trueup lab run proposal.toml", "trueup lab run found/next-experiment.csv --rig lab"]),
    ("trial generate", &["trueup trial generate -o trials --plant joint --split single --count 20 --seed 7"]),
    ("trial run", &["trueup trial run trials", "trueup trial run trials --shard 1/2 --limit 120"]),
    ("trial score", &["trueup trial score trials -o card.md"]),
    ("trial compare", &["trueup trial compare trials/results trials/other"]),
    ("schema", &["trueup schema case"]),
    ("completions", &["trueup completions bash", "trueup completions zsh", "trueup completions fish"]),
    ("man", &["trueup man -o /usr/local/share/man/man1"]),
    ("trial corpus", &["trueup trial corpus corpus.csv --from trials"]),
];

const EXIT: &str = "Exit status:\n  0  done (of a diagnosis: whatever the verdict)\n  1  the work could not be done: bad data, an FMU that failed\n  \
                    2  wrong usage";

const TEMPLATE: &str = "{about-with-newline}\n{usage-heading} {usage}\n\n{before-help}{all-args}{after-help}";

/// The command and all below it, with this help.
pub(crate) fn dressed(command: Command) -> Command {
    dress(command, "trueup", |command, examples| {
        command.help_template(TEMPLATE).before_help(examples).after_help(EXIT)
    })
}

/// The same for manual pages, which have no place before the options.
pub(crate) fn for_manual(command: Command) -> Command {
    dress(command, "trueup", |command, examples| command.after_help(format!("{examples}\n\n{EXIT}")))
}

fn dress(command: Command, path: &str, with: fn(Command, String) -> Command) -> Command {
    let examples = EXAMPLES.iter().find(|(of, _)| *of == path).map_or(&[][..], |(_, examples)| examples);
    let lines: String = examples.iter().map(|e| format!("  {e}\n")).collect();
    let below: Vec<String> = command.get_subcommands().map(|c| c.get_name().to_owned()).collect();
    let dressed = with(command, format!("Examples:\n{}", lines.trim_end()));
    below.into_iter().filter(|name| name != "help").fold(dressed, |command, name| {
        let inner = if path == "trueup" { name.clone() } else { format!("{path} {name}") };
        command.mut_subcommand(name, |c| dress(c, &inner, with))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Args;
    use clap::CommandFactory;

    fn paths(command: &Command, path: &str, all: &mut Vec<String>) {
        all.push(path.to_owned());
        for c in command.get_subcommands().filter(|c| c.get_name() != "help" && !c.is_hide_set()) {
            let inner =
                if path == "trueup" { c.get_name().to_owned() } else { format!("{path} {}", c.get_name()) };
            paths(c, &inner, all);
        }
    }

    #[test]
    fn every_command_has_examples_and_every_example_is_one() {
        let mut all = Vec::new();
        paths(&Args::command(), "trueup", &mut all);
        let known: Vec<&str> = EXAMPLES.iter().map(|e| e.0).collect();
        assert_eq!(
            {
                let mut k = known.clone();
                k.sort_unstable();
                k
            },
            {
                all.sort();
                all.clone()
            }
        );
        for example in EXAMPLES.iter().flat_map(|e| e.1) {
            let parsed = Args::command().try_get_matches_from(example.split(' '));
            assert!(parsed.is_ok(), "{example}: {:?}", parsed.err().map(|e| e.to_string()));
        }
    }

    #[test]
    fn it_says_what_it_does_then_usage_examples_and_exit_status() {
        for path in EXAMPLES.iter().map(|e| e.0) {
            let words = path.split(' ').filter(|w| *w != "trueup").chain(["--help"]);
            let line = std::iter::once("trueup").chain(words);
            let Err(help) = dressed(Args::command()).try_get_matches_from(line) else { continue };
            let text = help.to_string();
            let at = |what: &str| text.find(what).unwrap_or(usize::MAX);
            let order = [at("Usage:"), at("Examples:\n  trueup"), at("Options:"), at("Exit status:")];
            assert!(order[0] > 20 && order.is_sorted() && order[3] < usize::MAX, "{path}: {text}");
            assert!(!text.starts_with("The program"), "{text}");
        }
    }
}
