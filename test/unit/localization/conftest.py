"""Makes what lies beside these tests importable: buildings, made_references."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
