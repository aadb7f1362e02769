"""From coarse to fine: which moves the emitter makes, and what bearings come of them, also over a serial line."""

from __future__ import annotations

import numpy as np
import pytest
from made_emitter import TAGS_DEG, SerialDevice, Turntable

from glass_nav import params
from glass_nav.params import ParamError
from glass_nav.sensing.emitter_search import EmitterSearch, EmitterSearchParams
from glass_nav.sensing.serial_emitter import EmitterError, SerialEmitter


def search(emitter, way=1, **values):
    clock = iter(range(1, 10_000))
    return EmitterSearch(EmitterSearchParams(**values), way).run(emitter, lambda: next(clock))


@pytest.mark.parametrize("way", [1, -1])
def test_every_tag_is_found_to_half_a_fine_step(way):
    bearings = search(Turntable(), way)
    assert sorted(bearing.landmark_id for bearing in bearings) == sorted(TAGS_DEG)
    for bearing in bearings:
        assert abs(np.degrees(bearing.angle_rad) - TAGS_DEG[bearing.landmark_id]) <= 0.5 + 1e-9
        assert np.degrees(bearing.sigma_rad) == pytest.approx(np.hypot(1.0, 0.18) / np.sqrt(12.0))
    assert [bearing.stamp_ns for bearing in bearings] == [1, 2, 3, 4]


def test_it_goes_back_where_a_tag_answers_and_repeats_the_move_in_fine_ones():
    table = Turntable({"B": -12.2})
    search(table)
    at = table.moves_deg.index(pytest.approx(-10.0))
    np.testing.assert_allclose(table.moves_deg[1:4], [-150.0, -140.0, -130.0])
    np.testing.assert_allclose(table.moves_deg[at : at + 13], [-10.0, -20.0, *np.arange(-19.0, -9.0), 0.0], atol=1e-9)


def test_it_stops_when_all_tags_are_found_or_it_is_told_to():
    table = Turntable()
    assert [bearing.landmark_id for bearing in search(table, tag_count=2)] == ["A", "C", "B"]  # C and B in one move
    assert max(table.moves_deg[1:]) == pytest.approx(-10.0)
    ended = EmitterSearch(EmitterSearchParams()).run(Turntable(), lambda: 1, lambda: False)
    assert ended == ()


def test_moves_that_do_not_fit_the_span_end_at_it():
    table = Turntable({"X": 3.3})
    (bearing,) = search(table, coarse_step_deg=7.0, fine_step_deg=2.0, span_deg=20.0)
    assert max(table.moves_deg[1:]) == pytest.approx(10.0) and abs(np.degrees(bearing.angle_rad) - 3.3) <= 1.0


def test_steps_that_do_not_ascend_are_refused():
    with pytest.raises(ParamError, match="must ascend, got 0.18, 20, 10 and 300"):
        params.load(EmitterSearchParams, {"fine_step_deg": 20.0}, "/scanner")


# -- over a serial line


@pytest.fixture
def device():
    with SerialDevice() as device:
        yield device


def test_a_device_on_a_serial_port_is_searched(device):
    with SerialEmitter(device.port, timeout_s=20.0) as emitter:
        bearings = search(emitter, tag_count=4)
    found = {bearing.landmark_id: np.degrees(bearing.angle_rad) for bearing in bearings}
    assert sorted(found) == sorted(TAGS_DEG)
    assert max(abs(found[tag] - at) for tag, at in TAGS_DEG.items()) <= 0.5 + 0.01


@pytest.mark.parametrize(
    "answer, text",
    [
        (lambda line: "?\n", "expected 'I ID' or 'A ANGLE', got '?'"),
        (lambda line: "", "did not arrive at 0.00 degrees within 0.05 s"),
        (lambda line: "x" * 500, "sends no lines of text|did not arrive"),
    ],
)
def test_a_device_that_says_something_else_is_told_of(device, answer, text):
    device.answer = answer
    with SerialEmitter(device.port, timeout_s=0.05) as emitter, pytest.raises(EmitterError, match=text):
        emitter.turn_to(0.0)


def test_what_is_no_serial_port_is_refused(tmp_path):
    with pytest.raises(EmitterError, match="/dev/nothing_here: cannot be opened: No such file"):
        SerialEmitter("/dev/nothing_here")
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(EmitterError, match="is not a serial port"):
        SerialEmitter(str(file))
    with pytest.raises(ValueError, match="~baud must be one of 9600, 19200, 57600, 115200, got 300"):
        SerialEmitter("/dev/null", 300)
