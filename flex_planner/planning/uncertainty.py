"""How far an arm may be from its file: assumed, or as an identification has it."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import number

ASSUMED_ERROR, MAX_ERROR = 0.1, 0.5
"""Of stiffness and payload where nothing else is known, and at most, as shares of them."""
# of a payload, for it to be the one that was identified
_SAME_PAYLOAD = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Uncertainty:
    """
    Errors that stiffness and payload may have, as shares of themselves.

    Parameters
    ----------
    stiffness : float
        Of E I of the link that is least well known, 0 to 0.5.
    payload : float
        Of mass and inertia of the payload, 0 to 0.5.
    payload_mass : float or None
        That `payload` is of; another mass may be off by a tenth. None for any [kg].
    source : str
        Where the figures are from, for people.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    stiffness: float = ASSUMED_ERROR
    payload: float = ASSUMED_ERROR
    payload_mass: float | None = None
    source: str = 'assumed'

    def __post_init__(self) -> None:
        for name in ('stiffness', 'payload'):
            number(f'{name}_error', getattr(self, name), at_least=0, at_most=MAX_ERROR)

    def __str__(self) -> str:
        """Return it in words, with who says so."""
        payload = '' if self.payload_mass is None else f' of {self.payload_mass:.4g} kg'
        return (f'stiffness +-{100 * self.stiffness:.2g}%, payload{payload} '
                f'+-{100 * self.payload:.2g}% ({self.source})')

    def payload_error(self, mass: float) -> float:
        """Return by which share a payload may be off [kg]."""
        known = self.payload_mass
        if known is None or abs(mass - known) <= _SAME_PAYLOAD * known:
            return self.payload
        return ASSUMED_ERROR


ASSUMED = Uncertainty()
