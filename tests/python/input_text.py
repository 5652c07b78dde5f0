"""Ways to change tables and their sidecars as people write them; test_bad_inputs.py runs them."""

from input_desk import CSV, ROWS, noted, refused, same, way


def csv_lines(rng):
    lines = CSV.splitlines()
    row = rng.randrange(2, len(lines))
    return lines, row, lines[row].split(",")


def csv_put(desk, lines, row, cells):
    lines[row] = ",".join(cells)
    desk.write("in.csv", "\n".join(lines) + "\n")
    return f"in.csv: line {row + 1}", f":{row + 1}:"


@way
def a_word_among_numbers(desk, rng):
    lines, row, cells = csv_lines(rng)
    column = rng.randrange(0, 3)
    cells[column] = rng.choice(["oops", "1.2.3", "--5", "12a", "0x1F", "one"])
    csv_put(desk, lines, row, cells)
    return refused("input", "in.csv", str(row + 1), cells[column])


@way
def a_row_of_another_length(desk, rng):
    lines, row, cells = csv_lines(rng)
    cells = cells[:-1] if rng.random() < 0.5 else [*cells, "7"]
    csv_put(desk, lines, row, cells)
    return refused("input", "in.csv", f":{row + 1}:", f"{len(cells)} cells under 3 names")


@way
def time_that_falls(desk, rng):
    lines, row, cells = csv_lines(rng)
    cells[0] = str(float(cells[0]) - rng.uniform(0.06, 0.5))
    csv_put(desk, lines, row, cells)
    return refused("input", "in.csv", f":{row + 1}:", "jumps back")


@way
def a_time_three_times(desk, rng):
    lines, row, _ = csv_lines(rng)
    lines[row:row] = [lines[row], lines[row]]
    desk.write("in.csv", "\n".join(lines) + "\n")
    return refused("input", "in.csv", f":{row + 2}:", "3 rows share it", "rate = N")


@way
def a_value_that_is_infinite(desk, rng):
    lines, row, cells = csv_lines(rng)
    cells[rng.randrange(1, 3)] = rng.choice(["inf", "-inf", "1e999"])
    csv_put(desk, lines, row, cells)
    return refused("input", "in.csv", f"line {row + 1}", "infinite")


@way
def a_name_twice(desk, rng):
    desk.write("in.csv", CSV.replace("externalTorque", "motorCurrent"))
    return refused("input", "in.csv", ":1:", "`motorCurrent`")


@way
def a_name_misspelled(desk, rng):
    name = rng.choice(["motorCurrent", "externalTorque"])
    at = rng.randrange(1, len(name) - 1)
    wrong = name[:at] + name[at + 1] + name[at] + name[at + 2:]
    if wrong == name:
        wrong = name + "x"
    desk.write("in.csv", CSV.replace(name, wrong))
    return refused("input", "in.csv", f"`{wrong}`", f"did you mean `{name}`?")


@way
def nothing_in_it(desk, rng):
    desk.write("in.csv", rng.choice(["", CSV.splitlines()[0] + "\n"]))
    return refused("input", "in.csv", "export")


@way
def no_text(desk, rng):
    at = rng.randrange(0, 20)
    desk.write("in.csv", CSV.encode()[:at] + b"\0" + CSV.encode()[at:])
    return refused("input", "in.csv", "zero bytes")


@way
def no_time(desk, rng):
    desk.write("in.csv", CSV.replace("time", rng.choice(["t", "Time", "zeit"])))
    return refused("input", "in.csv", "no column `time`")


@way
def other_separators(desk, rng):
    separator = rng.choice([";", "\t", "|"])
    text = CSV.replace(",", separator)
    if rng.random() < 0.5:
        text = text.replace(".", ",")
    desk.write("in.csv", text)
    return noted("input", "in.csv", "separated by")


@way
def other_line_ends_and_quotes(desk, rng):
    text = CSV
    if rng.random() < 0.5:
        head, rest = text.split("\n", 1)
        text = ",".join(f'"{name}"' for name in head.split(",")) + "\n" + rest
    if rng.random() < 0.5:
        text = text.replace("\n", "\r\n")
    if rng.random() < 0.5:
        text = "\ufeff" + text
    desk.write("in.csv", text)
    return same("input")


@way
def units_in_the_head(desk, rng):
    factor, unit = rng.choice([(1e3, "mA"), (1e6, "uA")])
    rows = "".join(f"{t * 1e3:.0f},{i * factor},{e:.3f}\n" for t, i, e in ROWS)
    desk.write("in.csv", f"time [ms],motorCurrent ({unit}),externalTorque\n" + rows)
    return noted("input", "`motorCurrent`", f"{unit} converted to A")


@way
def a_unit_of_something_else(desk, rng):
    unit = rng.choice(["V", "rad", "N.m", "kg"])
    desk.write("in.csv", CSV.replace("motorCurrent", f"motorCurrent [{unit}]"))
    return refused("input", "in.csv", "`motorCurrent`", unit)


@way
def columns_that_drive_nothing(desk, rng):
    name, why = rng.choice([("motorAngle", "an output"), ("transmissionTorque", "an output"), ("initialMotorAngle", "fixed")])
    lines = CSV.splitlines()
    lines = [f"{lines[0]},{name}"] + [f"{line},7" for line in lines[1:]]
    desk.write("in.csv", "\n".join(lines) + "\n")
    return noted("input", "in.csv", "drive nothing", f"`{name}`", why)


@way
def a_tunable_parameter_as_it_is(desk, rng):
    lines = CSV.splitlines()
    lines = [f"{lines[0]},stiffness"] + [f"{line},3.07e-5" for line in lines[1:]]
    desk.write("in.csv", "\n".join(lines) + "\n")
    return same("input")


@way
def a_clock_of_the_calendar(desk, rng):
    start = rng.randrange(1_000_000_000, 2_000_000_000)
    digits = rng.choice([0, 3, 6, 9])
    rows = "".join(f"{int(round((start + t) * 100)) * 10**(digits - 2) if digits else f'{start + t:.2f}'},{i},{e:.3f}\n" for t, i, e in ROWS)
    desk.write("in.csv", "time,motorCurrent,externalTorque\n" + rows)
    return noted("input", "in.csv", "Unix time", "from the first row")


@way
def a_clock_of_milliseconds(desk, rng):
    rows = "".join(f"{t * 1e3:.0f},{i},{e:.3f}\n" for t, i, e in ROWS)
    desk.write("in.csv", "time,motorCurrent,externalTorque\n" + rows)
    return noted("input", "in.csv", "1000 s", "run ends at 1 s", 'unit = "ms"', results=False)


@way
def inputs_that_end_early(desk, rng):
    keep = rng.randrange(4, 18)
    desk.write("in.csv", "\n".join(CSV.splitlines()[: keep + 1]) + "\n")
    return noted("input", "in.csv", "held from there on", results=False)
