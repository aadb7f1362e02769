"""Makes what lies beside these tests importable: faults."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
