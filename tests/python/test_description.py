"""What model descriptions say of quantities and of units for display, against a list of its own, and the default experiment
as FMI-LS-REF describes it."""

import csv
import io
import posixpath
import zipfile
from math import pi
from xml.etree import ElementTree

import pytest
from conftest import MODELS, ROOT

# By the quantity: exponents of kg, m, s, A, rad.
DIMENSIONS = {
    "Time": (0, 0, 1, 0, 0), "Length": (0, 1, 0, 0, 0), "Velocity": (0, 1, -1, 0, 0), "Acceleration": (0, 1, -2, 0, 0),
    "Angle": (0, 0, 0, 0, 1), "AngularAcceleration": (0, 0, -2, 0, 1), "Mass": (1, 0, 0, 0, 0),
    "MomentOfInertia": (1, 2, 0, 0, 0), "Momentum": (1, 1, -1, 0, 0), "AngularMomentum": (1, 2, -1, 0, 0),
    "Force": (1, 1, -2, 0, 0), "Torque": (1, 2, -2, 0, 0), "Energy": (1, 2, -2, 0, 0), "ElectricCurrent": (0, 0, 0, 1, 0),
    "RotationalSpringConstant": (1, 2, -2, 0, -1), "RotationalDampingConstant": (1, 2, -1, 0, -1),
    "TranslationalSpringConstant": (1, 0, -2, 0, 0), "TranslationalDampingConstant": (1, 0, -1, 0, 0),
}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_quantities_have_the_dimensions_of_their_units(model, version):
    root = ElementTree.parse(ROOT / "modelDescription" / model / f"fmi{version}.xml").getroot()
    units = {u.get("name"): u for u in root.find("UnitDefinitions")}
    reals = root.iter("Real" if version == 2 else "Float64")
    seen, shown = set(), 0
    for v in reals:
        quantity, display = v.get("quantity"), v.get("displayUnit")
        if quantity:
            base = units[v.get("unit")].find("BaseUnit")
            assert tuple(int(base.get(k, 0)) for k in ("kg", "m", "s", "A", "rad")) == DIMENSIONS[quantity]
            seen.add(quantity)
        assert (display is not None) == (quantity == "Angle")
        if display:
            definition = next(d for d in units[v.get("unit")].findall("DisplayUnit") if d.get("name") == display)
            assert display == "deg" and abs(float(definition.get("factor")) - 180 / pi) < 1e-12
            shown += 1
    assert len(seen) >= 3 and shown > 0


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_the_default_experiment_is_told_as_fmi_ls_ref_wants_it(model, version, fmu):
    folder = "extra/org.fmi-standard.fmi-ls-ref"
    with zipfile.ZipFile(fmu(model, version)) as z:
        manifest = ElementTree.fromstring(z.read(f"{folder}/fmi-ls-manifest.xml"))
        ls = "{http://fmi-standard.org/fmi-ls-manifest}"
        assert manifest.tag == "fmiReferences" and manifest.get(f"{ls}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
        assert manifest.get(f"{ls}fmi-ls-version") and manifest.get(f"{ls}fmi-ls-description")

        def beside(source):
            return posixpath.normpath(posixpath.join(folder, source))

        related = {r.get("role"): z.read(beside(r.get("source"))) for r in manifest.findall("Related")}
        assert set(related) == {"experiment/smoke-test", "result"}
        experiment = ElementTree.fromstring(related["experiment/smoke-test"]).find("Experiment")
        described = ElementTree.fromstring(z.read("modelDescription.xml")).find("DefaultExperiment")
        times = experiment.find("TransientSimulation")
        for name, where in (("startTime", times), ("stopTime", times), ("stepSize", times), ("tolerance", experiment)):
            assert float(where.get(name)) == float(described.get(name))
        for part in ("Stimuli", "References"):
            rows = list(csv.reader(io.StringIO(z.read(beside(experiment.find(part).get("source"))).decode())))
            assert rows[0][0] == "time" and float(rows[1][0]) == 0.0 and len(rows[0]) > 1
        assert z.read(beside(experiment.find("References").get("source"))) == related["result"]
        assert abs(float(rows[-1][0]) - float(times.get("stopTime"))) < 1e-9
