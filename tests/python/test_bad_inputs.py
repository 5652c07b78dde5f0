"""Files as people write them: good ones, changed in a way that is drawn. Each way has its expected outcome:

- refused: exit status 1, one error that names the file (and the line, or the name at fault), nothing under the name of the results;
- the same: exit status 0 and the same results as of the unchanged file;
- noted: exit status 0, the same results unless noted otherwise, and a note that names what is not used or was chosen.

Whatever is drawn: no panic, no silence, no hang. The seed is printed; TRUEUP_SEED chooses another one.
"""

# Their ways are drawn in this order.
import input_text
import input_files
import input_parquet
import pytest
from input_desk import COMMANDS, WAYS, Desk, good, near, tried

FEW, ALL = 20, 300


@pytest.fixture
def desk(tmp_path):
    return Desk(tmp_path)


def drawn(desk, count):
    pytest.importorskip("pyarrow")
    good(desk)
    for command, arguments in COMMANDS.items():
        if command == "case":
            continue
        done = desk.run(*arguments)
        assert done.returncode == 0 and "error" not in done.stderr, f"{command}, unchanged: {done.stderr}"
        assert "error" not in done.stderr, done.stderr
        if (desk.folder / "out.csv").exists():
            desk.unchanged[command] = desk.results()
            (desk.folder / "out.csv").unlink()
    assert near(desk.unchanged["lists"], desk.unchanged["arm"])
    tried(desk, WAYS, count)


def test_what_is_drawn_is_the_same_named_or_refused(desk):
    drawn(desk, FEW)


@pytest.mark.full
def test_three_hundred_are_the_same_named_or_refused(desk):
    drawn(desk, ALL)


def test_ways_are_found():
    assert len(WAYS) >= 40 and {way.__module__ for way in WAYS} == {m.__name__ for m in (input_text, input_files, input_parquet)}
