"""Images of maps: whole or refused, of any size that the memory holds."""

from __future__ import annotations

import numpy as np
import PIL
import pytest
from PIL import Image

from glass_nav import machine
from glass_nav.world import image_file, map_file

by_a_pillow_that_reads_them = pytest.mark.skipif(
    int(PIL.__version__.split(".")[0]) < 9, reason="this Pillow reads no image that is written as numbers"
)
PLAIN = {
    "P1": (b"P1\n# by hand\n3 2\n101\n0 1 0\n", [[0, 255, 0], [255, 0, 255]]),
    "P2": (b"P2\n# by hand\n3 2 # wide\n100\n0 50 100\n1 2 3\n", [[0, 128, 255], [3, 5, 8]]),
    "P2 of 16 bits": (b"P2 3 2 65535 0 256 65535 1 2 300\n", [[0, 0, 255], [0, 0, 1]]),
}


@pytest.mark.parametrize("kind", PLAIN)
@by_a_pillow_that_reads_them
def test_an_image_that_is_written_as_numbers(tmp_path, kind):
    data, grey = PLAIN[kind]
    (tmp_path / "map.pgm").write_bytes(data)
    assert image_file.channels(tmp_path / "map.pgm")[..., 0].tolist() == grey


@by_a_pillow_that_reads_them
def test_colours_that_are_written_as_numbers(tmp_path):
    (tmp_path / "map.ppm").write_bytes(b"P3 1 2 255\n1 2 3 4 5 6\n")
    assert image_file.channels(tmp_path / "map.ppm").tolist() == [[[1, 2, 3]], [[4, 5, 6]]]


@pytest.mark.parametrize(
    "data",
    [
        *(PLAIN[kind][0][:-cut] for kind in ("P2", "P2 of 16 bits") for cut in (5, 6, 7)),
        PLAIN["P1"][0][:-2],
        b"P2 3 2 255 0 1 2 3 4 256\n",
        b"P2 3 2 255 0 1 2 3 4 -1\n",
        b"P2 3 2 255 0 1 2 3 4 x\n",
        b"P2 3 2 255\n",
        b"P3 1 2 255 1 2 3 4 5\n",
        b"P1 2 1 03",
    ],
)
@by_a_pillow_that_reads_them
def test_numbers_that_do_not_fit_the_image_are_refused(tmp_path, data):
    (tmp_path / "map.pgm").write_bytes(data)
    with pytest.raises(image_file.ImageError, match="pixels: the file is cut short or damaged$"):
        image_file.channels(tmp_path / "map.pgm")


@pytest.mark.parametrize("suffix", ["pgm", "png", "bmp", "tif", "gif", "jpg", "ppm"])
@pytest.mark.parametrize("share", [0.01, 0.1, 0.5, 0.9])
def test_an_image_that_ends_early_is_refused_whatever_its_format(tmp_path, suffix, share):
    path = tmp_path / f"map.{suffix}"
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (60, 80)).astype(np.uint8)).save(path)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(image_file.ImageError, match=f"map.{suffix}"):
        image_file.channels(path)


def test_a_map_beyond_the_limit_of_pillow_is_loaded(tmp_path, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)  # refuses twice as many
    Image.fromarray(np.zeros((30, 20), np.uint8)).save(tmp_path / "map.png")
    (tmp_path / "map.yaml").write_text(
        "image: map.png\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    assert map_file.load(tmp_path / "map.yaml").occupancy.shape == (30, 20)
    assert Image.MAX_IMAGE_PIXELS == 100


def test_a_map_beyond_the_memory_says_how_much_it_needs(tmp_path, monkeypatch):
    header = b"P5 20768 13612 255\n"  # 283 million pixels, of which the file has none
    (tmp_path / "map.pgm").write_bytes(header)
    monkeypatch.setattr(machine, "free_bytes", lambda: 500_000_000)
    with pytest.raises(image_file.ImageError) as err:
        image_file.channels(tmp_path / "map.pgm")
    assert str(err.value) == (
        f"its image {tmp_path / 'map.pgm'} has 20768 x 13612 pixels, which take about 1.1 GB of memory; 0.5 GB are free"
    )


def test_blocks_of_rows_make_the_same_map(tmp_path, monkeypatch):
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (30, 20, 4)).astype(np.uint8)).save(tmp_path / "map.png")
    (tmp_path / "map.yaml").write_text(
        "image: map.png\nmode: scale\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
        "free_thresh: 0.2\n"
    )
    whole = map_file.load(tmp_path / "map.yaml").occupancy
    monkeypatch.setattr(map_file, "_BLOCK", 70)
    np.testing.assert_array_equal(map_file.load(tmp_path / "map.yaml").occupancy, whole)
