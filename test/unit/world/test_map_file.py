"""Expected occupancies are worked by hand from map_server's rules: p = (255 - grey) / 255, above
occupied_thresh 100, below free_thresh 0, else unknown or, in mode scale, 1 + 98 * (p - free) / (occupied - free)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap
from glass_nav.world.map_file import MapError

MRPT_MAPS = Path(__file__).resolve().parents[2] / "data" / "mrpt"
FIELDS = {
    "image": "map.png",
    "resolution": "0.1",
    "origin": "[1.0, 2.0, 0.5]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.2",
}


@pytest.fixture
def write(tmp_path):
    """write(pixels, mode of PIL or None, key=text, ...): a map of one row of pixels; text None leaves the key out."""

    def write_map(pixels, kind=None, name="map.png", **fields):
        array = np.asarray(pixels, np.uint8)[None]
        Image.fromarray(array, kind).save(tmp_path / name)
        text = "".join(
            f"{key}: {value}\n" for key, value in {**FIELDS, "image": name, **fields}.items() if value is not None
        )
        (tmp_path / "map.yaml").write_text(text)
        return tmp_path / "map.yaml"

    return write_map


def row(path):
    return map_file.load(path).occupancy[0].tolist()


def test_trinary_is_free_unknown_or_occupied(write):
    path = write([255, 205, 204, 128, 90, 89, 0])  # 205: p = 0.196; 204: exactly 0.2; 90: 0.647; 89: 0.651
    grid = map_file.load(path)
    assert grid.occupancy.tolist() == [[0, 0, -1, -1, -1, 100, 100]]
    assert grid.occupancy.dtype == np.int8
    assert grid.resolution_m == 0.1
    assert grid.map_from_grid.tolist() == [1.0, 2.0, 0.5]
    assert map_file.load(str(path)).occupancy.shape == (1, 7)


@pytest.mark.parametrize("suffix", ["png", "pgm", "bmp"])
def test_the_first_row_of_the_map_is_the_last_of_the_image(tmp_path, suffix):
    Image.fromarray(np.array([[0, 255], [255, 255]], np.uint8)).save(tmp_path / f"map.{suffix}")
    (tmp_path / "map.yaml").write_text(
        "".join(f"{key}: {value}\n" for key, value in {**FIELDS, "image": f"map.{suffix}"}.items())
    )
    assert map_file.load(tmp_path / "map.yaml").occupancy.tolist() == [[0, 0], [100, 0]]


@pytest.mark.parametrize("negate", ["1", "true"])
def test_negate_swaps_black_and_white(write, negate):
    assert row(write([255, 128, 0], negate=negate)) == [100, -1, 0]


def test_scale_grades_what_lies_between(write):
    # p of 204, 128 and 90 is 0.2, 0.498 and 0.647 of 0.2..0.65
    assert row(write([255, 204, 128, 90, 0], mode="scale")) == [0, 1, 65, 98, 100]


def test_raw_takes_the_grey_value_itself(write):
    assert row(write([0, 1, 50, 100, 101, 254, 255], mode="raw")) == [0, 1, 50, 100, -1, -1, -1]


def test_colours_are_averaged(write):
    assert row(write([(255, 255, 255), (255, 0, 255), (0, 0, 90), (0, 0, 0)])) == [0, -1, 100, 100]


def test_alpha_counts_as_a_colour_in_trinary_as_it_does_in_map_server(write):
    # (0 + 0 + 0 + 255) / 4 = 63.75: occupied; (255 * 3 + 0) / 4 = 191.25: p = 0.25, unknown
    assert row(write([(255, 255, 255, 255), (0, 0, 0, 255), (255, 255, 255, 0)])) == [0, 100, -1]


def test_in_scale_a_transparent_cell_is_unknown_unless_beyond_the_thresholds(write):
    assert row(write([(128, 128, 128, 255), (128, 128, 128, 0), (0, 0, 0, 0)], mode="scale")) == [65, -1, 100]


def test_grey_with_alpha_reads_like_colour_with_alpha(write):
    assert row(write([(255, 255), (0, 255), (255, 0)], "LA")) == [0, 100, -1]


def test_palettes_and_bits_and_16_bit_greys_are_colours_too(write, tmp_path):
    path = write([0, 255, 0])
    Image.fromarray(np.array([[0, 255, 128]], np.uint8)).convert("P").save(tmp_path / "map.png")
    assert row(path) == [100, 0, -1]
    Image.fromarray(np.array([[0, 255, 255]], np.uint8)).convert("1").save(tmp_path / "map.png")
    assert row(path) == [100, 0, 0]
    Image.fromarray(np.array([[0, 65535, 32768]], np.uint16)).save(tmp_path / "map.png")
    assert row(path) == [100, 0, -1]
    Image.fromarray(np.array([[0, 255, 128]], np.uint8)).convert("CMYK").save(tmp_path / "map.tif")
    path.write_text(path.read_text().replace("map.png", "map.tif"))
    assert row(path) == [100, 0, -1]


def test_the_image_may_have_an_absolute_name_or_lie_in_another_folder(write, tmp_path):
    path = write([0, 255])
    (tmp_path / "pictures").mkdir()
    (tmp_path / "map.png").rename(tmp_path / "pictures" / "map.png")
    text = path.read_text()
    path.write_text(text.replace("map.png", "pictures/map.png"))
    assert row(path) == [100, 0]
    path.write_text(text.replace("map.png", str(tmp_path / "pictures" / "map.png")))
    assert row(path) == [100, 0]


def error(path):
    with pytest.raises(MapError) as caught:
        map_file.load(path)
    text = str(caught.value)
    assert "\n" not in text
    return text.replace(f"{path.parent}/", "")


NEEDS = "a map needs image, resolution, origin, negate, occupied_thresh, free_thresh"


@pytest.mark.parametrize(
    "fields, text",
    [
        ({"mode": "trinery"}, "map.yaml: mode must be trinary, scale or raw, got 'trinery'"),
        ({"resolution": "0"}, "map.yaml: resolution must be > 0 m, got 0.0"),
        ({"resolution": "-0.05"}, "map.yaml: resolution must be > 0 m, got -0.05"),
        ({"resolution": ".nan"}, "map.yaml: resolution must be a finite number, got '.nan'"),
        ({"resolution": "fine"}, "map.yaml: resolution must be a finite number, got 'fine'"),
        ({"resolution": None}, f"map.yaml: missing resolution; {NEEDS}"),
        ({"negate": None, "free_thresh": None}, f"map.yaml: missing negate, free_thresh; {NEEDS}"),
        ({"negate": "2"}, "map.yaml: negate must be 0 or 1, got '2'"),
        ({"negate": "none"}, "map.yaml: negate must be 0 or 1, got 'none'"),
        ({"origin": "[0, 0]"}, "map.yaml: origin must be [x, y, yaw] in m, m, rad, got ['0', '0']"),
        ({"origin": "[0, .inf, 0]"}, "map.yaml: origin must be [x, y, yaw] in m, m, rad, got ['0', '.inf', '0']"),
        ({"origin": "corner"}, "map.yaml: origin must be [x, y, yaw] in m, m, rad, got 'corner'"),
        (
            {"free_thresh": "0.7"},
            "map.yaml: thresholds must be 0 <= free_thresh < occupied_thresh <= 1, "
            "got free_thresh 0.7 and occupied_thresh 0.65",
        ),
        (
            {"occupied_thresh": "65"},
            "map.yaml: thresholds must be 0 <= free_thresh < occupied_thresh <= 1, "
            "got free_thresh 0.2 and occupied_thresh 65.0",
        ),
        ({"image": "''"}, "map.yaml: image must be the name of a file, got ''"),
        ({"image": "7"}, "map.yaml: its image 7 does not exist"),
    ],
)
def test_a_value_that_cannot_be_meant_is_refused_in_one_line(write, fields, text):
    path = write([0])
    path.write_text("".join(f"{key}: {value}\n" for key, value in {**FIELDS, **fields}.items() if value is not None))
    assert error(path) == text


def test_a_missing_image_is_refused(write, tmp_path):
    path = write([0])
    (tmp_path / "map.png").unlink()
    assert error(path) == "map.yaml: its image map.png does not exist"


@pytest.mark.parametrize(
    "written",
    [
        "5e-2",
        ".05",
        "0.05",
        "'0.05'",
        '"0.05"',
        "+0.05",
        "5.E-2",
        "0.5e-1",
        "!!float 0.05",
        "\t0.05",
        "0.05 # m",
        "&a 0.05",
    ],
)
def test_numbers_are_read_as_yaml_cpp_reads_them(write, written):
    assert map_file.load(write([0], resolution=written)).resolution_m == 0.05


def test_the_numbers_of_an_origin_are_read_so_too(write):
    grid_map = map_file.load(write([0], origin="[-5.e-2, '1e0', .05]"))
    assert grid_map.map_from_grid.tolist() == [-0.05, 1.0, 0.05]


@pytest.mark.parametrize(
    "fields",
    [
        {"resolution": "010", "negate": "00"},  # octal for an integer only
        {"resolution": "10.", "negate": "0x0"},
        {"resolution": "10", "negate": "FALSE"},
        {"resolution": "10", "negate": "off"},
        {"resolution": "10", "mode": "~"},
        {"resolution": "10", "mode": "'trinary'"},
        {"resolution": "&r 10", "free_thresh": "2e-1", "occupied_thresh": "'.65'"},
        {"resolution": "10", "origin": "\n  - '0'\n  - 0.0\n  - 0  # yaw"},
    ],
)
def test_every_field_is_read_as_yaml_cpp_reads_it(write, fields):
    grid_map = map_file.load(write([0, 100, 254], **fields))
    assert grid_map.resolution_m == 10.0 and grid_map.occupancy.tolist() == [[100, -1, 0]]


@pytest.mark.parametrize(
    "written", ["1_000", "0x1", "1:30", "+.inf", ".inf", "1e400", "0,05", "0.05 m", "true", "", "~", "[0.05]", "- 1"]
)
def test_what_yaml_cpp_reads_as_no_number_is_none(write, written):
    assert error(write([0], resolution=written)).startswith(("map.yaml: resolution must be", "map.yaml: is not yaml"))


def test_windows_lines_a_byte_order_mark_and_a_second_document_do_no_harm(write):
    path = write([0])
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n") + b"---\r\nresolution: 7\r\n")
    assert map_file.load(path).resolution_m == 0.1


@pytest.mark.parametrize("suffix", ["pgm", "png", "bmp"])
def test_an_image_with_too_few_data_is_refused(tmp_path, suffix):
    noise = np.random.default_rng(0).integers(0, 255, (30, 20)).astype(np.uint8)
    path_image = tmp_path / f"map.{suffix}"
    Image.fromarray(noise).save(path_image)
    path_image.write_bytes(path_image.read_bytes()[:-150])
    (tmp_path / "map.yaml").write_text(
        "".join(f"{key}: {value}\n" for key, value in {**FIELDS, "image": path_image.name}.items())
    )
    assert error(tmp_path / "map.yaml") == (
        f"map.yaml: the data of its image map.{suffix} do not fit its 20 x 30 pixels: the file is cut short or damaged"
    )


def test_an_image_that_is_none_is_refused(write, tmp_path):
    path = write([0])
    (tmp_path / "map.png").write_bytes(b"not a picture")
    assert error(path).startswith("map.yaml: its image map.png cannot be read: cannot identify image file")


def test_files_that_are_no_maps_are_refused(tmp_path):
    for name, content, text in [
        ("map.txt", "", "map.txt: a map is a map_server .yaml or an MRPT .gridmap[.gz]"),
        (
            "map.yaml",
            "- 1\n",
            "map.yaml: is no map: expected the keys image, resolution, origin, negate, occupied_thresh, free_thresh",
        ),
        (
            "map.yaml",
            "",
            "map.yaml: is no map: expected the keys image, resolution, origin, negate, occupied_thresh, free_thresh",
        ),
        ("map.gridmap", "words", "map.gridmap: is no MRPT grid map"),
    ]:
        (tmp_path / name).write_text(content)
        assert error(tmp_path / name).startswith(text)
    (tmp_path / "map.yaml").write_text("a: [1\nb: }")
    assert error(tmp_path / "map.yaml").startswith("map.yaml: is not yaml: ")
    assert error(tmp_path / "absent.yaml") == "absent.yaml: cannot be read: No such file or directory"
    assert error(tmp_path / "absent.gridmap.gz") == "absent.gridmap.gz: does not exist"
    (tmp_path / "map.yaml").write_bytes(b"\xff\xfe")
    assert error(tmp_path / "map.yaml").startswith("map.yaml: cannot be read: 'utf-8' codec")


def test_a_grid_map_of_mrpt_comes_with_its_place_and_unknown_cells():
    grid = map_file.load(MRPT_MAPS / "small.gridmap.gz")
    assert grid.occupancy.tolist() == [[99, 2, -1], [-1, -1, 71]]  # MRPT stores steps of log odds: 0.98, 0.71
    assert grid.resolution_m == 0.5
    assert grid.map_from_grid.tolist() == [-1.0, -0.5, 0.0]


def test_a_rawlog_is_no_grid_map(tmp_path):
    (tmp_path / "map.gridmap.gz").write_bytes((MRPT_MAPS / "no_scans.rawlog").read_bytes())
    assert error(tmp_path / "map.gridmap.gz") == (
        "map.gridmap.gz: holds mrpt::obs::CObservationComment, a grid map is COccupancyGridMap2D"
    )
    (tmp_path / "map.gridmap.gz").write_bytes(b"")
    assert error(tmp_path / "map.gridmap.gz") == "map.gridmap.gz: is empty or cut short"


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize(
    "values", [pytest.param([-1, 0, 100], id="trinary"), pytest.param([*range(-1, 99), 100], id="percent")]
)
def test_a_saved_map_comes_back_equal(tmp_path, seed, values):
    rng = np.random.default_rng(seed)
    occupancy = rng.choice(np.array(values, np.int8), size=rng.integers(1, 40, 2))
    grid = GridMap(occupancy, float(rng.uniform(0.01, 0.2)), rng.uniform(-3, 3, 3))
    map_file.save(grid, tmp_path / "map.yaml")
    back = map_file.load(tmp_path / "map.yaml")
    np.testing.assert_array_equal(back.occupancy, occupancy)
    assert back.resolution_m == grid.resolution_m
    np.testing.assert_array_equal(back.map_from_grid, grid.map_from_grid)


def test_ninety_nine_percent_comes_back_as_ninety_eight(tmp_path):
    map_file.save(GridMap(np.array([[99, 50]], np.int8), 0.1, np.zeros(3)), tmp_path / "map.yaml")
    assert map_file.load(tmp_path / "map.yaml").occupancy.tolist() == [[98, 50]]


def test_real_maps_load(data_dir):
    grid = map_file.load(data_dir / "maps" / "freihaus_eg" / "map.yaml")
    assert grid.occupancy.shape == (1169, 1654)
    assert grid.resolution_m == 0.0889
