"""Results: Arrow tables, times of events."""

import numpy as np
import pyarrow as pa
import pytest


def test_a_table_of_arrow_has_columns_and_units(joint):
    run = joint.simulate(np.linspace(0, 0.1, 11), {"motorCurrent": np.linspace(0, 0.02, 11)})
    table = run.to_arrow()
    assert table.column_names == ["time", *run.names] and table.num_rows == 11
    assert table.schema.field("sticking").type == pa.bool_()
    assert table.schema.field("loadAngle").metadata == {b"unit": b"rad"}
    np.testing.assert_array_equal(table["motorAngle"].to_numpy(), run["motorAngle"])


@pytest.mark.parametrize("interface", ["model-exchange", "co-simulation"])
def test_times_of_events_are_those_of_the_rows(joint, interface):
    """A ramp breaks the joint away where the torque reaches static friction (TMJ-4)."""
    t = np.linspace(0, 1, 101)
    inputs = {"motorCurrent": 0.02 * t}
    values = {"torqueConstant": 0.02, "staticFriction": 1.82e-4, "coulombFriction": 1.7e-4}
    run = joint.simulate(t, inputs, values, events=True, interface=interface, tolerance=1e-9)
    assert len(run.events) == 1 and abs(run.events[0] - 0.455) < 1e-6
    assert joint.simulate(t, inputs, values).events.size == 0
