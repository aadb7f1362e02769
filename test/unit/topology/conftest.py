"""Makes what lies beside these tests importable: made_atlases, literal_forest."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
