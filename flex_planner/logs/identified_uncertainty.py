"""What an identification says of how sure the values of an arm file are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import find_arm_file
from flex_planner.base.text_files import say_file
from flex_planner.base.yaml_files import read_yaml, YamlFileError
from flex_planner.identification.experiments import LogError
from flex_planner.identification.identification import Verdict
from flex_planner.identification.plant_parameters import list_parameters, Parameter, Quantity
from flex_planner.planning.uncertainty import ASSUMED, ASSUMED_ERROR, MAX_ERROR, Uncertainty

# of a value in the arm file and the one that was found, which the file has with all its digits
_SAME = 1e-6
_PAYLOAD = 'payload_mass'


def identification_file(arm_file: Path) -> Path:
    """Return where ``flex-planner identify`` writes what it knows of an arm file."""
    return arm_file.with_name(f'{arm_file.stem}_identification.yaml')


def find_uncertainty(name: str, arm: Arm) -> Uncertainty:
    """
    Return the uncertainty of an arm: identified if a file beside its own says so, else assumed.

    Parameters
    ----------
    name : str
        Preset or path of the arm file, as for `load_arm`.
    arm : Arm
        Read from there.

    Raises
    ------
    LogError
        If there is such a file, and it cannot be read, or is of other values.

    """
    path = identification_file(find_arm_file(name))
    return read_uncertainty(path, arm) if name != '-' and path.is_file() else ASSUMED


def read_uncertainty(path: Path, arm: Arm) -> Uncertainty:
    """
    Return the uncertainty that a file of ``flex-planner identify`` tells of.

    It is the larger one of interval and spread; of what was not found, a tenth. Of the links, that
    of the least well known one counts.

    Parameters
    ----------
    path : pathlib.Path
        The file.
    arm : Arm
        With the rigidities that were found.

    Raises
    ------
    LogError
        If it cannot be read, or is of other rigidities.

    """
    try:
        content: Any = read_yaml(path)[1]
        entries = {one['name']: one for one in content['parameters']}
        shares = {one: _share(entries[one.name]) for one in list_parameters(arm.n_joints)
                  if one.kind is Quantity.RIGIDITY and one.name in entries}
        payload = entries[_PAYLOAD]
        payload_share, payload_mass = _share(payload), float(payload['value'])
    except YamlFileError as error:
        raise LogError(str(error)) from None
    except (LookupError, TypeError, ValueError) as error:
        raise LogError(f'{say_file(path)} is not what flex-planner identify writes: '
                       f'{error}') from None
    for one in shares:
        _check(path, arm, one, entries[one.name])
    return Uncertainty(stiffness=max(shares.values(), default=ASSUMED_ERROR),
                       payload=payload_share, payload_mass=payload_mass,
                       source=f'identified, {say_file(path)}')


def _share(entry: dict[str, Any]) -> float:
    """Return by which share of itself a value may be off."""
    known = [abs(float(entry[name])) for name in ('half_width', 'spread')
             if entry[name] is not None]
    value = abs(float(entry['value']))
    if Verdict(entry['verdict']) is Verdict.FIXED or not known or not value:
        return ASSUMED_ERROR
    return min(max(known) / value, MAX_ERROR)


def _check(path: Path, arm: Arm, one: Parameter, entry: dict[str, Any]) -> None:
    """Raise LogError if a rigidity of the arm is not the one that was found."""
    found, has = float(entry['value']), float(arm.flexural_rigidities()[one.index])
    if abs(found - has) > _SAME * found:
        raise LogError(f'{say_file(path)} is of another arm: {one.name} was found to be '
                       f'{found:g} {one.unit}, but the arm file says {has:g}; identify again, '
                       'or move that file away')
