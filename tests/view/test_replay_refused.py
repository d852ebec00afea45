"""Files that are no runs, and damaged ones: refused in a sentence, or read as what they were."""

from contextlib import suppress

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap")

from mcap.reader import make_reader

from clearway.base.errors import InputError
from clearway.view.replay import schemas
from clearway.view.replay.reading import cloud_points, read_run
from flown_missions import written_run


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return written_run(tmp_path_factory.mktemp("run"))


def refused(path):
    with pytest.raises(InputError) as caught:
        read_run(path)
    assert str(path) in str(caught.value) or str(path.parent) in str(caught.value)
    return str(caught.value)


def test_files_that_are_none_are_refused(tmp_path):
    assert "no run.mcap in the folder" in refused(tmp_path)
    assert "No such file" in refused(tmp_path / "absent.mcap")
    empty = tmp_path / "empty.mcap"
    empty.write_bytes(b"")
    assert "no MCAP file (0 bytes)" in refused(empty)
    other = tmp_path / "other.mcap"
    other.write_text("name,lat,lon\n" * 10)
    assert "no MCAP file" in refused(other)


@pytest.mark.parametrize("share", [0.01, 0.3, 0.9, 0.999])
def test_a_truncated_file_is_refused(path, tmp_path, share):
    data = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: int(share * len(data))])
    assert "truncated" in refused(cut)


def test_damaged_bytes_are_refused_or_do_no_harm(path, tmp_path):
    data, rng = path.read_bytes(), np.random.default_rng(4)
    damaged, refusals = tmp_path / "damaged.mcap", 0
    for _ in range(60):
        spoilt = bytearray(data)
        at = int(rng.integers(8, len(data) - 40))
        if rng.random() < 0.5:
            spoilt[at] ^= 1 << int(rng.integers(8))
        else:
            del spoilt[at : at + int(rng.integers(1, 30))]
        damaged.write_bytes(spoilt)
        with suppress(InputError):  # Any other error would end the test.
            read_run(damaged)
            continue
        refusals += 1
    assert refusals > 20


@pytest.mark.parametrize("packed", ["ZSTD", "LZ4"])
def test_what_unpacks_to_far_more_than_a_flight_is_refused_unread(tmp_path, packed):
    bomb = tmp_path / "bomb.mcap"
    again(bomb, packed, [(schemas.STATE, bytes(30_000_000))] * 4)
    assert bomb.stat().st_size < 1_000_000
    assert "unpack to more than" in refused(bomb)


@pytest.mark.parametrize("packed", ["ZSTD", "LZ4", "NONE"])
def test_a_run_packed_anew_is_the_same_run(path, tmp_path, packed):
    with path.open("rb") as file:
        kept = [(one[1].topic, one[2].data) for one in make_reader(file).iter_messages()]
    again(tmp_path / "again.mcap", packed, kept)
    was, now = read_run(path), read_run(tmp_path / "again.mcap")
    assert (was.mission, was.states, was.decisions) == (now.mission, now.states, now.decisions)


def again(path, packed, kept):
    """Messages by topic, written by the library of the format."""
    from mcap.writer import CompressionType, Writer

    with path.open("wb") as file:
        writer, channels = Writer(file, compression=CompressionType[packed]), {}
        writer.start()
        for number, (topic, data) in enumerate(kept):
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "json", 0)
            writer.add_message(channels[topic], number, data, number, number)
        writer.finish()


def foreign(path, topics):
    import foxglove

    context = foxglove.Context()
    with foxglove.open_mcap(str(path), context=context):
        for topic, message in topics.items():
            foxglove.Channel(topic, message_encoding="json", context=context).log(message)


def test_files_of_other_programs_and_versions_are_refused(tmp_path):
    foreign(tmp_path / "camera.mcap", {"/camera": {"a": 1}})
    assert "topics /clearway/mission and /clearway/state are needed, there are /camera" in refused(
        tmp_path / "camera.mcap"
    )
    newer = {schemas.MISSION: {"format": 99}, schemas.STATE: {}}
    foreign(tmp_path / "newer.mcap", newer)
    assert "format 99" in refused(tmp_path / "newer.mcap")
    broken = {schemas.MISSION: {"format": 1, "summary": {"decisions": 0}}, schemas.STATE: {}}
    foreign(tmp_path / "broken.mcap", broken | {schemas.WORLD_POINTS: {}})
    assert "damaged" in refused(tmp_path / "broken.mcap")


def test_a_cloud_of_half_points_is_refused():
    with pytest.raises(ValueError, match="no whole points"):
        cloud_points(bytes([6 << 3 | 2, 5]) + b"12345")
