"""Links of finite elements in arm files: a file of NumPy that a link names."""

from __future__ import annotations

from pathlib import Path
from typing import Any
import zipfile

from flex_planner.arms.element_modes import ElementModes
from flex_planner.arms.elements import ElementModel
from flex_planner.arms.spatial_body import Point, point
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.paths import expand_path, PathError
from flex_planner.base.validation import number
from flex_planner.base.yaml_files import YamlSection
import numpy as np

_NEEDED = ('nodes', 'mass', 'stiffness', 'modes', 'root_nodes', 'tip_nodes')
_OPTIONAL = ('line_nodes',)


def read_elements(section: YamlSection, end: Any, folder: Path) -> ElementModes:
    """
    Return the modes of a link from the file that it names.

    Parameters
    ----------
    section : YamlSection
        ``elements`` of the link: `file`, and `damping_ratio` if there is damping.
    end : array_like, shape (3,)
        Of the link [m].
    folder : pathlib.Path
        In which the path of the file begins.

    Raises
    ------
    InvalidValueError
        Naming the field by its path in the arm file, or of the named file by both.

    """
    name = section.text('file')
    damping = number(section.name('damping_ratio'), section.take('damping_ratio', 0.0),
                     at_least=0)
    section.finish()
    place: Point = point(section.name('end'), end)
    arrays = _arrays(section.name('file'), name, folder)
    try:
        return ElementModel(**arrays).reduce(place, damping)
    except InvalidValueError as error:
        where = section.name('' if error.field == 'damping_ratio' else 'file: ')
        raise type(error)(f'{where}{error.field}', error.value, error.bound) from None


def _arrays(field: str, name: str, folder: Path) -> dict[str, Any]:
    """Return the arrays of a file, all that are needed and no others."""
    try:
        with np.load(folder / expand_path(name), allow_pickle=False) as stored:
            arrays = {key: stored[key] for key in stored.files}
    except (OSError, PathError, ValueError, TypeError, AttributeError, EOFError,
            zipfile.BadZipFile) as error:
        raise InvalidValueError(field, name, f'a file as numpy.savez writes it ({error})') \
            from None
    for key in _NEEDED:
        if key not in arrays:
            raise InvalidValueError(f'{field}: {key}', None, f'given, as {", ".join(_NEEDED)}')
    for key in arrays:
        if key not in (*_NEEDED, *_OPTIONAL):
            raise InvalidValueError(f'{field}: {key}', 'given', 'left out: it is none of '
                                    f'{", ".join((*_NEEDED, *_OPTIONAL))}')
    return arrays
