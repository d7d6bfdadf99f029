"""
Plan point-to-point motions of flexible-link manipulators.

    from flex_planner import load_arm, plan_path, Task

    arm = load_arm('korayem_ei50')
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0, payload_mass=1.0)
    plan = plan_path(task)

These names are loaded when they are first used. All else is found by folder, for example
``flex_planner.simulation``, ``flex_planner.maps`` or ``flex_planner.collocation``. The numerical
core (``base`` to ``simulation``) needs only NumPy, SciPy, CasADi and PyYAML.

"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from flex_planner.base.version import VERSION

if TYPE_CHECKING:
    from flex_planner.arms.arm import Arm
    from flex_planner.arms.arm_files import load_arm
    from flex_planner.base.errors import FlexPlannerError
    from flex_planner.base.progress import Monitor
    from flex_planner.capacity.max_payload import find_max_payload
    from flex_planner.capacity.min_duration import find_min_duration
    from flex_planner.optimal_control.task import Task
    from flex_planner.planning.objectives import Objectives
    from flex_planner.planning.plan import Plan
    from flex_planner.planning.plan_path import plan_path

__version__ = VERSION

__all__ = ['Arm', 'FlexPlannerError', 'Monitor', 'Objectives', 'Plan', 'Task',
           'find_max_payload', 'find_min_duration', 'load_arm', 'plan_path']

_MODULES = {
    'Arm': 'arms.arm', 'FlexPlannerError': 'base.errors', 'Monitor': 'base.progress',
    'Objectives': 'planning.objectives', 'Plan': 'planning.plan', 'Task': 'optimal_control.task',
    'find_max_payload': 'capacity.max_payload', 'find_min_duration': 'capacity.min_duration',
    'load_arm': 'arms.arm_files', 'plan_path': 'planning.plan_path'}


def __getattr__(name: str) -> object:
    """Load a name of the public face; see PEP 562."""
    if name not in _MODULES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_MODULES[name]}'), name)


def __dir__() -> list[str]:
    """Return the names of the public face and of the module."""
    return sorted({*__all__, *globals()})
