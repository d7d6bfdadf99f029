"""The .msg files of interface packages."""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
import sys

from flex_planner.base.errors import RecordingError


def definition_folder(package: str, environment: Mapping[str, str] | None = None) -> Path:
    """
    Find the folder that holds a package's ``msg/`` folder, without importing ROS.

    Definitions that an installation of this package, or its source checkout, carries come first:
    they are those of this version. Then come the prefixes in AMENT_PREFIX_PATH and Python's own.

    Parameters
    ----------
    package : str
        Name of the interface package.
    environment : mapping, optional
        Environment variables; default ``os.environ``.

    Raises
    ------
    RecordingError
        If none of these places has it.

    """
    variables = os.environ if environment is None else environment
    prefixes = [p for p in variables.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if p]
    here = Path(__file__).resolve()
    places = [here.parent / package, here.parents[2] / package,
              *(Path(prefix) / 'share' / package for prefix in [*prefixes, sys.prefix])]
    for place in places:
        if (place / 'msg').is_dir():
            return place
    raise RecordingError(f'no message definitions of {package} in '
                         f'{", ".join(map(str, places))}: source the workspace that has them')


def read_texts(folder: Path) -> dict[str, str]:
    """Return the text of every .msg file of a package by the name of its type."""
    files = sorted((folder / 'msg').glob('*.msg'))
    if not files:
        raise RecordingError(f'no .msg files in {folder / "msg"}')
    try:
        texts = {file.stem: file.read_text(encoding='utf-8') for file in files}
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f'cannot read the definitions in {folder}: {error}') from error
    return {f'{folder.name}/msg/{stem}': f'{text.rstrip()}\n' for stem, text in texts.items()}
