"""Annotations to types of C++."""

from __future__ import annotations

import ast
import re

from clearway_build.translate.program import Assigned, NotTranslatableError, Program, Record

SCALARS = {
    "float": "f64",
    "int": "i64",
    "bool": "bool",
    "np.uint64": "u64",
    "np.int64": "i64",
    "np.uint32": "u32",
    "np.int32": "i32",
    "None": "void",
}
ELEMENTS = {
    "Floats": "f64",
    "Ints": "i64",
    "Bools": "bool",
    "Int32s": "i32",
    "Int16s": "i16",
    "Int8s": "i8",
    "UInt8s": "u8",
    "UInt64s": "u64",
}
"""By the names of `clearway.base.arrays`; a digit after one is the number of dimensions."""
ARRAY = re.compile(rf"(Strided)?({'|'.join(ELEMENTS)})(\d?)")
_WORDS = """
alignas alignof and asm auto bool break case catch char class const continue default delete
do double else enum explicit export extern false float for friend goto if inline int long
mutable namespace new not operator or private protected public register return short signed
sizeof static struct switch template this throw true try typedef typename union unsigned
using virtual void volatile while xor std rt clearway unix linux
"""
RESERVED = frozenset(_WORDS.split())


def identifier(name: str) -> str:
    """A name of Python as one of C++."""
    return f"{name}_" if name in RESERVED else name


def qualified(module: str, name: str) -> str:
    return "::" + "::".join(identifier(part) for part in [*module.split("."), name])


class Kinds:
    """Types by annotations, and the records that they need, in the order of their definitions."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.records: list[Record] = []

    def of(self, module: str, annotation: ast.expr | None) -> str:
        """The type that an annotation means; raises NotTranslatableError for what means none."""
        if annotation is None:
            raise NotTranslatableError(f"{self.program.path(module)}: an annotation is missing")
        text = ast.unparse(annotation)
        if text == "npt.NDArray[Any]":
            return "auto"
        if text in SCALARS:
            return SCALARS[text]
        array = ARRAY.fullmatch(text)
        if array:
            strided = ", true" if array[1] else ""
            return f"rt::Arr<{ELEMENTS[array[2]]}, {array[3] or 1}{strided}>"
        if isinstance(annotation, ast.Name):
            found = self.program.resolve(module, annotation.id)
            if isinstance(found, Record):
                self._need(found)
                return qualified(found.module, found.name)
            if isinstance(found, Assigned) and "NDArray" not in ast.unparse(found.expression):
                return self.of(found.module, found.expression)
        if isinstance(annotation, ast.Subscript) and ast.unparse(annotation.value) == "tuple":
            assert isinstance(annotation.slice, ast.Tuple)
            return (
                f"std::tuple<{', '.join(self.of(module, each) for each in annotation.slice.elts)}>"
            )
        raise NotTranslatableError(
            f"{self.program.path(module)}:{annotation.lineno}: {text} is no type of the core; "
            "arrays state their dimensions, as Floats2 of clearway.base.arrays does"
        )

    def _need(self, record: Record) -> None:
        if record in self.records:
            return
        for annotation in record.fields.values():
            self.of(record.module, annotation)
        self.records.append(record)

    def definition(self, record: Record) -> str:
        """A record as a struct."""
        fields = {identifier(n): self.of(record.module, a) for n, a in record.fields.items()}
        members = " ".join(f"{kind} {name};" for name, kind in fields.items())
        parameters = ", ".join(f"{kind} {name}" for name, kind in fields.items())
        names = ", ".join(fields)
        space = "::".join(identifier(part) for part in record.module.split("."))
        labels = ", ".join(f'"{name}"' for name in record.fields)
        return (
            f"namespace {space} {{\nstruct {record.name} {{\n  {members}\n"
            f"  auto parts() const {{ return std::make_tuple({names}); }}\n"
            f"  RT_INLINE static {record.name} make({parameters}) {{ return {{{names}}}; }}\n"
            f'  static constexpr const char *record_name = "{record.name}", '
            f'*record_module = "{record.module}", *record_fields[] = {{{labels}}};\n}};\n}}\n'
        )

    def arrays(
        self, module: str, annotation: ast.expr | None, path: tuple[str, ...]
    ) -> list[tuple[str, ...]]:
        """The paths of all arrays in a parameter, in order."""
        assert annotation is not None
        if ARRAY.fullmatch(ast.unparse(annotation)):
            return [path]
        if isinstance(annotation, ast.Name) and annotation.id not in SCALARS:
            found = self.program.resolve(module, annotation.id)
            if isinstance(found, Record):
                return [
                    each
                    for name, kind in found.fields.items()
                    for each in self.arrays(found.module, kind, (*path, name))
                ]
            if isinstance(found, Assigned):
                return self.arrays(found.module, found.expression, path)
        if isinstance(annotation, ast.Subscript) and isinstance(annotation.slice, ast.Tuple):
            return [
                each for kind in annotation.slice.elts for each in self.arrays(module, kind, path)
            ]
        return []
