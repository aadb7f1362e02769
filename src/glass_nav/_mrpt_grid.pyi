# For mypy: ray caster and scan matcher, compiled from cpp/; their typed faces are the Python modules that import it.
from typing import Any

def __getattr__(name: str) -> Any: ...
