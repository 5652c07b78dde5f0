//! Every mistake is found, all of them at once, each with its line and the remedy.

use crate::system::Desk;

const TWO: &str = "[components.a]\nfmu = \"all.fmu\"\n[components.b]\nfmu = \"all.fmu\"\n";

/// The mistakes of one connection between two of `all.fmu`.
fn connection(desk: &Desk, text: &str) -> Vec<String> {
    desk.mistakes(&format!("connections = [{text}]\n{TWO}"))
}

#[test]
fn of_the_format() {
    let desk = Desk::new();
    for (toml, said) in [
        ("", "1: there are no components; write [components.<name>]"),
        ("[components.a]\n", "1: [components.a] names no FMU; write fmu = \"<file>.fmu\""),
        ("[run]\nstopp = 1\n", "2: [run] has no `stopp`; did you mean `stop`?"),
        ("[runn]\n", "1: a system has no `runn`; did you mean `run`?"),
        ("[run]\nstop = \"1\"\n", "2: `stop` is a finite number"),
        ("[run]\nstop = nan\n", "2: `stop` is a finite number"),
        ("[run]\nalgorithm = \"gauss\"\n", "2: `algorithm`: there is no algorithm \"gauss\""),
        ("run = 3\n", "1: `run` is a table, not an integer"),
        ("[components.a]\nfmu = 3\n", "2: `fmu` is a text in quotes, not an integer"),
        (
            "[components.a]\nfmu = \"all.fmu\"\ninterface = \"cosim\"\n",
            "3: `interface`: there is no interface \"cosim\"",
        ),
        (
            "[components.a]\nfmu = \"all.fmu\"\nstart = { gain = 1979-05-27 }\n",
            "3: `gain`: a start value is a number",
        ),
        (
            "[components.a]\nfmu = \"all.fmu\"\nconnections = []\n",
            "3: [components.a] has no `connections`; move it above the first [table]",
        ),
        ("connections = \"a.x -> a.u\"\n", "1: `connections` is a list"),
        (
            "connections = [\"a.x - a.u\"]\n",
            "1: \"a.x - a.u\" is no connection; write \"from.output -> to.input\"",
        ),
        ("connections = [\"a -> a.u\"]\n", "1: `a` names no variable; write component.variable"),
        ("connections = [{ from = \"a.x\" }]\n", "1: a connection needs `to = \"component.variable\"`"),
        (
            "connections = [{ from = \"a.x\", to = \"a.u\", faktor = 2 }]\n",
            "1: a connection has no `faktor`; did you mean `factor`?",
        ),
        ("record = [{ name = \"a.x\" }]\n", "1: a record has no `name`"),
        ("record = [{ variable = \"a.x\", every = 0.5 }]\n", "1: `every` is a whole number"),
        ("[inputs]\ncolumns = {}\n", "1: [inputs] needs `file"),
        ("[components.a]\nfmu = \"x\n", "2: "),
        ("[components.a]\n[components.a]\n", "2: duplicate key"),
    ] {
        let mistakes = desk.mistakes(toml);
        assert!(mistakes.iter().any(|m| m.starts_with(said)), "{toml}: {mistakes:#?}");
    }
}

#[test]
fn of_names() {
    let desk = Desk::new();
    for (text, said) in [
        ("'c.x -> b.u'", "1: `c.x`: there is no component `c`; there is "),
        ("'a.xx -> b.u'", "1: `a.xx`: the FMU has no variable `xx`"),
        ("'a.angl -> b.u'", "1: `a.angl`: the FMU has no variable `angl`; did you mean `angle`?"),
        (
            "'a.vector[3] -> b.u'",
            "1: `a.vector[3]`: `vector[3]` is outside of `vector`, whose size is 2 (indices from 1)",
        ),
        ("'a.vector[0] -> b.u'", "1: `a.vector[0]`: `vector[0]` is outside of"),
        ("'a.x[1] -> b.u'", "1: `a.x[1]`: `x[1]` is outside of `x`, whose size is 1"),
    ] {
        let mistakes = connection(&desk, text);
        assert!(mistakes.iter().any(|m| m.starts_with(said)), "{text}: {mistakes:#?}");
    }
}

