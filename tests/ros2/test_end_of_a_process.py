"""A process that spoke over DDS ends, whatever DDS still waits for."""

from __future__ import annotations

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from ros2_for_tests import DOMAIN
from ros2_processes import all_ended, begun

pytestmark = pytest.mark.realtime

SPEAKS = """
import threading
from cyclonedds.core import Entity
from clearway.ros2 import dds
from clearway.ros2.bus import USUAL
from clearway.ros2.messages import make_message, pack_message

dds.LONGEST_STOP_S = 0.3
bus = dds.DdsBus({domain})
bus.advertise("/said", "std_msgs/msg/String", USUAL)
bus.publish("/said", pack_message(make_message("std_msgs/msg/String", data="all")))
bus.close()
stop = Entity._delete
Entity._delete = {stops}
print("closed")
"""


@pytest.mark.parametrize(
    "stops",
    [
        "lambda self, ref: (stop(self, ref), print('stopped'))",
        "lambda self, ref: threading.Event().wait()",
    ],
    ids=["which stops", "which never stops"],
)
def test_it_ends_with_its_domain(stops: str) -> None:
    process = begun("-c", SPEAKS.format(domain=DOMAIN, stops=stops))
    with all_ended(process):
        said = process.communicate(timeout=60)[0].splitlines()
        assert process.returncode == 0
    assert said == (["closed", "stopped"] if "print" in stops else ["closed"])
