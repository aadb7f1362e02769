"""Makes the buildings beside these tests importable: buildings."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
