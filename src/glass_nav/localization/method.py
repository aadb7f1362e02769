"""The choice of the localization method: the default, or the glass document alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

import numpy as np

from glass_nav.localization.document_localizer import DocumentLocalizer
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.params import choice
from glass_nav.world.grid_map import GridMap

DEFAULT, DOCUMENT = "default", "document"
PoseFilter = Union[Localizer, DocumentLocalizer]


@dataclass(frozen=True)
class Method:
    """The choice."""

    method: str = choice(DEFAULT, (DEFAULT, DOCUMENT))

    def begin(self, params: LocalizerParams, grid_map: GridMap, rng: np.random.Generator) -> PoseFilter:
        """A new one that knows nothing yet; for the arguments see Localizer."""
        kind = DocumentLocalizer if self.method == DOCUMENT else Localizer
        return kind(params, grid_map, rng)
