"""Compiled code made ready to be called again, without what only compiling needs.

numba would first make ready to compile, which imports most of it and scipy, and read the code that
other loops are linked from; both take several times as long as the rest. Here the first is left out
unless the code calls something that only then can be found, and the second waits until a loop that
is being compiled asks for it.
"""

from __future__ import annotations

import io
import pickle
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from llvmlite import binding
from numba.core import compiler, environment, serialize
from numba.core.codegen import JITCodeLibrary
from numba.core.runtime import nrt

# What numba does not type.
_Result: Any = compiler.CompileResult
_environments: Any = environment
_dumps: Callable[[object], bytes] = serialize.dumps
_runtime: Any = nrt.rtsys
_ENVIRONMENT = re.compile(r"_ZN08NumbaEnv[\w.$]*")


class KeptCode(NamedTuple):
    """What is kept of the code of one loop for one signature."""

    name: str
    machine_code: bytes
    defined: frozenset[str]
    """Names that it defines."""
    called: tuple[str, ...]
    """Names that it takes from elsewhere."""
    rest: tuple[Any, ...]
    """All else of numba's `CompileResult`, in the order of its `_rebuild`."""


Bitcode = Callable[[], bytes]
"""Reads what other loops are linked from; raises ClearwayError where it is damaged."""


def kept_code(result: Any) -> tuple[KeptCode, bytes]:
    """Of a result of numba's compiler, and what other loops are linked from, which is several times
    as long; what its types were found to be is not kept."""
    (name, _, (machine_code, bitcode)), *rest = result._reduce()
    rest[5] = ""  # of the annotation, which is as long as all else
    final = result.library._final_module
    rest[7] = tuple(_looked_into(str(final), rest[7]))
    functions, values = _contents(result.library._get_module_for_linking())
    called, _ = _contents(final)
    kept = KeptCode(
        name,
        machine_code,
        frozenset(one.name for one in (*functions, *values) if not one.is_declaration),
        tuple(
            one.name for one in called if one.is_declaration and not one.name.startswith("llvm.")
        ),
        tuple(rest),
    )
    return kept, bitcode


def _looked_into(code: str, environments: tuple[Any, ...]) -> Iterator[Any]:
    """Of what numba keeps for each function that was linked, that which code still looks into; what
    was optimised away leaves nothing but the name of a variable. Whatever is linked from this code
    looks into no other."""
    times = Counter(_ENVIRONMENT.findall(code))
    return (one for one in environments if times[one.env_name] > 1)


def _contents(module: Any) -> tuple[list[Any], list[Any]]:
    return list(module.functions), list(module.global_variables)


def written(value: object) -> bytes:
    """As bytes, for `read`."""
    return _dumps(value)


def read(data: bytes) -> Any:
    """What `written` made bytes of; raises whatever a type of someone else's may raise."""
    return _KeptReader(io.BytesIO(data)).load()


class _KeptReader(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == ("numba.core.environment", "_rebuild_env"):
            return _environment
        return super().find_class(module, name)


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """Of a loop, as numba makes it; but the modules of its own that a loop was made from are not
    imported, since code that is compiled looks nothing up in them."""
    if not module.startswith("numba.") or module in sys.modules:
        return _environments._rebuild_env(module, constants, name)
    known = _environments.lookup_environment(name)
    if known is None:
        known = _environments.Environment({"__name__": module})
        known.consts[:] = constants
        known.env_name = name
        _environments.Environment._memo[name] = known
    return known


class KeptLibrary(JITCodeLibrary):
    """Machine code that was kept; what others are linked from is read when one is."""

    _bitcode: Bitcode

    @classmethod
    def of(cls, codegen: Any, kept: KeptCode, bitcode: Bitcode) -> Any:
        """Ready to be called."""
        library: Any = cls(codegen, kept.name)
        library._bitcode = bitcode
        library.enable_object_caching()
        library._set_compiled_object(kept.machine_code)
        library._finalize_final_module()
        codegen._engine._defined_symbols |= kept.defined
        return library

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = binding.parse_bitcode(self._bitcode())
        return self._shared_module


def rebuilt(kept: KeptCode, bitcode: Bitcode, target_context: Any) -> Any:
    """numba's `CompileResult` of code that was kept."""
    _runtime.initialize(target_context)
    codegen = target_context.codegen()
    if not all(_is_there(name, codegen) for name in kept.called):
        target_context.refresh()
    described, loop, signature, in_objects, lifted, annotation, reload, others = kept.rest
    for begin in reload:
        begin()
    library = KeptLibrary.of(codegen, kept, bitcode)
    entry = target_context.get_executable(library, described, loop)
    for other in others:
        codegen.set_env(other.env_name, other)
    return _Result(
        target_context=target_context,
        typing_context=target_context.typing_context,
        library=library,
        environment=loop,
        entry_point=entry,
        fndesc=described,
        type_annotation=annotation,
        signature=signature,
        objectmode=in_objects,
        lifted=lifted,
        typing_error=None,
        call_helper=None,
        metadata=None,
        reload_init=reload,
        referenced_envs=others,
    )


def _is_there(name: str, codegen: Any) -> bool:
    """Whether a function can be found now; what once was stays."""
    if name not in _seen and (
        codegen._engine.is_symbol_defined(name) or binding.address_of_symbol(name)
    ):
        _seen.add(name)
    return name in _seen


_seen: set[str] = set()
