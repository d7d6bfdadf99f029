"""
Matplotlib, whatever the environment says about windows.

Pictures are files here. A backend that is named in the environment and does not exist is an error
when Matplotlib is loaded, and is of no use to these pictures.

"""

from __future__ import annotations

import os
import sys

_VARIABLE = 'MPLBACKEND'


def load_matplotlib() -> None:
    """Load Matplotlib, without a backend where the one in the environment is refused."""
    known = set(sys.modules)
    try:
        import matplotlib
    except ValueError:
        if _VARIABLE not in os.environ:
            raise
        for name in set(sys.modules) - known:
            if name.split('.')[0] == 'matplotlib':
                del sys.modules[name]
        refused = os.environ.pop(_VARIABLE)
        try:
            import matplotlib  # noqa: F401
        finally:
            os.environ[_VARIABLE] = refused


load_matplotlib()
