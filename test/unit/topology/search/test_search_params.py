from __future__ import annotations

from typing import Any, Dict

import pytest

from glass_nav.topology.search.search_params import SearchParams


def test_the_procedure_of_the_document_is_asked_for_by_its_vote() -> None:
    assert SearchParams(vote_mode="seed").document and not SearchParams().document


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"vote_mode": "majority"}, "~vote_mode must be best or seed, got 'majority'"),
        ({"confirm_edges": -1}, "~confirm_edges must be >= 0, got -1"),
        ({"max_detection_errors": 3}, "~max_detection_errors must be 0, 1 or 2, got 3"),
        ({"least_explained": 1.0}, "~least_explained must be in [0, 1), got 1.0"),
        ({"least_explained": float("nan")}, "~least_explained must be in [0, 1), got nan"),
    ],
)
def test_parameters_that_mean_nothing_are_refused(fields: Dict[str, Any], line: str) -> None:
    with pytest.raises(ValueError) as refused:
        SearchParams(**fields)
    assert str(refused.value) == line
