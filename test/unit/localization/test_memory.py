"""What a map and particles cost in memory, of a process of their own."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

# Resident memory before and after a map of 1000 x 1000 cells, and the highest before and after 20,000 particles [bytes].
PROGRAM = """
import json, resource
from glass_nav import machine, params
import numpy as np
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

def rooms(cells):
    occupancy = np.zeros((cells, cells), np.int8)
    occupancy[::100] = occupancy[:, ::100] = 100
    return GridMap(occupancy, 0.05, np.zeros(3))

def localizer(grid_map, particles=100):
    values = {"min_particles": particles, "max_particles": particles, "recover_when_lost": False}  # no search runs
    return Localizer(params.load(LocalizerParams, values, "test"), grid_map, np.random.default_rng(0))

def update(localizer, stamp_ns):
    localizer.set_pose(POSE, np.diag([0.05, 0.05, 0.02]) ** 2)
    localizer.update(Scan(stamp_ns, RANGES_M, ANGLES_RAD, 0.02, 30.0, np.zeros(3)), np.zeros(3))

def highest():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

POSE, ANGLES_RAD = np.array([2.5, 2.5, 0.3]), np.radians(np.linspace(-135.0, 135.0, 720))
RANGES_M = RayCaster(rooms(400)).cast(POSE[None], ANGLES_RAD, 30.0)[0]
update(localizer(rooms(400)), 0)  # what is loaded once
figures = []
machine.give_back_memory()
figures.append(machine.resident_bytes())
large = localizer(rooms(1000))
update(large, 1)
machine.give_back_memory()
figures += [machine.resident_bytes(), highest()]
many = localizer(rooms(400), 20_000)
update(many, 2)
figures.append(highest())
print(json.dumps(figures))
"""


@pytest.mark.long_run
def test_a_cell_takes_less_than_24_bytes_and_a_particle_less_than_2_kB():
    done = subprocess.run([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True, timeout=120.0, check=True)
    before, with_map, highest_before, highest = json.loads(done.stdout)
    assert (with_map - before) / 1000**2 < 24.0
    assert (highest - highest_before) / 20_000 < 2000.0