#[test]
fn of_connections() {
    let desk = Desk::new();
    for (text, said) in [
        ("'a.u -> b.u'", "`a.u` is an input; only what an FMU computes can be handed on"),
        ("'b.u -> a.x'", "`b.u` is an input and `a.x` an output; swap them"),
        ("'a.x -> b.x'", "`b.x` is an output; only inputs can be driven"),
        ("'a.x -> b.gain'", "`b.gain` is a parameter; give it a start value instead"),
        ("'a.x -> b.fixed'", "`b.fixed` is no input"),
        ("'a.time -> b.u'", "`a.time` is the time"),
        ("'a.x -> b.target'", "`a.x` has size 1, `b.target` has size 2; connect elements, as in `name[1]`"),
        ("'a.matrix -> b.target'", "`a.matrix` has size 2 x 3, `b.target` has size 2"),
        ("'a.x -> b.u', 'a.angle -> b.u'", "`b.u` is driven twice, see"),
        ("'a.vector -> b.target', 'a.x -> b.target[2]'", "`b.target[2]` is driven twice"),
        // Types.
        (
            "'a.x -> b.single'",
            "`a.x` -> `b.single`: Float64 cannot be handed on as Float32: digits would be lost",
        ),
        ("'a.x -> b.wide'", "Float64 cannot be handed on as Int64: fractions would be lost"),
        ("'a.count -> b.small'", "Int32 cannot be handed on as Int8: not every value fits"),
        (
            "'a.count -> b.enable'",
            "Int32 cannot be handed on as Boolean: not every number is true or false; give a map",
        ),
        (
            "'a.x -> b.mode'",
            "Float64 cannot be handed on as Enumeration: not every number is an item; give a map",
        ),
        ("'a.gear -> b.mode'", "the enumerations differ: `park` = 1 is no item of the input; give a map"),
        ("'a.text -> b.u'", "String cannot be handed on as Float64: one is text"),
        ("'a.blob -> b.u'", "Binary cannot be handed on as Float64: binaries and clocks"),
        (
            "{ from = 'a.count', to = 'b.wide', factor = 2 }",
            "a factor or an offset needs an input that is a float, not Int64",
        ),
        (
            "{ from = 'a.x', to = 'b.u', map = { 1 = 2 } }",
            "a map replaces integers, Booleans and items of enumerations only",
        ),
        (
            "{ from = 'a.gear', to = 'b.mode', map = { reverse = 'on' } }",
            "the map: \"reverse\" is no value of Enumeration",
        ),
        (
            "{ from = 'a.gear', to = 'b.mode', map = { park = 'out' } }",
            "the map: \"out\" is no value of Enumeration",
        ),
        ("{ from = 'a.gear', to = 'b.mode', map = { park = 'on', 1 = 'off' } }", "the map has 1 twice"),
        // Units.
        ("'a.angle -> b.force'", "rad (rad) is not of the same quantity as N (kg.m.s-2)"),
        ("{ from = 'a.x', to = 'b.u', factor = 1e308, offset = inf }", "`offset` is a finite number"),
    ] {
        let mistakes = connection(&desk, text);
        assert!(mistakes.iter().any(|m| m.starts_with("1: ") && m.contains(said)), "{text}: {mistakes:#?}");
        assert_eq!(mistakes.len(), 1, "{text}: {mistakes:#?}");
    }
}

#[test]
fn of_start_values() {
    let desk = Desk::new();
    for (start, said) in [
        ("gian = 1", "start of `a.gian`: the FMU has no variable `gian`; did you mean `gain`?"),
        ("gain = -1", "start of `a.gain`: -1.0 rad is below its minimum 0.0 rad"),
        ("gain = 11.0", "start of `a.gain`: 11.0 rad is above its maximum 10.0 rad"),
        ("gain = 'x'", "start of `a.gain`: `gain` cannot be \"x\"; expected: Float64"),
        ("gain = inf", "start of `a.gain`: `gain` cannot be \"inf\""),
        ("gain = [1, 2]", "start of `a.gain`: it has 1 elements, 2 are given"),
        (
            "gain = { value = 1, unit = 'N' }",
            "start of `a.gain`: its unit is rad (rad), the value is in N (kg.m.s-2)",
        ),
        (
            "gain = { value = 1, unit = 'mile' }",
            "start of `a.gain`: the unit mile is not defined; define it (SSP: <Units>), or give the value in rad or deg",
        ),
        ("fixed = 1", "start of `a.fixed`: it is a constant and cannot be set"),
        (
            "x = 1",
            "start of `a.x`: it is an output, which the FMU computes and cannot be set; set a parameter or an input",
        ),
        ("time = 1", "start of `a.time`: it is the time and cannot be set"),
        ("small = 300", "start of `a.small`: `small` cannot be \"300\"; expected: Int8"),
        ("mode = 'of'", "start of `a.mode`: `mode` cannot be \"of\"; expected: off, on"),
        ("matrix = [1, 2]", "start of `a.matrix`: it has 2 x 3 elements, 2 are given"),
        (
            "\"matrix[3,1]\" = 1",
            "start of `a.matrix[3,1]`: `matrix[3,1]` is outside of `matrix`, whose size is 2 x 3",
        ),
        ("\"bare[1]\" = 1", "`bare` has no start values of its own; give all elements, also `bare[2]`"),
        ("n = 9", "start of `a.n`: 9.0 is above its maximum 8.0"),
        ("n = 3, target = [1, 2]", "start of `a.target`: it has 3 elements, 2 are given"),
    ] {
        let mistakes = desk.mistakes(&format!("[components.a]\nfmu = \"all.fmu\"\nstart = {{ {start} }}\n"));
        assert_eq!(mistakes.len(), 1, "{start}: {mistakes:#?}");
        assert!(mistakes[0].starts_with(&format!("3: {said}")), "{start}: {mistakes:#?}");
    }
}

