"""Names and colours of beam cases, states of localization and search, phases and outcomes of the driver.

Every terminal line, picture, report, rviz display and message takes its names, its order and its colours from here. The
numbers of the beam cases are those of the glass document (glass_localization.txt) and of msg/BeamCases.msg; the order of
the other enums is that of the constants in the messages, which a test compares.

The colours that are shown together were chosen so that people with deuteranopia or protanopia see them as different: in
the simulations of Machado, Oliveira and Fernandes (2009) any two are MIN_COLOUR_DIFFERENCE or more apart in CIE Lab, and
their lightness differs, which a print in grey keeps. A mark or a hatching repeats what a colour says.
test/unit/test_colours.py computes the distances.
"""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Any, Dict, Iterable, List, Tuple

Rgb = Tuple[int, int, int]  # 0..255

MIN_COLOUR_DIFFERENCE = 25.0  # CIE Lab; 2.3 is just noticeable side by side
MIN_LIGHTNESS_STEP = 7.0  # CIE L*, of 100


class BeamCase(IntEnum):
    """What a beam met."""

    UNCERTAIN = 0
    DIFFUSE = 1
    SPECULAR = 2
    FIRST_PENETRATION = 3
    SECOND_PENETRATION = 4

    @property
    def label(self) -> str:
        """Name with number: "3 behind one pane"."""
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

    @property
    def mark(self) -> str:
        """The figure at the end of a beam, as matplotlib names it."""
        return CASE_MARKS[self]

    @property
    def hatch(self) -> str:
        """The pattern of its areas, as matplotlib names it."""
        return CASE_HATCHES[self]


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
CASE_RGB: Dict[BeamCase, Rgb] = {
    BeamCase.DIFFUSE: (63, 224, 58),
    BeamCase.SPECULAR: (129, 108, 34),
    BeamCase.FIRST_PENETRATION: (94, 169, 244),
    BeamCase.SECOND_PENETRATION: (0, 65, 159),
    BeamCase.UNCERTAIN: (138, 138, 138),
}
CASE_MARKS = {  # matplotlib's names of markers; rviz shows the same figures
    BeamCase.DIFFUSE: "s",
    BeamCase.SPECULAR: "^",
    BeamCase.FIRST_PENETRATION: "+",
    BeamCase.SECOND_PENETRATION: "D",
    BeamCase.UNCERTAIN: "x",
}
CASE_HATCHES = {  # of areas, matplotlib's patterns
    BeamCase.DIFFUSE: "",
    BeamCase.SPECULAR: "//",
    BeamCase.FIRST_PENETRATION: "+",
    BeamCase.SECOND_PENETRATION: "x",
    BeamCase.UNCERTAIN: ".",
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
    LocalizationState.LOCALIZED: "#1aa3e8",
    LocalizationState.UNCERTAIN: "#f7dc00",
    LocalizationState.LOST: "#8f0000",
    LocalizationState.GLOBAL_SEARCH: "#8b2bd8",
    LocalizationState.UNKNOWN: "#bdbdbd",
}
STATE_MARKS = {  # along a path, matplotlib's names of markers
    LocalizationState.LOCALIZED: "",
    LocalizationState.UNCERTAIN: "^",
    LocalizationState.LOST: "X",
    LocalizationState.GLOBAL_SEARCH: "o",
    LocalizationState.UNKNOWN: "s",
}
STATE_HATCHES = {  # of areas, matplotlib's patterns
    LocalizationState.LOCALIZED: "",
    LocalizationState.UNCERTAIN: "//",
    LocalizationState.LOST: "xx",
    LocalizationState.GLOBAL_SEARCH: "o",
    LocalizationState.UNKNOWN: "..",
}


def state_colour(state: str) -> str:
    """The colour of a state of localization by its name, as "#rrggbb"; black for one that a later version wrote."""
    return LocalizationState(state).colour if state in LocalizationState.__members__ else "#000000"


