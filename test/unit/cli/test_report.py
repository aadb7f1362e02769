"""The subcommand as a user calls it, on a small bag; the page in a real browser."""

from __future__ import annotations

import base64
import io
import re
import shutil
from html.parser import HTMLParser

import browser
import pytest
from PIL import Image

PICTURES = {
    "way.png",
    "cases_over_time.png",
    "glass.png",
    "errors.png",
    "integrity.png",
    "reliability.png",
    "update_time.png",
}
WORST = {f"worst_{number:02d}.png" for number in range(1, 11)}


class Page(HTMLParser):
    """Its images, headings, and the elements that are not closed in order."""

    EMPTY = {"meta", "link", "img", "br"}

    def __init__(self, text: str) -> None:
        super().__init__()
        self.images, self.ids, self.links, self.headings, self.open, self.wrong = [], set(), [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        if tag == "img":
            self.images.append(attributes)
        if "id" in attributes:
            self.ids.add(attributes["id"])
        if tag == "a":
            self.links.append(attributes["href"])
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(tag)
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if self.open[-1:] != [tag]:
            self.wrong.append(tag)
        else:
            self.open.pop()


@pytest.mark.long_run
def test_a_log_becomes_one_page_that_asks_no_address_for_anything(run, room_bag, room_map, tmp_path):
    code, out, err = run(
        "report",
        room_bag(true_beams=(("/true_beams", "TrueBeams"),)).write(),
        "--map",
        room_map,
        "--out",
        tmp_path / "out",
        "--global",
    )
    assert code == 0, err
    files = {path.name for path in (tmp_path / "out").iterdir()}
    drawn = PICTURES - {"glass.png"} | WORST | {"candidates.png", "confusion.png"}  # no wall was proved so early
    assert drawn | {"report.html", "per_scan.csv"} <= files
    assert out.endswith("written to out/report.html\n")
    assert "It started without an initial pose; up to " in out
    (tmp_path / "elsewhere").mkdir()
    shutil.move(str(tmp_path / "out" / "report.html"), str(tmp_path / "elsewhere" / "report.html"))  # all inside
    page = browser.opened(tmp_path / "elsewhere" / "report.html", tmp_path)
    assert (page.requests, page.console) == ([], [])
    parsed = Page(page.document)
    assert len(parsed.images) == len(drawn)
    for image in parsed.images:
        kind, _, data = image["src"].partition(",")
        assert kind == "data:image/png;base64"
        assert len(image["alt"]) > 20
        Image.open(io.BytesIO(base64.b64decode(data))).load()


def test_the_browser_of_these_tests_sees_a_page_that_asks_and_complains(tmp_path):
    (tmp_path / "asks.html").write_text('<img src="http://127.0.0.1:9/a.png"><script>console.error("broken")</script>')
    page = browser.opened(tmp_path / "asks.html", tmp_path)
    assert page.requests == ["http://127.0.0.1:9/a.png"]
    assert len(page.console) == (1 if browser.logs_its_console() else 0)


@pytest.mark.long_run
def test_results_of_a_replay_become_the_same_report(run, room_bag, room_map, tmp_path):
    path = room_bag().write()
    assert run("replay", path, "--map", room_map, "--out", tmp_path / "results", "--no-picture")[0] == 0
    code, _, err = run("report", tmp_path / "results", "--out", tmp_path / "report")
    assert (code, err) == (0, "")
    assert {file.name for file in (tmp_path / "report").iterdir()} == PICTURES | WORST | {"report.html"}
    page = (tmp_path / "report" / "report.html").read_text()
    parsed = Page(page)
    assert (parsed.wrong, parsed.open) == ([], [])
    assert parsed.headings[0] == "h1" and parsed.headings.count("h1") == 1
    assert {link[1:] for link in parsed.links} <= parsed.ids  # none leads out of the page, or nowhere
    assert "The robot knew where it was, and it was right" in page
    assert "room.bag on " in page


@pytest.mark.long_run
def test_without_a_ground_truth_it_is_said_that_nobody_knows(run, room_bag, room_map, tmp_path):
    x, y, yaw = room_bag().poses(room_bag().stamps_ns[:1])[0]
    code, out, _ = run(
        "report",
        room_bag(ground_truth=False).write(),
        "--map",
        room_map,
        "--out",
        tmp_path / "out",
        "--initial-pose",
        x,
        y,
        yaw,
        "--initial-cov",
        0.01,
        0.01,
        0.01,
    )
    assert code == 0
    assert "There is no ground truth, so the errors are unknown." in out
    assert PICTURES - {"integrity.png"} | WORST <= {file.name for file in (tmp_path / "out").iterdir()}


@pytest.mark.long_run
def test_what_is_no_run_is_refused_in_one_line(run, room_bag, room_map, tmp_path):
    path = room_bag().write()
    assert run("report", path, "--out", tmp_path / "out") == (2, "", "glass_nav report: a log needs --map\n")
    assert run("report", path, "--map", room_map, "--out", tmp_path / "out", "--seed", -1)[0] == 2
    (tmp_path / "empty").mkdir()
    assert run("report", tmp_path / "empty", "--out", tmp_path / "out") == (
        3,
        "",
        "glass_nav report: empty: holds no results of a replay (there is no metrics.json)\n",
    )
    assert (
        run("replay", path, "--map", room_map, "--out", tmp_path / "results", "--no-picture", "--max-scans", 3)[0] == 0
    )
    (tmp_path / "other.yaml").write_text((room_map.parent / "map.yaml").read_text().replace("map.pgm", "other.png"))
    Image.new("L", (30, 20), 254).save(tmp_path / "other.png")
    code, _, err = run("report", tmp_path / "results", "--map", tmp_path / "other.yaml", "--out", tmp_path / "out")
    assert (code, err) == (
        3,
        "glass_nav report: results: its glass map has 122 x 82 cells, the map 30 x 20: it is of another map\n",
    )
    metrics = tmp_path / "results" / "metrics.json"
    metrics.write_text(metrics.read_text().replace(str(room_map), "gone/map.yaml"))
    assert run("report", tmp_path / "results", "--out", tmp_path / "out")[2] == (
        "glass_nav report: results: the map of that replay, gone/map.yaml, is not there from here: give --map\n"
    )
    (tmp_path / "results" / "glass_map.yaml").unlink()
    assert run("report", tmp_path / "results", "--map", room_map, "--out", tmp_path / "out")[0] == 0
    assert not (tmp_path / "out" / "glass.png").exists()
