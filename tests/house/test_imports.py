"""Files import each other in one direction only: no circle, not even a lazy or a typed one."""

import subprocess
import sys

import grimp
import pytest


def circles(arrows):
    """Groups of files that reach each other; arrows: what each file imports. (Tarjan)"""
    number, lowest, stack, found = {}, {}, [], []

    def visit(file):
        number[file] = lowest[file] = len(number)
        stack.append(file)
        for other in sorted(arrows[file]):
            if other not in number:
                visit(other)
                lowest[file] = min(lowest[file], lowest[other])
            elif other in stack:
                lowest[file] = min(lowest[file], number[other])
        if lowest[file] == number[file]:
            group = stack[stack.index(file) :]
            del stack[stack.index(file) :]
            if len(group) > 1 or file in arrows[file]:
                found.append(sorted(group))

    for file in sorted(arrows):
        if file not in number:
            visit(file)
    return found


@pytest.mark.parametrize(
    ("arrows", "expected"),
    [
        ({"a": {"b", "c"}, "b": {"c"}, "c": set()}, []),
        ({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}, [["b", "c"]]),
        ({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"d"}}, [["a", "b", "c"], ["d"]]),
    ],
)
def test_circles_are_seen(arrows, expected):
    assert circles(arrows) == expected


def test_no_circle_of_files():
    graph = grimp.build_graph("clearway", cache_dir=None)  # lazy and TYPE_CHECKING imports too
    arrows = {file: graph.find_modules_directly_imported_by(file) for file in graph.modules}
    assert len(arrows) > 300
    assert circles(arrows) == []


def test_no_picture_no_matplotlib():
    """Which takes longer to load than a short flight to fly."""
    code = (
        "import sys; from clearway.cli.picture_options import pictures_of; pictures_of('png', 110);"
        "sys.exit('matplotlib' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