def state_mark(state: str) -> str:
    """The mark of a state along a path; none for one that a later version wrote."""
    return STATE_MARKS[LocalizationState(state)] if state in LocalizationState.__members__ else ""


def state_hatch(state: str) -> str:
    """The pattern of a state's areas; none for one that a later version wrote."""
    return STATE_HATCHES[LocalizationState(state)] if state in LocalizationState.__members__ else ""


def states_in_order(states: Iterable[str]) -> List[str]:
    """The states that occur, each once, in the order of the colours; states of later versions come last."""
    found = set(states)
    known = [str(state) for state in STATE_COLOURS if state in found]
    return known + sorted(found - set(known))


class WallKind(Word):
    """Kind of a wall, by its probability of glass."""

    SOLID = "solid"
    UNDECIDED = "undecided"
    GLASS = "glass"

    @property
    def rgb(self) -> Rgb:
        """Its colour in every picture and in rviz."""
        return WALL_RGB[self]

    @property
    def colour(self) -> str:
        """The same as "#rrggbb"."""
        return hex_colour(self.rgb)


WALL_RGB: Dict[WallKind, Rgb] = {
    WallKind.SOLID: (122, 74, 32),
    WallKind.UNDECIDED: (240, 228, 66),
    WallKind.GLASS: (0, 184, 212),
}
UNMAPPED_GLASS, UNMAPPED_GLASS_RGB = "unmapped glass", (230, 0, 126)  # panes found that the map lacks
SOLID_BELOW, GLASS_FROM = 25, 75  # probability of glass [percent]


class SearchState(Word):
    """State of the search in the atlas; msg/TopologyStatus.msg."""

    NO_ATLAS = "NO_ATLAS"
    IDLE = "IDLE"
    WAITING = "WAITING"
    SEARCHING = "SEARCHING"
    TENTATIVE = "TENTATIVE"
    CONFIRMED = "CONFIRMED"
    AMBIGUOUS = "AMBIGUOUS"
    LOST = "LOST"


SEARCH_RGB: Dict[SearchState, Rgb] = {  # of the candidates, in the states that have any
    SearchState.SEARCHING: (143, 100, 8),
    SearchState.TENTATIVE: (47, 151, 245),
    SearchState.CONFIRMED: (20, 220, 171),
    SearchState.AMBIGUOUS: (106, 51, 95),
}
SEARCH_IS_OVER = (SearchState.CONFIRMED, SearchState.AMBIGUOUS, SearchState.LOST)


class DriverPhase(Word):
    """Phase of the driver; msg/DriverStatus.msg."""

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


TAG_RGB: Rgb = (0, 114, 178)  # a landmark
USED_RGB: Rgb = (20, 220, 171)  # a bearing that the fix used
LEFT_OUT_RGB: Rgb = (143, 45, 0)  # and one that it did not
POSE_RGB: Rgb = (213, 94, 0)  # in rviz
PARTICLE_RGB: Rgb = (230, 159, 0)
PLACE_RGB: Rgb = (139, 43, 216)  # of a global search, in the colour of the state
ATLAS_RGB: Rgb = (130, 130, 130)
NODE_RGB: Rgb = (60, 60, 60)
FOREST_RGB: Rgb = (0, 114, 178)
TRUTH_COLOUR = "#111111"  # of paths, dashed
SERIES_COLOURS = ("#004f9e", "#b85000", "#00c896", "#5c1f4f", "#f0d000", "#3aa0e8", "#000000")  # things to compare
SERIES_LINES: Tuple[Any, ...] = (
    "-",
    "--",
    "-.",
    ":",
    (0, (5, 1, 1, 1, 1, 1)),
    (0, (8, 2)),
    (0, (1, 2)),
)  # and their lines
SERIES_MARKS = ("s", "^", "o", "D", "v", "P", "X")


def hex_colour(rgb: Rgb) -> str:
    """(0, 158, 115) -> "#009e73"."""
    return "#{:02x}{:02x}{:02x}".format(*rgb)
