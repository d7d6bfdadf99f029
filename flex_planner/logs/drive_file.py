"""Files that describe a drive: YAML, read strictly."""

from __future__ import annotations

from pathlib import Path

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.text_files import say_file
from flex_planner.base.validation import Array, vector
from flex_planner.base.yaml_files import read_yaml, YamlFileError, YamlSection
from flex_planner.control.joint_controller import EffortHold, Gains, MAX_GAIN
from flex_planner.identification.drive import Drive
from flex_planner.identification.experiments import LogError
import numpy as np

_SPEEDS = ('differences', 'measured')


def load_drive(path: Path, joints: int) -> Drive:
    """
    Return the drive that a file describes.

    Parameters
    ----------
    path : pathlib.Path
        With the fields ``rate`` [Hz], ``stiffness`` [N m/rad] and ``damping`` [N m s/rad], each
        one number or one per joint, and, if need be, ``speeds`` (``differences`` or
        ``measured``), ``speed_filter`` [Hz], ``effort_hold``, ``delay`` [s], ``resolution``
        [rad].
    joints : int
        n.

    Raises
    ------
    LogError
        If it cannot be read, or a field is unknown, missing or out of bounds.

    """
    try:
        top = YamlSection('', read_yaml(path)[1])
        gains = Gains(**{name: _per_joint(top, name, joints) for name in ('stiffness', 'damping')})
        speeds = top.text('speeds', _SPEEDS[0])
        if speeds not in _SPEEDS:
            raise InvalidValueError('speeds', speeds, ' or '.join(_SPEEDS))
        drive: Drive = top.build(
            Drive, gains=gains, rate=top.take('rate'), measured_speeds=speeds == _SPEEDS[1],
            speed_filter=top.take('speed_filter', 0.0), delay=top.take('delay', 0.0),
            resolution=top.take('resolution', 0.0),
            hold=EffortHold.named(top.text('effort_hold', EffortHold.END.value)))
    except YamlFileError as error:
        raise LogError(str(error)) from None
    except InvalidValueError as error:
        raise LogError(f'{say_file(path)}: {error}') from None
    return drive


def _per_joint(top: YamlSection, name: str, joints: int) -> Array:
    """Return gains, of which one number stands for all joints."""
    given = np.atleast_1d(np.asarray(top.take(name), dtype=float))
    if given.size == 1:
        given = np.full(joints, given[0])
    return vector(name, given, joints, at_least=0, at_most=MAX_GAIN)
