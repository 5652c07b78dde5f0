"""Ways to change Parquet files and arrays in tables; test_bad_inputs.py runs them."""

from input_desk import ROWS, TORQUES, lists, noted, parquet, refused, same, way


@way
def parquet_of_every_kind(desk, rng):
    parquet(desk, compression=rng.choice(["none", "snappy", "zstd", "gzip"]), use_dictionary=rng.random() < 0.5)
    return same("parquet")


@way
def parquet_with_times_by_their_type(desk, rng):
    import pyarrow as pa

    unit = rng.choice(["ms", "us", "ns"])
    per_second = {"ms": 1_000, "us": 1_000_000, "ns": 1_000_000_000}[unit]
    counts = [round(t * per_second) for t, *_ in ROWS]
    if rng.random() < 0.5:
        parquet(desk, {"time": pa.array(counts, pa.duration(unit))})
        return same("parquet")
    start = rng.randrange(1_000_000_000, 2_000_000_000) * per_second
    parquet(desk, {"time": pa.array([start + n for n in counts], pa.timestamp(unit))})
    return noted("parquet", "in.parquet", "Unix time", "from the first row")


@way
def parquet_without_rows(desk, rng):
    import pyarrow as pa
    import pyarrow.parquet as pq

    empty = pa.table({name: pa.array([], pa.float64()) for name in ("time", "motorCurrent")})
    pq.write_table(empty, desk.folder / "in.parquet")
    if rng.random() < 0.3:
        desk.write("in.parquet", b"")
    return refused("parquet", "in.parquet", "export the recording again")


@way
def parquet_that_is_damaged(desk, rng):
    path = desk.folder / "in.parquet"
    bytes_ = path.read_bytes()
    path.write_bytes(bytes_[: rng.randrange(1, len(bytes_) - 1)])
    return refused("parquet", "in.parquet", "Parquet")


@way
def parquet_with_a_column_that_drives_nothing(desk, rng):
    parquet(desk, {"motorAngle": [rng.random() for _ in ROWS]})
    return noted("parquet", "in.parquet", "drive nothing", "`motorAngle`")


@way
def an_array_in_a_cell(desk, rng):
    blank = rng.choice([" ", "  "])
    rows = "".join(f"{t:.2f},{blank.join(map(repr, values))}\n" for t, values in TORQUES)
    desk.write("arm.csv", "time,jointTorque\n" + rows)
    return same("arm")


@way
def an_array_that_is_too_short(desk, rng):
    row = rng.randrange(1, len(TORQUES))
    rows = [[f"{t:.2f}", " ".join(map(repr, values))] for t, values in TORQUES]
    rows[row][1] = " ".join(rows[row][1].split()[:2])
    desk.write("arm.csv", "time,jointTorque\n" + "".join(",".join(r) + "\n" for r in rows))
    return refused("arm", f"arm.csv:{row + 2}:", "2 values in the cell, 3 in the rows before")


@way
def lists_that_are_not_of_one_length(desk, rng):
    values = [list(v) for _, v in TORQUES]
    values[rng.randrange(1, len(values))].append(1.0)
    lists(desk, values)
    return noted("lists", "arm.parquet", "`jointTorque`", "not all of one length", results=False)
