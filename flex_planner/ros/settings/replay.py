"""Parameters of the replay of a recording."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.ros.settings.fields import parameter_field


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplaySettings:
    """Parameters of the replay; all read-only."""

    recording: str = parameter_field(
        '', 'Folder of the recording, or its .mcap file.', read_only=True)
    rate: float = parameter_field(
        1.0, 'Speed of the playback, 2 is twice as fast.', lowest=1e-3, highest=1e3,
        read_only=True)
    start: float = parameter_field(
        0.0, 'Time to leave out at the beginning of the recording [s].', lowest=0.0, highest=1e9,
        read_only=True)
    delay: float = parameter_field(
        1.0, 'Time before the first message, in which subscribers find the publishers [s].',
        lowest=0.01, highest=60.0, read_only=True)
    loop: bool = parameter_field(False, 'Whether to begin again at the end.', read_only=True)
