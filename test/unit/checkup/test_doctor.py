"""Faults put into good bags, a simulated and a real one: each is named, and nothing where there is none.

The bags are read as a user's are; a fault is what a robot would have recorded with it.
"""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Set, Tuple

import faults
import numpy as np
import pytest
from faults import links, odometry_steps, scans, with_fields, with_planar, with_ranges, with_stamp

from glass_nav.checkup import doctor
from glass_nav.cli import main as cli
from glass_nav.recording import bag_observer
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

DEG = np.pi / 180.0


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Records and map of a robot that drives around half an atrium of glass."""
    folder = tmp_path_factory.mktemp("simulated")
    assert (
        cli.main(
            [
                "simulate",
                "glass_atrium",
                "--path",
                "half",
                "--beams",
                "181",
                "--rate",
                "5",
                "--out",
                str(folder / "good.bag"),
            ]
        )
        == 0
    )
    return faults.read(folder / "good.bag"), map_file.load(folder / "good.map.yaml")


@pytest.fixture(scope="module")
def real(data_dir):
    """Records and map of a real robot with an RPLidar, in another's map."""
    folder = data_dir / "logs" / "olin_mac"
    return faults.read(folder / "olin_mac.bag"), map_file.load(folder / "map.yaml")


@pytest.fixture(params=["simulated", "real"])
def good(request):
    return request.getfixturevalue(request.param)


@pytest.fixture
def named(tmp_path):
    """named(records, grid_map): names of what the doctor finds in a bag of these records."""

    def found(records: List[faults.Record], grid_map: Optional[GridMap] = None) -> Set[str]:
        path = tmp_path / f"faulty{len(list(tmp_path.iterdir()))}.bag"
        seen = bag_observer.observe([faults.write(path, records)])
        report = doctor.examine(seen, grid_map)
        assert all(finding.advice and "\n" not in finding.what for finding in report.findings)
        return {finding.name for finding in report.findings}

    return found


FOR_MESSAGES, FOR_A_DRIVE = 45, 350  # scans: enough for what every message shows, and for what a drive shows


def short(records: List[faults.Record], count: int = FOR_MESSAGES) -> List[faults.Record]:
    """The records until so many scans."""
    seen = np.cumsum([record[0] == "/scan" for record in records])
    return [record for record, scan in zip(records, seen) if scan <= count]


def second_of_ten(index: int) -> bool:
    return index % 10 == 1


