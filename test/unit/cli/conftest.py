"""Makes the helpers beside the tests importable: pytest's import mode importlib does not."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