#[test]
fn of_components() {
    let desk = Desk::new();
    for (toml, said) in [
        ("[components.a]\nfmu = \"al.fmu\"\n", "1: there is no file al.fmu; did you mean `all.fmu`?"),
        (
            "[components.a]\nfmu = \"all.fmu\"\ninterface = \"model-exchange\"\n",
            "1: all.fmu does not offer model-exchange; it offers co-simulation",
        ),
        (
            "[components.a]\nfmu = \"old.fmu\"\ninterface = \"cs\"\n",
            "1: old.fmu does not offer co-simulation; it offers model-exchange",
        ),
        (
            "[components.a]\nfmu = \"even.fmu\"\n[components.b]\nfmu = \"even.fmu\"\n",
            "3: even.fmu can be instantiated only once per process",
        ),
        ("[components.a]\nfmu = \"system.toml\"\n", "1: system.toml is no FMU or not all of one"),
    ] {
        let mistakes = desk.mistakes(toml);
        assert_eq!(mistakes.len(), 1, "{toml}: {mistakes:#?}");
        assert!(mistakes[0].starts_with(said), "{toml}: {mistakes:#?}");
    }
}

#[test]
fn of_times() {
    let desk = Desk::new();
    for (run, more, said) in [
        ("stop = -1", "", "1: no run from 0.0 s to -1.0 s in steps of 0.01 s"),
        ("step = 0", "", "1: no run from 0.0 s to 4.0 s in steps of 0.0 s"),
        ("step = 1e-300", "", "1: no run from"),
        (
            "step = 0.01",
            "step = 0.025\n",
            "3: the step 0.025 s of `a` is no whole multiple of the communication step 0.01 s",
        ),
        ("step = 0.01", "step = 0.001\n", "3: the step 0.001 s of `a` is no whole multiple"),
        (
            "stop = 1\nstep = 0.3",
            "[components.e]\nfmu = \"even.fmu\"\n",
            ": the FMU of `e` takes steps of equal length only, and 0.3 s does not divide 1 s",
        ),
        (
            "stop = 1\nstep = 0.1",
            "[components.e]\nfmu = \"even.fmu\"\nstep = 0.4",
            ": the FMU of `e` takes steps of equal length only, and 0.4 s does not",
        ),
    ] {
        let mistakes = desk.mistakes(&format!(
            "run = {{ {} }}\n\n[components.a]\nfmu = \"all.fmu\"\n{more}",
            run.replace('\n', ", ")
        ));
        assert_eq!(mistakes.len(), 1, "{run}: {mistakes:#?}");
        assert!(mistakes[0].contains(said), "{run}: {mistakes:#?}");
    }
}

#[test]
fn of_records_and_inputs() {
    let desk = Desk::new();
    desk.write("in.csv", "time,a.u,other,a.small\n0,1,2,3\n");
    desk.write("big.csv", "time,a.small\n0,300\n");
    desk.write("odd.csv", "time,a.x,u\n0,1,2\n");
    for (top, said) in [
        ("record = ['a.angel']", "`a.angel`: the FMU has no variable `angel`; did you mean `angle`?"),
        ("record = ['x']", "`x` names no variable; write component.variable"),
        ("record = ['a.x', 'a.*']", "the column `a.x` is there already"),
        ("record = ['a.blob']", "`a.blob` is a Binary and cannot be recorded"),
        ("record = ['d.x']", "there is no component `d`"),
        ("inputs = 'none.csv'", "none.csv"),
        ("inputs = 'in.csv'", "column `other` names no input"),
        ("inputs = 'odd.csv'", "column `u` names no input"),
        ("inputs = 'big.csv'", "column `a.small`: line 2, a.small: \"300\" is no Int8"),
        (
            "inputs = { file = 'in.csv', columns = { othr = 'a.u' } }",
            "in.csv has no column `othr`; did you mean `other`?",
        ),
        ("inputs = { file = 'in.csv', columns = { other = 'a.x' } }", "column `other`: `a.x` is no input"),
        (
            "inputs = { file = 'in.csv', columns = { other = 'a.target' } }",
            "`a.target` is an array of size 2; give one column per element",
        ),
        (
            "inputs = { file = 'in.csv', columns = { other = 'b.u' } }\nconnections = ['a.x -> b.u']",
            "`b.u` is driven twice",
        ),
    ] {
        let mistakes = desk.mistakes(&format!("{top}\n{TWO}"));
        assert_eq!(mistakes.len(), 1, "{top}: {mistakes:#?}");
        assert!(mistakes[0].contains(said), "{top}: {mistakes:#?}");
    }
}

#[test]
fn all_at_once_in_the_order_of_the_file() {
    let desk = Desk::new();
    let mistakes = desk.mistakes(
        "connections = [\n  'a.x -> b.force',\n  'a.angle -> b.force',\n  'c.x -> b.u',\n]\nrecord = ['a.angel']\n\
         [components.a]\nfmu = \"all.fmu\"\nstart = { gain = -1, gian = 1 }\n[components.b]\nfmu = \"all.fmu\"\n[components.z]\nfmu = \"none.fmu\"\n",
    );
    let lines: Vec<&str> = mistakes.iter().map(|m| m.split(':').next().unwrap()).collect();
    assert_eq!(lines, ["3", "3", "4", "6", "9", "9", "12"], "{mistakes:#?}");
}
