"""A release has one version and one date everywhere, and what the registries require of a package."""

import re
import tomllib
import xml.etree.ElementTree as xml

from conftest import ROOT

CARGO = tomllib.loads((ROOT / "Cargo.toml").read_text())
PACKAGE = CARGO["workspace"]["package"]
VERSION = PACKAGE["version"]
# Not published: what tests need, and the library of the Python package.
OWN = {"trueup-acceptance", "trueup-testkit", "trueup-witness", "trueup-python"}


def manifests():
    members = CARGO["workspace"]["members"]
    files = [path / "Cargo.toml" for member in members for path in ROOT.glob(member) if (path / "Cargo.toml").is_file()]
    return {m["package"]["name"]: m for m in (tomllib.loads(file.read_text()) for file in files)}


def field(package, name):
    """A field of a package, its own or the workspace's."""
    value = package.get(name)
    return PACKAGE[name] if value == {"workspace": True} else value


def test_one_version_everywhere():
    crates = manifests()
    assert len(crates) > 20 and all(field(m["package"], "version") == VERSION for m in crates.values())
    inside = {name: d for name, d in CARGO["workspace"]["dependencies"].items() if name in crates}
    assert {d.get("version") for name, d in inside.items() if name not in OWN} == {VERSION}
    locked = {p["name"]: p["version"] for p in tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]}
    assert {locked[name] for name in crates} == {VERSION}
    assert f'annotation (version = "{VERSION}"' in (ROOT / "modelica/Trueup/package.mo").read_text()
    described = [xml.parse(path).getroot().attrib for path in (ROOT / "modelDescription").glob("*/fmi?.xml")]
    assert len(described) == 18
    assert {(d["version"], d["generationTool"]) for d in described} == {(VERSION, f"Trueup {VERSION}")}


def test_the_changelog_begins_with_what_is_not_released_then_this_version():
    headings = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.M)
    dated = re.fullmatch(rf"\[{re.escape(VERSION)}\] - (\d{{4}}-\d\d-\d\d)", headings[1])
    assert headings[0] == "[Unreleased]" and dated
    citation = (ROOT / "CITATION.cff").read_text()
    assert f"\nversion: {VERSION}\ndate-released: {dated[1]}\n" in citation


def test_crates_have_what_their_registry_requires():
    crates = {name: m["package"] for name, m in manifests().items() if name not in OWN}
    for name, package in crates.items():
        wanted = {key: field(package, key) for key in ("description", "license", "readme", "authors", "keywords", "categories")}
        assert all(wanted.values()), f"{name}: {wanted}"
        # Limits of the registry.
        assert len(wanted["keywords"]) <= 5 and len(wanted["categories"]) <= 5, name
        assert all(re.fullmatch(r"[A-Za-z0-9][\w+-]{0,19}", word) for word in wanted["keywords"]), f"{name}: {wanted['keywords']}"
    assert len({package["description"] for package in crates.values()}) == len(crates)
    assert (ROOT / PACKAGE["readme"]).is_file()


def test_the_python_package_has_what_its_registry_requires():
    project = tomllib.loads((ROOT / "crates/python/pyproject.toml").read_text())["project"]
    assert project["dynamic"] == ["version"] and project["license"] == PACKAGE["license"]
    assert (ROOT / "crates/python" / project["readme"]).is_file()
    assert project["description"] and project["keywords"] and project["requires-python"] and project["authors"]
    assert all(" :: " in line for line in project["classifiers"])
