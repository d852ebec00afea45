"""Compiled code between runs: never stale, never in the way, and found again wherever it lies.

A package of two small files stands in for clearway, so that little is compiled.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from clearway.base.kernels import cache, folders, stamp
from repository import REPOSITORY

SOURCE = REPOSITORY / "src" / "clearway"
LOOPS = """
from typing import NamedTuple
from clearway.base.compiled import compiled
from clearway.facts import FACTOR, Pair

@compiled
def scaled(pair):
    return FACTOR * (10.0 * pair.one + pair.other)
"""
FACTS = """
from typing import NamedTuple
FACTOR = 2.0

class Pair(NamedTuple):
    one: float
    other: float
"""
ASK = """
import numba, sys
from clearway.base.kernels.news import NEWS
from clearway.facts import Pair
from clearway.loops import scaled
print(scaled(Pair(one=1.0, other=3.0)), NEWS.compiled, NEWS.loaded)
"""


@pytest.fixture
def package(tmp_path):
    """A package with a compiled loop of its own; returns the folder to import it from."""
    place = tmp_path / "one"
    shutil.copytree(
        SOURCE / "base",
        place / "clearway" / "base",
        ignore=shutil.ignore_patterns("__pycache__", "shipped"),
    )
    (place / "clearway" / "__init__.py").write_text("")
    write(place, "loops", LOOPS)
    write(place, "facts", FACTS)
    return place


def write(place, name, text):
    """A file of the package, as old as all others: times tell nothing."""
    path = place / "clearway" / f"{name}.py"
    path.write_text(text)
    os.utime(path, (1e9, 1e9))
    shutil.rmtree(place / "clearway" / "__pycache__" / f"{name}.pyc", ignore_errors=True)


def ask(place, code=ASK, **environment):
    """What the loop answers in a process of its own, and what was compiled and loaded for it."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("CLEARWAY", "NUMBA"))}
    done = subprocess.run(
        [sys.executable, "-B", "-c", code],
        env=clean | {"PYTHONPATH": str(place)} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    answer, compiled, loaded = done.stdout.split()
    return float(answer), int(compiled), int(loaded), done.stderr


def kept(place):
    return sorted((place / "clearway" / "__pycache__" / "compiled").rglob("*.kernel"))


def test_what_was_compiled_is_found_again_also_elsewhere(package, tmp_path):
    assert ask(package)[:3] == (26.0, 1, 0)
    assert ask(package)[:3] == (26.0, 0, 1)
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(package, elsewhere)
    assert ask(elsewhere)[:3] == (26.0, 0, 1)


def test_what_another_process_keeps_is_found_though_nothing_was_there_at_the_start(package):
    write(package, "first", LOOPS.replace("scaled", "first"))
    code = (
        "import subprocess, sys\n"
        "from clearway.facts import Pair\n"
        "from clearway.first import first\n"
        "first(Pair(one=1.0, other=3.0))\n"
        f"subprocess.run([sys.executable, '-B', '-c', {ASK!r}], check=True, stdout=sys.stderr)\n"
    )
    assert ask(package, code + ASK)[:3] == (26.0, 1, 1)


@pytest.mark.nightly
def test_what_it_follows_from_may_change_in_another_file(package):
    ask(package)
    swapped = FACTS.replace("one:", "x:").replace("other:", "one:").replace("x:", "other:")
    write(package, "facts", swapped.replace("2.0", "4.0"))
    assert ask(package)[:3] == (52.0, 1, 0)
    write(package, "facts", FACTS.replace("Pair", "Couple") + "\nPair = Couple\n")
    assert ask(package)[:3] == (26.0, 1, 0)
    write(package, "facts", FACTS)
    assert ask(package)[:3] == (26.0, 0, 1)


def test_damaged_files_are_compiled_anew(package):
    ask(package)
    (path,) = kept(package)
    whole = path.read_bytes()
    path.write_bytes(whole[:99] + bytes([whole[99] ^ 1]) + whole[100:])
    assert ask(package)[:3] == (26.0, 1, 0)
    assert cache._read(path, ()) is None
    for damaged in (whole[:-1], b""):
        path.write_bytes(damaged)
        assert cache._read(path, ()) is None


def test_where_nothing_can_be_written_it_runs_and_says_so(package):
    (package / "clearway" / "__pycache__").write_text("no folder")
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null/cache"}
    answer, compiled, _, said = ask(package, **nowhere)
    assert (answer, compiled) == (26.0, 1)
    assert "cannot be kept" in said
    assert "CLEARWAY_CACHE" in said


def test_what_lies_beside_the_package_is_read_by_who_keeps_code_elsewhere(package, tmp_path):
    ask(package)
    assert ask(package, CLEARWAY_CACHE=str(tmp_path / "named"))[:3] == (26.0, 0, 1)
    answer, compiled, loaded, said = ask(package, CLEARWAY_CACHE="/dev/null/none")
    assert (answer, compiled, loaded) == (26.0, 0, 1)
    assert said == ""


def test_a_named_folder_that_cannot_be_written_is_named(package):
    (package / "clearway" / "__pycache__").write_text("no folder")
    said = ask(package, CLEARWAY_CACHE="/dev/null/none")[3]
    assert "nor in CLEARWAY_CACHE (/dev/null/none)" in said


@pytest.mark.nightly
def test_the_users_cache_is_next_and_a_named_one_first(package, tmp_path):
    (package / "clearway" / "__pycache__").write_text("no folder")
    home = {"HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert ask(package, **home)[:3] == (26.0, 1, 0)
    assert ask(package, **home)[:3] == (26.0, 0, 1)
    assert ask(package, CLEARWAY_CACHE=str(tmp_path / "named"))[:3] == (26.0, 1, 0)
    assert len(list((tmp_path / "named").rglob("*.kernel"))) == 1


def test_code_that_changed_after_the_start_is_not_kept(package):
    change = f"open({str(package / 'clearway' / 'facts.py')!r}, 'a').write('# later')\n"
    code = ASK.replace("print", f"{change}print")
    assert ask(package, code)[:3] == (26.0, 1, 0)
    assert not kept(package)


@pytest.mark.skipif(not cache.runs_level(), reason=f"this machine is no {cache.LEVEL}")
def test_what_ships_is_used_without_writing(package):
    shipped = {"NUMBA_CPU_NAME": cache.LEVEL, "NUMBA_CPU_FEATURES": ""}
    ask(package, **shipped)
    folder = package / "clearway" / "__pycache__" / "compiled"
    shutil.move(folder, package / "clearway" / "base" / "kernels" / "shipped")
    shutil.rmtree(package / "clearway" / "__pycache__")
    (package / "clearway" / "__pycache__").write_text("no folder")
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null/cache"}
    assert ask(package, **nowhere) == (26.0, 0, 1, "")


def test_only_the_last_few_states_of_a_file_are_kept(tmp_path):
    for state in range(6):
        folders.write_whole(tmp_path / f"room.file-{state}" / "loop.kernel", b"")
        folders.write_whole(tmp_path / f"room.file-other-{state}" / "loop.kernel", b"")
        os.utime(tmp_path / f"room.file-{state}", (state, state))
    states = sorted(path.name for path in tmp_path.glob("room.file-[0-9]"))
    assert states == [f"room.file-{state}" for state in (2, 3, 4, 5)]


def test_stamps_cover_all_that_files_import():
    import grimp

    graph = grimp.build_graph("clearway", cache_dir=None)
    for module in graph.modules:
        place = SOURCE.parent.joinpath(*module.split("."))
        file = place.with_suffix(".py") if place.with_suffix(".py").is_file() else None
        file = file or place / "__init__.py"
        imported = graph.find_modules_directly_imported_by(module)
        found = {module_of(one) for one in stamp.files_behind(str(file))}
        machinery = {one for one in imported if one.startswith("clearway.base.kernels")}
        assert imported - machinery <= found, module


def module_of(file):
    parts = Path(file).relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


LINKED = """
from clearway.base.compiled import compiled
from clearway.loops import scaled

@compiled
def twice(pair):
    return 2.0 * scaled(pair)
"""


def test_kept_code_is_made_ready_without_what_compiling_needs(package):
    code = ASK.replace("NEWS.loaded)", "sum(m in sys.modules for m in MODULES))")
    code = f"MODULES = ['scipy.linalg', 'numba.np.arraymath']{code}"
    assert ask(package, code)[:2] == (26.0, 1)
    assert ask(package, code)[:3] == (26.0, 0, 0)


def test_kept_code_is_linked_into_what_is_compiled_later(package):
    ask(package)
    write(package, "linked", LINKED)
    code = ASK.replace("loops import scaled", "linked import twice as scaled")
    assert ask(package, code)[:2] == (52.0, 1)
    assert ask(package, code)[:2] == (52.0, 0)


def test_damaged_code_to_link_is_told_and_made_anew(package):
    ask(package)
    write(package, "linked", LINKED)
    code = ASK.replace("loops import scaled", "linked import twice as scaled")
    (path,) = kept(package)
    whole = path.read_bytes()
    path.write_bytes(whole[:-99] + bytes([whole[-99] ^ 1]) + whole[-98:])
    assert ask(package)[:3] == (26.0, 0, 1)
    with pytest.raises(AssertionError, match=r"kernel: compiled code is damaged; the next run"):
        ask(package, code)
    assert ask(package, code)[:2] == (52.0, 2)


def test_kept_code_finds_functions_of_other_libraries(package):
    dot = LOOPS.replace("return ", "row = np.full(3, pair.one)\n    return row.dot(row) + ")
    write(package, "loops", f"import numpy as np{dot}")
    assert ask(package)[:3] == (29.0, 1, 0)
    assert ask(package)[:3] == (29.0, 0, 1)


TOO_MANY = """
import numpy as np
from clearway.base.compiled import compiled
from clearway.facts import FACTOR, Pair

@compiled
def scaled(pair):
    row = np.zeros(int(pair.one))
    row[:] = np.ones(int(pair.other))
    return row[0]
"""
ASK_WHAT_IS_WRONG = """
from clearway.base.kernels.news import NEWS
from clearway.facts import Pair
from clearway.loops import scaled
try:
    scaled(Pair(one=1.0, other=3.0))
except ValueError as error:
    assert "(3,)" in str(error) and "(1,)" in str(error), error
    print(1.0, NEWS.compiled, NEWS.loaded)
"""


def test_kept_code_says_what_is_wrong_with_what_it_calls(package):
    """Which numba words with what it keeps for that function: of all that it kept for functions
    that were linked, only what is looked into is kept on."""
    write(package, "loops", TOO_MANY)
    assert ask(package, ASK_WHAT_IS_WRONG)[:3] == (1.0, 1, 0)
    assert ask(package, ASK_WHAT_IS_WRONG)[:3] == (1.0, 0, 1)
    write(package, "linked", LINKED)
    linked = ASK_WHAT_IS_WRONG.replace("loops import scaled", "linked import twice as scaled")
    assert ask(package, linked)[:2] == (1.0, 1)
    assert ask(package, linked)[:2] == (1.0, 0)
    with_rest = READ_KEPT.replace("FILES", repr([str(path) for path in kept(package)]))
    assert ask(package, with_rest)[:3] == (2.0, 2, 0)


READ_KEPT = """
from pathlib import Path
from clearway.base.kernels import cache, rebuilt
import clearway.linked
left = [
    rebuilt.read(cache._part(Path(file).open("rb")))[1].rest[-1] for file in FILES
]
print(float(len(left)), max(map(len, left)), sum(not each for each in left))
"""


SORTED = """
import numpy as np
from clearway.base.compiled import compiled

@compiled
def in_order(values):
    return np.sort(values)

@compiled
def order_of(values):
    return np.argsort(values)
"""
NAMES = """
import os, sys
from pathlib import Path
import numpy as np
from clearway.base.kernels import cache, rebuilt
from clearway.sorts import in_order, order_of

for loop, folder in zip(sys.argv[1::2], sys.argv[2::2]):
    if (child := os.fork()):
        assert os.waitpid(child, 0)[1] == 0
        continue
    os.environ["CLEARWAY_CACHE"] = folder
    {"in_order": in_order, "order_of": order_of}[loop](np.array([3.0, 1.0, 2.0]))
    defined = set()
    for file in Path(folder).rglob("*.kernel"):
        with file.open("rb") as opened:
            defined |= rebuilt.read(cache._part(opened))[1].defined
    Path(folder, "names").write_text(" ".join(name for name in defined if name.startswith("_Z")))
    sys.exit()
"""


def names(place, *asked):
    """Names of the functions in what processes keep of loops that sort: one process after the
    other, forked from one where they are asked for together. Each loop is asked for by its name and
    the folder to keep it in.
    """
    write(place, "sorts", SORTED)
    done = subprocess.run(
        [sys.executable, "-B", "-c", NAMES, *(word for one in asked for word in map(str, one))],
        env=os.environ | {"PYTHONPATH": str(place)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [set((folder / "names").read_text().split()) for _, folder in asked]


@pytest.mark.parametrize("forked", [False, True])
def test_no_two_processes_give_one_name(package, tmp_path, forked):
    """Else what one kept may run for what another kept: a sort for the order, as it did."""
    loops = ("order_of", "order_of", "in_order")
    asked = [(loop, tmp_path / str(number)) for number, loop in enumerate(loops)]
    found = names(package, *asked) if forked else [names(package, one)[0] for one in asked]
    for one in found:
        assert sum("quicksort" in name for name in one) >= 2
    assert not found[0] & found[1]
    assert not (found[0] | found[1]) & found[2]
