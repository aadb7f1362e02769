from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "topology"))  # made_atlases, floors
sys.path.insert(0, str(Path(__file__).resolve().parent))  # made_buildings
