"""Makes the second implementation beside these tests importable: slow_raycast."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
