"""Requests that cannot be served as things are, with a code of their own."""

from __future__ import annotations

from flex_planner.base.errors import FlexPlannerError


class RequestError(FlexPlannerError):
    """
    A request that cannot be served now.

    Attributes
    ----------
    code : int
        Of PlanReport.

    """

    def __init__(self, code: int, sentence: str) -> None:
        super().__init__(sentence)
        self.code = code
