"""Functions of users, named `module:name` or `file.py:name` where clearway's own have a name.

A module is looked for in the folder of the file that names it, in the current folder, and among
installed packages. What it does wrong is reported as OwnCodeError: which, where, why.
"""

from __future__ import annotations

import difflib
import functools
import importlib
import importlib.util
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.machinery import ModuleSpec, PathFinder
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any

from clearway.base.errors import ClearwayError, OwnCodeError
from clearway.base.suggest import MOST_SEEN, did_you_mean

OWN_CODE_FORM = "module:name"
SHOWN = 8
"""Names of a module that a message lists at most."""


def is_own_code(name: str) -> bool:
    """Whether a name is that of a user's function; clearway's own have no colon."""
    return ":" in name


def locate_own(name: str, folder: Path | None = None) -> str:
    """The name with its file written out where it lies in `folder` or the current folder.

    So it is found again from anywhere; installed modules stay as they are.
    """
    place, _, attribute = name.rpartition(":")
    file = _file_of(place, folder)
    return name if file is None else f"{file}:{attribute}"


def shorten_own_name(name: str) -> str:
    """A name for pictures and tables: of a user's own one the file without its folder."""
    place, colon, attribute = name.rpartition(":")
    return f"{Path(place).name}{colon}{attribute}" if place.endswith(".py") else name


def load_own(kind: str, name: str, folder: Path | None = None) -> Any:
    """The object called `module:name` or `file.py:name`.

    folder: looked in before the current one. Raises OwnCodeError where there is no such module,
    where importing it fails, and where it has no such name.
    """
    label = f"{kind} {name}"
    place, _, attribute = name.rpartition(":")
    if not place or not attribute.isidentifier():
        raise OwnCodeError(label, f"{name!r} is not {OWN_CODE_FORM} or file.py:name")
    module = _module(label, place, folder)
    if not hasattr(module, attribute):
        raise OwnCodeError(label, _no_such_name(module, attribute))
    return getattr(module, attribute)


def callable_own(label: str, found: Any, takes: Sequence[str]) -> Callable[..., Any]:
    """What was found, if it can be called with these arguments; else OwnCodeError.

    takes: names of the arguments, for messages; they are passed by place.
    """
    wanted = f"({', '.join(takes)})"
    if not callable(found):
        kind = type(found).__name__
        raise OwnCodeError(label, f"is no function but {kind}; it is called with {wanted}")
    function: Callable[..., Any] = found
    try:
        signature = inspect.signature(function)
    except ValueError:
        return function  # Built into Python: it does not say what it takes.
    try:
        signature.bind(*takes)
    except TypeError:
        raise OwnCodeError(label, f"takes {signature}, but is called with {wanted}") from None
    return function


