"""The words and colours of the package: beam cases, states of localization and search, phases and outcomes of the driver.

Every terminal line, picture, report, rviz display and message takes its names, its order and its colours from here. The
numbers of the beam cases are those of the glass document (glass_localization.txt) and of msg/BeamCases.msg; the order of
the other enums is that of the constants in the messages, which a test compares.
"""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Dict, Iterable, List, Tuple

Rgb = Tuple[int, int, int]  # 0..255


class BeamCase(IntEnum):
    """What a beam met."""

    UNCERTAIN = 0
    DIFFUSE = 1
    SPECULAR = 2
    FIRST_PENETRATION = 3
    SECOND_PENETRATION = 4

    @property
    def label(self) -> str:
        """For people, with its number: "3 behind one pane"."""
        return f"{self.value} {self.words}"

    @property
    def words(self) -> str:
        """The same without the number."""
        return CASE_WORDS[self]

    @property
    def rgb(self) -> Rgb:
        """Its colour in every picture and in rviz."""
        return CASE_RGB[self]

    @property
    def colour(self) -> str:
        """The same as "#rrggbb"."""
        return hex_colour(self.rgb)


# As far as a beam gets, and last the beams that nothing explains: the order of every table and legend.
CASES_IN_ORDER = (
    BeamCase.DIFFUSE,
    BeamCase.SPECULAR,
    BeamCase.FIRST_PENETRATION,
    BeamCase.SECOND_PENETRATION,
    BeamCase.UNCERTAIN,
)
CASE_WORDS = {
    BeamCase.DIFFUSE: "first surface",
    BeamCase.SPECULAR: "mirrored",
    BeamCase.FIRST_PENETRATION: "behind one pane",
    BeamCase.SECOND_PENETRATION: "behind two panes",
    BeamCase.UNCERTAIN: "uncertain",
}
CASE_RGB: Dict[BeamCase, Rgb] = {  # Okabe and Ito, Color Universal Design (2008)
    BeamCase.DIFFUSE: (0, 158, 115),
    BeamCase.SPECULAR: (204, 121, 167),
    BeamCase.FIRST_PENETRATION: (86, 180, 233),
    BeamCase.SECOND_PENETRATION: (0, 114, 178),
    BeamCase.UNCERTAIN: (150, 150, 150),
}


class Word(str, Enum):
    """A state that is its own name: equal to the text of that name, which is what messages and files hold."""

    def __str__(self) -> str:
        return str(self.value)

    def __format__(self, spec: str) -> str:
        return format(str(self.value), spec)

    @property
    def code(self) -> int:
        """The number of the message's constant of this name."""
        return list(type(self)).index(self)


class LocalizationState(Word):
    """Whether the pose in the map may be relied on; msg/LocalizationStatus.msg."""

    UNKNOWN = "UNKNOWN"
    GLOBAL_SEARCH = "GLOBAL_SEARCH"
    LOCALIZED = "LOCALIZED"
    UNCERTAIN = "UNCERTAIN"
    LOST = "LOST"

    @property
    def colour(self) -> str:
        """In pictures and reports, as "#rrggbb"."""
        return STATE_COLOURS[self]


STATE_COLOURS = {
    LocalizationState.LOCALIZED: "#2ca02c",
    LocalizationState.UNCERTAIN: "#ffbf00",
    LocalizationState.LOST: "#d62728",
    LocalizationState.GLOBAL_SEARCH: "#9467bd",
    LocalizationState.UNKNOWN: "#7f7f7f",
}


def state_colour(state: str) -> str:
    """The colour of a state of localization by its name, as "#rrggbb"; black for one that a later version wrote."""
    return LocalizationState(state).colour if state in LocalizationState.__members__ else "#000000"


def states_in_order(states: Iterable[str]) -> List[str]:
    """Those that occur, each once, in the order of the colours; states that a later version wrote come last."""
    found = set(states)
    known = [str(state) for state in STATE_COLOURS if state in found]
    return known + sorted(found - set(known))


class SearchState(Word):
    """What is known about the place in the atlas; msg/TopologyStatus.msg."""

    NO_ATLAS = "NO_ATLAS"
    IDLE = "IDLE"
    WAITING = "WAITING"
    SEARCHING = "SEARCHING"
    TENTATIVE = "TENTATIVE"
    CONFIRMED = "CONFIRMED"
    AMBIGUOUS = "AMBIGUOUS"
    LOST = "LOST"


SEARCH_RGB: Dict[SearchState, Rgb] = {  # of the candidates, in the states that have any; Okabe and Ito as well
    SearchState.SEARCHING: (230, 159, 0),
    SearchState.TENTATIVE: (86, 180, 233),
    SearchState.CONFIRMED: (0, 158, 115),
    SearchState.AMBIGUOUS: (204, 121, 167),
}
SEARCH_IS_OVER = (SearchState.CONFIRMED, SearchState.AMBIGUOUS, SearchState.LOST)


class DriverPhase(Word):
    """What the driver does; msg/DriverStatus.msg."""

    IDLE = "IDLE"
    SEEKING = "SEEKING"
    FOLLOWING = "FOLLOWING"
    HOMING = "HOMING"
    RETURNING = "RETURNING"
    ARRIVED = "ARRIVED"
    GOING = "GOING"
    RECOVERING = "RECOVERING"
    HALTED = "HALTED"
    FAILED = "FAILED"


class Outcome(Word):
    """How a task of the driver ended; action/TraverseEdge.action and action/GotoNode.action."""

    SUCCEEDED = "SUCCEEDED"
    PREEMPTED = "PREEMPTED"
    REFUSED = "REFUSED"
    NOT_AT_MEETPOINT = "NOT_AT_MEETPOINT"
    NO_GRAPH = "NO_GRAPH"
    BLOCKED = "BLOCKED"
    NO_WAY = "NO_WAY"
    NO_INPUT = "NO_INPUT"
    NOT_LOCALIZED = "NOT_LOCALIZED"
    NO_MOVE_BASE = "NO_MOVE_BASE"
    RESET = "RESET"


def hex_colour(rgb: Rgb) -> str:
    """(0, 158, 115) -> "#009e73"."""
    return "#{:02x}{:02x}{:02x}".format(*rgb)
