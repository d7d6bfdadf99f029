"""
Topics of a recording and the quality of service that their publisher offered.

rosbag2 stores the offered profiles as a YAML sequence. Without one it plays a latched topic back
as an ordinary one, and a late subscriber never sees the plan; a malformed one stops it.

"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
import re
from typing import Any, Final, NamedTuple, TypeVar

from flex_planner.base.errors import InvalidValueError
import yaml

TOPIC_NAME: Final = re.compile(r'(/[A-Za-z_][A-Za-z0-9_]*)+')
LARGEST_DEPTH: Final = 2**31 - 1  # middlewares count with 32 bits
TYPE_NAME: Final = re.compile(r'[a-z][a-z0-9_]*/(msg|srv|action)/[A-Z][A-Za-z0-9_]*')

_Policy = TypeVar('_Policy', bound=Enum)


class Reliability(Enum):
    """Whether a lost sample is sent again."""

    RELIABLE = 'reliable'
    BEST_EFFORT = 'best_effort'


class Durability(Enum):
    """Whether a late subscriber still gets the last samples."""

    TRANSIENT_LOCAL = 'transient_local'
    VOLATILE = 'volatile'


@dataclass(frozen=True, slots=True, kw_only=True)
class QosProfile:
    """
    Quality of service that a publisher offers, as far as we set it; the history is keep_last.

    Parameters
    ----------
    reliability : Reliability
        Reliable or best effort.
    durability : Durability
        Transient local (latched) or volatile.
    depth : int
        Samples kept, at least 1.

    """

    reliability: Reliability = Reliability.RELIABLE
    durability: Durability = Durability.VOLATILE
    depth: int = 10

    def __post_init__(self) -> None:
        """Refuse a depth that no middleware accepts."""
        if self.depth < 1:
            raise InvalidValueError('depth', self.depth, 'at least 1')

    def to_dict(self) -> dict[str, object]:
        """Return the profile as rosbag2 stores it since metadata version 9."""
        return {
            'history': 'keep_last',
            'depth': self.depth,
            'reliability': self.reliability.value,
            'durability': self.durability.value,
            'deadline': _infinite(),
            'lifespan': _infinite(),
            'liveliness': 'automatic',
            'liveliness_lease_duration': _infinite(),
            'avoid_ros_namespace_conventions': False,
        }

    def to_yaml(self) -> str:
        """Return the text of the channel metadata ``offered_qos_profiles``."""
        return _format_profile(self)

    @classmethod
    def from_yaml(cls, text: str) -> QosProfile:
        """
        Return the first profile of ``offered_qos_profiles``, or the default one.

        A policy that a bag does not know (rosbag2 finds most of them by discovery, which tells
        neither the history nor the depth) becomes the default too, and so does all of a text
        that is none of rosbag2's: the messages are good without it.

        """
        profiles = parse_yaml(text)
        if not isinstance(profiles, list) or not profiles or not isinstance(profiles[0], dict):
            return DEFAULT
        first: dict[str, Any] = profiles[0]
        depth: Any = first.get('depth')
        known = type(depth) is int and 0 < depth <= LARGEST_DEPTH
        return cls(
            reliability=_policy(first.get('reliability'), DEFAULT.reliability),
            durability=_policy(first.get('durability'), DEFAULT.durability),
            depth=depth if known else DEFAULT.depth,
        )


def parse_yaml(text: str | bytes) -> object:
    """Return what YAML of any writer says, None where it is no YAML."""
    try:
        return yaml.safe_load(text)
    # PyYAML's constructors raise all of these: at !!int x, !!timestamp x, 2020-99-99, [[[[...
    except (yaml.YAMLError, ValueError, LookupError, AttributeError, TypeError, RecursionError,
            OverflowError):
        return None


@lru_cache  # the same few for every topic of every recording, and PyYAML takes long
def _format_profile(profile: QosProfile) -> str:
    text: str = yaml.safe_dump([profile.to_dict()], sort_keys=False)
    return text


def _infinite() -> dict[str, int]:
    """Return rmw's infinite duration; a new object, else YAML would write an alias."""
    return {'sec': 9223372036, 'nsec': 854775807}


def _policy(value: object, default: _Policy) -> _Policy:
    """Return the policy of that name, or number up to metadata version 8, else the default."""
    members = list(type(default))
    if type(value) is int and 1 <= value <= len(members):
        return members[value - 1]
    return next((member for member in members if member.value == value), default)


DEFAULT: Final = QosProfile()
LATCHED: Final = QosProfile(durability=Durability.TRANSIENT_LOCAL, depth=1)


@dataclass(frozen=True, slots=True)
class Topic:
    """
    A topic of a recording.

    Parameters
    ----------
    name : str
        Absolute name, e.g. ``'/flex_planner/joint_trajectory'``.
    type_name : str
        Message type, e.g. ``'trajectory_msgs/msg/JointTrajectory'``.
    qos : QosProfile
        What the publisher offers, and offers again when the recording is played back.

    """

    name: str
    type_name: str
    qos: QosProfile = DEFAULT

    def __post_init__(self) -> None:
        """Refuse names that would make ``ros2 bag play`` give up on the whole file."""
        if not TOPIC_NAME.fullmatch(self.name):
            raise InvalidValueError('topic name', self.name, "absolute, e.g. '/planner/plan'")
        if not TYPE_NAME.fullmatch(self.type_name):
            raise InvalidValueError('message type', self.type_name, "like 'package/msg/Name'")


class Definition(NamedTuple):
    """
    The definition of a message type as a recording carries it.

    Attributes
    ----------
    type_name : str
        Such as ``'trajectory_msgs/msg/JointTrajectory'``.
    encoding : str
        Of the text, e.g. ``'ros2msg'``.
    text : bytes
        The definition with those of all types within it; empty if unknown.
    type_hash : str
        RIHS01 hash (REP-2016); empty if unknown.

    """

    type_name: str
    encoding: str = ''
    text: bytes = b''
    type_hash: str = ''
