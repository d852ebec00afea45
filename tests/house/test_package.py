"""The package as strangers get it: public names, start-up, a wheel that runs elsewhere."""

import os
import re
import subprocess
import sys
import tomllib
import zipfile

import pytest
from tools.requirements import requirements_of

import clearway
from repository import REPOSITORY


@pytest.mark.parametrize("name", clearway.__all__)
def test_every_public_name_exists_and_is_documented(name):
    value = getattr(clearway, name)
    assert name == "__version__" or value.__doc__


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'teleport'"):
        _ = clearway.teleport


def test_the_command_line_starts_without_the_heavy_libraries():
    code = (
        "import sys, clearway.cli.app;"
        "heavy = {'numpy', 'numba', 'scipy', 'matplotlib', 'pydantic'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_make_installs_what_every_extra_needs():
    (extras,) = re.findall(r"^EXTRAS := (.*)$", (REPOSITORY / "Makefile").read_text(), re.MULTILINE)
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"]
    installed = requirements_of(extras.split(","))
    asked = [project["dependencies"], *project["optional-dependencies"].values()]
    assert {one for each in asked for one in each} == set(installed)


def test_a_wheel_runs_outside_the_checkout(tmp_path):
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path)]
    subprocess.run([*build, str(REPOSITORY)], check=True, capture_output=True)
    wheel = next(tmp_path.glob("clearway-*.whl"))
    with zipfile.ZipFile(wheel) as packed:
        # The colcon package links to what stands beside it: nothing else is packed twice.
        files = [
            one
            for one in packed.infolist()
            if one.filename.endswith((".toml", ".txt"))
            and "/clearway_ros/config/" not in one.filename
        ]
        contents = [packed.read(one) for one in files]
    assert len(contents) > 20
    assert len(set(contents)) == len(contents), [one.filename for one in files]
    place = tmp_path / "site"
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target"]
    subprocess.run([*install, str(place), str(wheel)], check=True, capture_output=True)
    examples = subprocess.run(
        ["git", "ls-files", "examples"], cwd=REPOSITORY, capture_output=True, text=True, check=False
    ).stdout.splitlines()
    code = (
        "import clearway; from clearway.missions.mission_file import read_mission_file;"
        "print(clearway.__file__); print(read_mission_file('static-obstacles').mission.name);"
        "from clearway.studies.campaigns.families import PLACES;"
        "from clearway.studies.campaigns.file import read_campaign; from pathlib import Path;"
        "named = [f.parameters['mission'] for f in read_campaign('standard').file.family"
        "         if f.family == 'place'];"
        "print(len(named), all((PLACES / Path(name).name).is_file() for name in named));"
        "import numpy; from clearway.studies.samples import SAMPLES;"
        "[one.write(Path('examples'), numpy.random.default_rng()) for one in SAMPLES"
        " if one.name == 'examples'];"
        "print(len([one for one in Path('examples').rglob('*') if one.is_file()]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(place)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines() == [
        str(place / "clearway" / "__init__.py"),
        "static-obstacles",
        "4 True",
        str(len(examples)),
    ]
    version = subprocess.run(
        [sys.executable, "-c", "from clearway.cli.app import main; main()", "--version"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(place)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert version.stdout.strip() == clearway.__version__
