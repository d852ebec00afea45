"""Machines that a core is built for: this one, or one of those that wheels are made for."""

from __future__ import annotations

import os
import sysconfig
from dataclasses import dataclass

from clearway_build.errors import BuildError

NAMED = "CLEARWAY_TARGET"
"""The environment variable that names a machine to build for; unset, this one."""
MACHINES = ("x86_64", "aarch64")
PYTHON_TAG = "cp311-abi3"
"""One wheel for every Python from 3.11 on."""
GLIBC = (2, 17)
"""The oldest C library that wheels run with; numpy's own wheels ask for a later one."""


@dataclass(frozen=True)
class Target:
    """A machine to build for; `machine` is None for the one that builds."""

    machine: str | None = None

    @property
    def triple(self) -> str:
        """What Zig calls the machine, with the C library's version."""
        return f"{self.machine}-linux-gnu.{GLIBC[0]}.{GLIBC[1]}"

    @property
    def tag(self) -> str:
        """The wheel's tag."""
        if self.machine is None:
            platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        else:
            platform = f"manylinux_{GLIBC[0]}_{GLIBC[1]}_{self.machine}"
        return f"{PYTHON_TAG}-{platform}"

    @property
    def folder(self) -> str:
        """The name of the folder for its object files."""
        return self.machine or "here"


HERE = Target()
"""The machine that builds."""


def chosen_target() -> Target:
    """Return the machine that `CLEARWAY_TARGET` names, else this one."""
    named = os.environ.get(NAMED)
    if named and named not in MACHINES:
        raise BuildError(f"{NAMED}={named}: no such machine; type one of {', '.join(MACHINES)}")
    return Target(named or None)
