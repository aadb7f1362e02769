# For mypy: the vote of cases, compiled from cpp/; its typed face is localization/beam_classification/case_votes.py.
from typing import Any

def __getattr__(name: str) -> Any: ...
