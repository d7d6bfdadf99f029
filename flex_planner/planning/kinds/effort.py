"""How much work goes into the search over kinds of motion."""

from __future__ import annotations

from enum import Enum

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import one_of


class SearchEffort(Enum):
    """
    How many starts a search over kinds of motion may take.

    ``FAST`` follows the kind that a straight start leads to. ``NORMAL`` explores the arm made
    rigid from 16 starts where a limit is wanted, and for a plan from 8 to 16, until the best kind
    came three times. ``THOROUGH`` explores from 48 for both, whatever was met.

    """

    FAST = 'fast'
    NORMAL = 'normal'
    THOROUGH = 'thorough'

    @classmethod
    def of(cls, given: SearchEffort | str) -> SearchEffort:
        """Return the effort of a name, or raise InvalidValueError."""
        if isinstance(given, cls):
            return given
        names = [effort.value for effort in cls]
        if given not in names:
            raise InvalidValueError('search', given, one_of(given, names))
        return cls(given)

    @property
    def explores(self) -> bool:
        """Return whether several kinds are looked for."""
        return self is not SearchEffort.FAST

    @property
    def starts(self) -> int:
        """Return the number of starts of an exploration for a limit."""
        return {SearchEffort.FAST: 0, SearchEffort.NORMAL: 16, SearchEffort.THOROUGH: 48}[self]
