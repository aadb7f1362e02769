from __future__ import annotations

from pathlib import Path

import pytest

from glass_nav import package_files

REPO = Path(__file__).resolve().parents[2]


def test_in_a_checkout_its_folders_are_found() -> None:
    found = package_files.folder("maps")
    assert found is not None and found.resolve() == REPO / "maps"


def test_an_installed_package_has_them_in_its_share(tmp_path: Path) -> None:
    module = tmp_path / "lib" / "python3" / "dist-packages" / "glass_nav" / "package_files.py"
    assert package_files.folder("maps", module) is None
    maps = tmp_path / "share" / "glass_nav" / "maps"
    maps.mkdir(parents=True)
    assert package_files.folder("maps", module) == maps


def test_the_last_kind_of_file_in_a_folder_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(package_files, "folder", lambda name: tmp_path / name)
    for name in ("atlas/b/atlas.npz", "atlas/b/atlas.json", "atlas/a/atlas.npz", "atlas/c/other.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert package_files.by_name("atlas", "atlas.npz", "atlas.json") == {
        "a": tmp_path / "atlas" / "a" / "atlas.npz",
        "b": tmp_path / "atlas" / "b" / "atlas.json",
    }
    assert package_files.by_name("maps", "map.yaml") == {}


def test_a_near_miss_is_helped() -> None:
    assert package_files.not_found("offce", "a building", ["office", "atrium"]) == (
        "offce: no such file, nor a building of the package, which are office, atrium; did you mean office?"
    )
    assert (
        package_files.not_found("x", "an atlas", []) == "x: no such file, nor an atlas of the package, which are none"
    )
