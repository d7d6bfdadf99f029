"""
Plan point-to-point motions of flexible-link manipulators.

The numerical core (everything but ``ros``, ``recording``, ``plotting`` and the console
scripts) needs only NumPy, SciPy, CasADi and PyYAML.

"""

__version__ = '0.1.0'