def robot_part(message: Any) -> Any:
    ranges = np.array(message.ranges, np.float32)
    ranges[: len(ranges) // 15] = message.range_min + 0.05
    return with_ranges(message, lambda _: ranges)


def half_of_the_beams(index: int, message: Any) -> Any:
    if index % 2:
        message.angle_increment *= 2.0
        message.ranges = np.array(message.ranges[::2], np.float32)
        message.angle_max = message.angle_min + (len(message.ranges) - 1) * message.angle_increment
    return message


def repeat(times: int) -> Callable[[int, Any], Any]:
    last: Dict[str, Any] = {}

    def change(index: int, message: Any) -> Any:
        if index % times == 0:
            last["ranges"] = message.ranges
        return with_fields(message, ranges=last["ranges"])

    return change


def second_value(_: int, each: Any) -> List[Any]:
    other = copy.deepcopy(each)
    other.transform.translation.x += 0.3
    return [each, other]


def beside(sends: Callable[[int], Any]) -> Callable[[int, Any], Any]:
    """A second node sends the transform as well, 0.3 m and 0.1 rad off, with stamps a third of a period later."""

    def change(index: int, each: Any) -> Any:
        if not sends(index):
            return each
        other = with_planar(copy.deepcopy(each), faults.planar(each) + [0.3, 0.0, 0.1])
        return [each, with_stamp(other, lambda ns: ns + 6 * 10**6)]

    return change


def parents_in_turns(index: int, each: Any) -> Any:
    each.header.frame_id = "odom_ekf" if index % 2 else "odom"
    return each


def longer_quaternion(_: int, each: Any) -> Any:
    each.transform.rotation.w *= 1.5
    each.transform.rotation.z *= 1.5
    return each


def slashed(_: int, each: Any) -> Any:
    each.header.frame_id, each.child_frame_id = f"/{each.header.frame_id}", f"/{each.child_frame_id}"
    return each


def tilted(_: int, each: Any) -> Any:
    each.transform.rotation.x, each.transform.rotation.w = np.sin(5.0 * DEG), np.cos(5.0 * DEG)
    each.transform.rotation.y = each.transform.rotation.z = 0.0
    return each


def no_return_as(metres: float) -> Callable[[int, Any], Any]:
    def change(_: int, message: Any) -> Any:
        top = np.float32(metres)
        message = with_ranges(message, lambda ranges: np.where(np.isfinite(ranges) & (ranges < top), ranges, top))
        return with_fields(message, range_max=metres + 3.0)

    return change


# name of the finding -> the fault; and what follows from it beside
ON_EACH_MESSAGE: "List[Tuple[str, faults.Change, Set[str]]]" = [
    ("stamps-zero", scans(lambda i, m: with_stamp(m, lambda ns: 0) if second_of_ten(i) else m), set()),
    (
        "stamps-backwards",
        scans(lambda i, m: with_stamp(m, lambda ns: ns - 25 * 10**7) if second_of_ten(i) else m),
        set(),
    ),
    ("stamps-repeated", scans(lambda i, m: [m, copy.deepcopy(m)] if second_of_ten(i) else m), {"scan-repeats"}),
    ("scan-gaps", scans(lambda i, m: None if 20 < i < 35 else m), set()),
    ("clocks-differ", scans(lambda i, m: with_stamp(m, lambda ns: ns - 15 * 10**8)), {"odometry-missing"}),
    ("scan-delay", faults.delayed(lambda i: 0.8 * (i % 7 == 0)), {"stamps-backwards"}),
    ("scan-units", scans(lambda i, m: with_ranges(m, lambda r: 1000.0 * r)), {"scan-blind"}),
    (
        "scan-units",
        scans(
            lambda i, m: with_fields(
                with_ranges(m, lambda r: 1000.0 * r), range_min=1000.0 * m.range_min, range_max=1000.0 * m.range_max
            )
        ),
        set(),
    ),
    ("scan-angles", scans(lambda i, m: with_fields(m, angle_max=m.angle_max - 0.3)), set()),
    (
        "scan-angles-no-radians",
        scans(
            lambda i, m: with_fields(
                m, angle_min=m.angle_min / DEG, angle_max=m.angle_max / DEG, angle_increment=m.angle_increment / DEG
            )
        ),
        set(),
    ),
    ("scan-limits", scans(lambda i, m: with_fields(m, range_max=0.0)), {"scan-blind"}),
    ("scan-range-max", scans(lambda i, m: with_fields(m, range_max=np.inf)), set()),
    ("scan-blind", scans(lambda i, m: with_ranges(m, lambda r: np.where(np.arange(len(r)) % 40, np.inf, r))), set()),
    ("no-return-as-range", scans(no_return_as(4.5)), set()),
    ("scan-repeats", scans(repeat(3)), set()),
    ("scan-beams-change", scans(half_of_the_beams), set()),
    ("scan-time-increment", scans(lambda i, m: with_fields(m, time_increment=0.01, scan_time=0.1)), set()),
    ("scan-without-frame", scans(lambda i, m: with_fields(m, header=with_fields(m.header, frame_id=""))), set()),
    ("scan-empty", scans(lambda i, m: with_ranges(m, lambda r: r[:0])), {"scan-angles"}),
    ("lidar-not-in-tf", scans(lambda i, m: with_fields(m, header=with_fields(m.header, frame_id="lidar_link"))), set()),
    ("no-scans", faults.dropped("/scan"), set()),
    ("no-odometry", lambda records: faults.dropped("/odom")(links(lambda i, each: None)(records)), set()),
    ("odometry-not-in-tf", links(lambda i, each: None), set()),
    ("odometry-missing", links(lambda i, each: each if i < 100 else None), {"clocks-differ"}),
    ("odometry-jumps", links(lambda i, each: with_planar(each, faults.planar(each) + [6.0 * (i > 100), 0, 0])), set()),
    ("frame-two-parents", links(parents_in_turns), set()),
    ("frame-slash", links(slashed), set()),
    ("tf-contradiction", links(second_value), set()),
    ("tf-two-senders", links(beside(lambda i: 1)), {"odometry-speed"}),
    ("tf-two-senders", links(beside(lambda i: i % 3 == 0)), {"odometry-speed"}),
    ("tf-invalid", links(longer_quaternion), set()),
    ("lidar-tilted", links(tilted, "laser"), set()),
]

ON_THE_WAY: "List[Tuple[str, Callable[[], faults.Change], Set[str]]]" = [
    ("tf-gaps", lambda: links(lambda i, each: None if 200 < i < 350 else each), set()),
    ("scan-sees-robot", lambda: scans(lambda i, m: robot_part(m)), set()),
    ("odometry-scale", lambda: odometry_steps(lambda step: step * [1.25, 1.25, 1.0]), set()),
    ("odometry-scale", lambda: odometry_steps(lambda step: step * [0.8, 0.8, 1.0]), set()),
    ("odometry-turn-scale", lambda: odometry_steps(lambda step: step * [1.0, 1.0, 1.5]), set()),
    ("odometry-turn-scale", lambda: odometry_steps(lambda step: step * [1.0, 1.0, 0.6]), set()),
    ("odometry-turns-opposite", lambda: odometry_steps(lambda step: step * [1.0, -1.0, -1.0]), set()),
    ("odometry-stands", lambda: odometry_steps(lambda step: step * 0.0), set()),
    ("lidar-mirrored", lambda: scans(lambda i, m: with_ranges(m, lambda r: r[::-1])), set()),
    (
        "lidar-turned",
        lambda: links(lambda i, each: with_planar(each, faults.planar(each) + [0, 0, 30 * DEG]), "laser"),
        set(),
    ),
    (
        "lidar-turned",
        lambda: links(lambda i, each: with_planar(each, faults.planar(each) + [0, 0, np.pi]), "laser"),
        set(),
    ),
]

NEED_A_MAP = ("odometry-turns-opposite", "lidar-mirrored")


def test_nothing_is_found_where_nothing_is_wrong(good, named):
    records, grid_map = good
    assert named(records, grid_map) == set()
    assert named(short(records)) == set()


@pytest.mark.parametrize(
    "which, name, change, also",
    [
        pytest.param(which, *fault, id=f"{which}-{fault[0]}")
        for which, some in (("simulated", ON_EACH_MESSAGE), ("real", ON_EACH_MESSAGE[::2]))
        for fault in some
    ],
)
def test_a_fault_that_every_message_shows_is_named(request, named, which, name, change, also):
    found = named(change(short(request.getfixturevalue(which)[0])))
    assert name in found
    assert found <= {name} | also


@pytest.mark.parametrize(
    "which, name, change, also",
    [
        pytest.param(which, *fault, id=f"{which}-{fault[0]}")
        for which, some in (("simulated", ON_THE_WAY[::2]), ("real", ON_THE_WAY))
        for fault in some
    ],
)
def test_a_fault_that_the_drive_shows_is_named(request, named, which, name, change, also):
    records, grid_map = request.getfixturevalue(which)
    found = named(change()(short(records, FOR_A_DRIVE)), grid_map if name in NEED_A_MAP else None)
    assert name in found
    assert found <= {name} | also


def test_without_a_map_a_mirrored_lidar_and_a_wrong_sign_of_odometry_are_one_finding(simulated, named):
    records, _ = simulated
    assert named(scans(lambda i, m: with_ranges(m, lambda r: r[::-1]))(records)) == {"turns-opposite"}


def other_map(data_dir: Path) -> GridMap:
    return map_file.load(data_dir / "logs" / "uob_trace0" / "map.yaml")


@pytest.mark.parametrize(
    "name, change",
    [
        ("map-mirrored", lambda own: replace(own, occupancy=np.ascontiguousarray(own.occupancy[:, ::-1]))),
        ("map-empty", lambda own: replace(own, occupancy=np.where(own.occupied, -1, own.occupancy).astype(np.int8))),
        ("map-inverted", lambda own: replace(own, occupancy=np.where(own.occupied, 0, 100).astype(np.int8))),
    ],
)
def test_a_map_that_does_not_belong_to_the_scans_is_named(good, named, name, change):
    records, grid_map = good
    found = named(records, change(grid_map))
    assert name in found
    assert found <= {name}


def test_the_map_of_another_building_is_named(real, named, data_dir):
    assert named(real[0], other_map(data_dir)) == {"map-mismatch"}


@pytest.mark.parametrize("which, factor", [("simulated", 1.2), ("real", 0.85)])
def test_a_map_with_a_wrong_resolution_is_named_with_the_right_one(request, tmp_path, which, factor):
    records, own = request.getfixturevalue(which)
    wrong = replace(own, resolution_m=own.resolution_m * factor)
    report = doctor.examine(bag_observer.observe([faults.write(tmp_path / "good.bag", records)]), wrong)
    (finding,) = report.findings
    assert finding.name == "map-scale"
    told = float(finding.what.split("were the map ")[1].split()[0])
    assert told * factor == pytest.approx(1.0, abs=0.02)
