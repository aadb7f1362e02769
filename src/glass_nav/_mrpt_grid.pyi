# For mypy: the ray caster, compiled from cpp/; its typed face is the Python module that imports it.
from typing import Any

def __getattr__(name: str) -> Any: ...
