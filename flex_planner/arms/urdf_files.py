"""Where a URDF file is, and its text: of a .xacro file that which xacro makes of it."""

from __future__ import annotations

import os
from pathlib import Path

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.text_files import read_text, say_file, TextFileError

_PACKAGE = 'package://'


class UrdfError(FlexPlannerError):
    """A URDF file cannot be read; the message names it."""


def find_urdf(given: str, folder: Path) -> Path:
    """
    Return the path of a URDF file.

    Parameters
    ----------
    given : str
        Its path, from `folder` on; ``package://PACKAGE/PATH`` for a file of an installed package.
    folder : pathlib.Path
        Of the file that names it.

    Raises
    ------
    UrdfError
        If the package is not installed.

    """
    if not given.startswith(_PACKAGE):
        return folder / Path(given).expanduser()
    package, _, inner = given[len(_PACKAGE):].partition('/')
    prefixes = [entry for entry in os.environ.get('AMENT_PREFIX_PATH', '').split(':') if entry]
    for prefix in prefixes:
        share = Path(prefix) / 'share' / package
        if share.is_dir():
            return share / inner
    raise UrdfError(f'{given}: no package {package} is installed; is its workspace sourced?')


def expand_urdf(path: Path) -> str:
    """
    Return the text of a URDF file; what xacro makes of it if it ends in ``.xacro``.

    Raises
    ------
    UrdfError
        If it cannot be read, or xacro is not installed or refuses it.

    """
    if path.suffix == '.xacro':
        return _run_xacro(path)
    try:
        return read_text(path)
    except TextFileError as error:
        raise UrdfError(str(error)) from None


def _run_xacro(path: Path) -> str:
    try:
        import xacro  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        raise UrdfError(f'{say_file(path)}: xacro is not installed: expand it elsewhere, with '
                        'xacro FILE > robot.urdf, or install the Python package xacro') from None
    try:
        return str(xacro.process_file(str(path)).toxml())
    except Exception as error:  # xacro has errors of many kinds
        raise UrdfError(f'{say_file(path)}: xacro: {error}') from None