def guard_call(label: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function; what it raises is reported as OwnCodeError with file and line."""

    @functools.wraps(function, updated=())
    def call(*values: Any, **named: Any) -> Any:
        try:
            return function(*values, **named)
        except OwnCodeError:
            raise
        except Exception as cause:
            raise OwnCodeError(label, describe_raised(cause, function)) from cause

    return call


def describe_raised(cause: BaseException, function: Callable[..., Any] | None = None) -> str:
    """What was raised, and where: the innermost line of the user's file, else of any."""
    frames = traceback.extract_tb(cause.__traceback__)
    own = getattr(inspect.unwrap(function), "__code__", None) if function is not None else None
    beside = [frame for frame in frames if own is not None and frame.filename == own.co_filename]
    outside = [frame for frame in frames if not _is_ours(frame.filename)]
    frame = next(iter([*beside[-1:], *outside[-1:], *frames[-1:]]), None)
    where = "" if frame is None else f" ({frame.filename}, line {frame.lineno})"
    return f"raised {type(cause).__name__}: {cause}{where}"


def _is_ours(filename: str) -> bool:
    return Path(filename).is_relative_to(Path(__file__).parents[1])


def _folders(folder: Path | None) -> list[Path]:
    folders = [] if folder is None else [folder.absolute()]
    return list(dict.fromkeys([*folders, Path.cwd()]))


def _file_of(place: str, folder: Path | None) -> Path | None:
    """The file of a module in one of the folders; None where it lies in neither."""
    for each in _folders(folder):
        if place.endswith(".py"):
            files = [each / place]
        else:
            inner = each.joinpath(*place.split("."))
            files = [inner.with_suffix(".py"), inner / "__init__.py"] if inner.name else []
        for file in files:
            if file.is_file():
                return file.resolve()
    return None


def _modules_in(folder: Path | None) -> list[str]:
    """Names of the Python files where modules are looked for."""
    found = []
    for each in _folders(folder):
        with suppress(OSError):
            found += [file.stem for file in islice(each.glob("*.py"), MOST_SEEN)]
    return found


def _module(label: str, place: str, folder: Path | None) -> ModuleType:
    file = _file_of(place, folder)
    if file is None and place.endswith(".py"):
        looked = " or ".join(str(each / place) for each in _folders(folder))
        raise OwnCodeError(label, f"no such file: {looked}")
    if file is None and not re.fullmatch(r"[^\W\d]\w*(\.[^\W\d]\w*)*", place):
        raise OwnCodeError(label, f"{place!r} is no module; valid: {OWN_CODE_FORM} or file.py:name")
    try:
        return importlib.import_module(place) if file is None else _from_file(label, file)
    except ClearwayError:
        raise
    except ModuleNotFoundError as cause:
        if file is None and cause.name is not None and f"{place}.".startswith(f"{cause.name}."):
            looked = ", ".join(str(each) for each in _folders(folder))
            near = did_you_mean(place, _modules_in(folder))
            raise OwnCodeError(
                label, f"no module {cause.name!r}{near} in {looked}, or among installed packages"
            ) from None
        raise OwnCodeError(label, _importing(cause, file)) from cause
    except SyntaxError as cause:
        line = f"{cause.filename}, line {cause.lineno}"
        raise OwnCodeError(label, f"is no valid Python: {cause.msg} ({line})") from cause
    except (Exception, SystemExit) as cause:
        raise OwnCodeError(label, _importing(cause, file)) from cause


def _importing(cause: BaseException, file: Path | None) -> str:
    return f"importing {'it' if file is None else file} {describe_raised(cause)}"


def _from_file(label: str, file: Path) -> ModuleType:
    """A file as the module that it is, so that it is loaded once and may import its neighbours.

    Neighbours come after installed packages: a file cannot take the place of one of those, and one
    of the same name gets a name of its own.
    """
    root, parts = file.parent, [] if file.name == "__init__.py" else [file.stem]
    while (root / "__init__.py").is_file():
        root, parts = root.parent, [root.name, *parts]
    look_beside([str(root)])
    dotted = ".".join(parts)
    if _origin(dotted) == file:
        return importlib.import_module(dotted)
    if len(parts) > 1 or file.name == "__init__.py":
        raise OwnCodeError(label, f"{file}: another package {parts[0]!r} hides it; rename it")
    return _apart(label, file)


class _Neighbours:
    """Finds modules beside those that users named, after all others have found nothing.

    On `sys.path` their folder would let a file take the place of a package without `__init__`, or
    of a module of Python's that this machine lacks.
    """

    def __init__(self) -> None:
        self.folders: list[str] = []

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if path is not None or name in sys.stdlib_module_names:
            return None
        return PathFinder.find_spec(name, self.folders, target)


_NEIGHBOURS = _Neighbours()


def look_beside(folders: Sequence[str]) -> None:
    """Have modules found in these folders too, by whatever is imported from here on."""
    new = [each for each in folders if each not in (*sys.path, *_NEIGHBOURS.folders)]
    if new:
        _NEIGHBOURS.folders += new
        importlib.invalidate_caches()
    if _NEIGHBOURS.folders and _NEIGHBOURS not in sys.meta_path:
        sys.meta_path.append(_NEIGHBOURS)


def list_looked_beside() -> tuple[str, ...]:
    """The folders of `look_beside`, for another process."""
    return tuple(_NEIGHBOURS.folders)


def _origin(dotted: str) -> Path | None:
    """The file that an import of the name would give."""
    loaded = sys.modules.get(dotted)
    spec = None if loaded is not None else importlib.util.find_spec(dotted)
    origin = getattr(loaded, "__file__", None) if spec is None else spec.origin
    return None if origin is None else Path(origin).resolve()


def _apart(label: str, file: Path) -> ModuleType:
    """A file whose own name is taken, as a module called by its whole path."""
    name = str(file)
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise OwnCodeError(label, f"{file} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _no_such_name(module: ModuleType, attribute: str) -> str:
    defined = [
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and getattr(value, "__module__", None) == module.__name__
    ]
    close = difflib.get_close_matches(attribute, defined, n=1)
    hint = f" (did you mean {close[0]!r}?)" if close else ""
    has = ", ".join(defined[:SHOWN]) or "no function of its own"
    more = ", ..." if len(defined) > SHOWN else ""
    return f"{module.__file__} has no {attribute!r}{hint}; it has {has}{more}"
