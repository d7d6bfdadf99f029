"""Parameters as fields of a dataclass: description, range and flag in one place; without ROS."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """Purpose and range of a parameter."""

    text: str
    lowest: float | None = None
    highest: float | None = None
    read_only: bool = False


def parameter_field(default: Any, text: str, *, lowest: float | None = None,
                    highest: float | None = None, read_only: bool = False) -> Any:
    """Return a dataclass field that is a parameter."""
    description = Description(text=text, lowest=lowest, highest=highest, read_only=read_only)
    metadata = {'description': description}
    if isinstance(default, list):
        return field(default_factory=lambda: list(default), metadata=metadata)
    return field(default=default, metadata=metadata)


def as_mapping(settings: Any) -> Mapping[str, Any]:
    """Return settings by parameter name."""
    return {entry.name: getattr(settings, entry.name) for entry in fields(settings)}
