"""Loops of Python to C++: `write_sources` is what the build calls."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from clearway_build.translate.functions import Function
from clearway_build.translate.kinds import Kinds, identifier, qualified
from clearway_build.translate.program import Kernel, NotTranslatableError, Program
from clearway_build.translate.writes import Writes

PARTS = (("obstacles", "sensors", "traffic"), ())
"""Packages whose loops make one file of C++ each; the last takes all others. Each file holds all
that its loops call too, so that the compiler can write it into them."""
READ = "read.txt"
"""The list of files that loops and what they name stand in, a path a line."""


def write_sources(source: Path, out: Path) -> list[Path]:
    """Write the loops of the package below `source` as files of C++ to a folder.

    Raises NotTranslatableError, with all places, for what is not in the subset of Python.
    """
    translated = Translated(source)
    files = translated.program.files().items()
    read = sorted(f"{path.relative_to(source)} {digest}" for path, digest in files)
    out.mkdir(parents=True, exist_ok=True)
    named = {package for packages in PARTS for package in packages}
    paths = []
    for number, packages in enumerate(PARTS):
        own = [
            each
            for each in translated.functions.values()
            if (package_of(each.kernel) in packages)
            or (not packages and package_of(each.kernel) not in named)
        ]
        path = out / f"loops_{number}.cpp"
        _write(path, translated.file(number, own))
        paths.append(path)
    path = out / "module.cpp"
    _write(path, _module(len(PARTS), translated.functions))
    _write(out / READ, "\n".join(read) + "\n")
    return [*paths, path]


def _write(path: Path, text: str) -> None:
    """Leave a file that holds the text already, and its date."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def package_of(kernel: Kernel) -> str:
    return kernel.module.split(".")[1]


class Translated:
    """All loops, those that others call before them."""

    def __init__(self, source: Path) -> None:
        self.program = Program(source)
        self.kinds = Kinds(self.program)
        self.functions: dict[Kernel, Function] = {}
        self.writes: dict[Kernel, set[tuple[str, ...]]] = {}
        failures: list[str] = []
        for kernel in self.program.kernels():
            self._add(kernel, failures)
        if failures:
            raise NotTranslatableError("\n".join(dict.fromkeys(failures)))

    def _add(self, kernel: Kernel, failures: list[str]) -> None:
        if kernel in self.functions:
            return
        try:
            function = Function(self.program, self.kinds, kernel)
        except NotTranslatableError as error:
            failures.append(str(error))
            return
        for called in function.called:
            self._add(called, failures)
        self.functions[kernel] = function
        self.writes[kernel] = Writes(kernel, self.writes, function.meaning).found

    def file(self, number: int, own: Iterable[Function]) -> str:
        """One file: some loops, all that they call, and how Python calls them."""
        needed: set[Kernel] = set()
        waiting = [each.kernel for each in own]
        while waiting:
            kernel = waiting.pop()
            if kernel not in needed:
                needed.add(kernel)
                waiting += self.functions[kernel].called
        parts = ['#include "python.hpp"']
        parts += [self.kinds.definition(record) for record in self.kinds.records]
        for kernel, function in self.functions.items():
            if kernel in needed:
                space = "::".join(identifier(part) for part in kernel.module.split("."))
                parts.append(f"namespace {space} {{\n{function.text}\n}}")
        bound = [each for each in own if self._is_bound(each)]
        loops = [self._loop(each) for each in bound]
        calls = [self._call(n, each) for n, each in enumerate(bound)]
        methods = [
            f"  {{loops[{n}].name, rt::as_method(call_{n}), rt::METHOD, nullptr}},"
            for n in range(len(bound))
        ]
        parts.append("static const rt::Loop loops[] = {\n" + "\n".join(loops) + "\n};")
        parts += calls
        parts.append(
            f"extern PyMethodDef methods_{number}[];\nPyMethodDef methods_{number}[] = {{\n"
            + "\n".join(methods)
            + "\n  {nullptr, nullptr, 0, nullptr}};"
        )
        return "\n".join(parts) + "\n"

    def _is_bound(self, function: Function) -> bool:
        """Whether Python calls a loop: one without an underscore, or what is no loop does so."""
        kernel = function.kernel
        is_used = kernel in self.program.used() or not kernel.name.startswith("_")
        return is_used and not function.is_generic

    def _call(self, number: int, function: Function) -> str:
        """How Python calls one loop."""
        count = len(function.parameters)
        name = qualified(function.kernel.module, function.kernel.name)
        read = "".join(
            f"    const auto x{n} = rt::argument<{kind}>(a, {n}, call);\n"
            for n, kind in enumerate(function.parameters)
        )
        result = f"{name}({', '.join(f'x{n}' for n in range(count))})"
        kind = function.returned
        if kind == "void":
            made = f"{result};\n    Py_INCREF(Py_None);\n    return Py_None;"
        else:
            made = (
                f"const {kind} result = {result};\n    const rt::NoCollection none;\n"
                f"    return rt::Value<{kind}>::make(result, call);"
            )
        return (
            f"static PyObject* call_{number}(PyObject*, PyObject* const* given, Py_ssize_t count, "
            f"PyObject* names) {{\n  PyObject* a[{max(1, count)}];\n"
            f"  PyArrayObject* arrays[{max(1, len(self._arrays(function.kernel)))}];\n"
            f"  const rt::Loop& loop = loops[{number}];\n"
            f"  if (!rt::arrange(loop, {count}, given, count, names, a)) return nullptr;\n"
            "  rt::Call call(loop, arrays);\n  try {\n    const rt::Scope scope;\n"
            f"{read}    {made}\n"
            "  } catch (...) {\n    return rt::failed(call);\n  }\n}"
        )

    def _arrays(self, kernel: Kernel) -> list[tuple[str, ...]]:
        """The paths of all arrays that a loop takes, in order."""
        return [
            path
            for each in kernel.parameters
            for path in self.kinds.arrays(kernel.module, each.annotation, (each.arg,))
        ]

    def _loop(self, function: Function) -> str:
        kernel = function.kernel
        arrays = self._arrays(kernel)
        written = self.writes[kernel]
        flags = "".join(
            "w" if any(path[: len(each)] == each for each in written) else "r" for path in arrays
        )
        names = "".join(f"{each.arg}," for each in kernel.parameters)
        return f'  {{"{kernel.module}.{kernel.name}", "{names}", "{flags}"}},'


def _module(count: int, kernels: Iterable[Kernel]) -> str:
    """The file that makes the module: all functions, and the names of all loops, bound or not."""
    listed = "\n".join(f"extern PyMethodDef methods_{n}[];" for n in range(count))
    added = "\n".join(
        f"  if (PyModule_AddFunctions(core, methods_{n}) < 0) return nullptr;" for n in range(count)
    )
    names = "\n".join(f'    "{each.module}.{each.name} "' for each in kernels)
    return f"""#define CLEARWAY_MODULE
#include "python.hpp"
{listed}
static PyModuleDef definition = {{PyModuleDef_HEAD_INIT, "clearway.base._core"}};
static const char* const loops =
{names};
PyMODINIT_FUNC PyInit__core() {{
  import_array();
  definition.m_size = -1;
  PyObject* core = PyModule_Create(&definition);
  if (core == nullptr) return nullptr;
{added}
  if (PyModule_AddStringConstant(core, "loops", loops) < 0) return nullptr;
  return core;
}}
"""


__all__ = ["READ", "NotTranslatableError", "write_sources"]
