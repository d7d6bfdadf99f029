"""The page of the Python interface: all names of the public modules."""

from __future__ import annotations

from importlib import import_module
import inspect
from types import ModuleType

_HEAD = """\
# Python

The ten names of the first section are the face of the library, imported from `flex_planner`; most
programs need no others. Those below are imported from their module. The
[changelog](changelog.rst) tells what changes. Units are SI and radians; arrays have the shapes
that the entries give.
"""
# what is meant for people's own programs, in the order in which they meet it
SECTIONS = {
    'The face': ('flex_planner',),
    'Arms': ('flex_planner.arms.arm', 'flex_planner.arms.arm_files',
             'flex_planner.arms.kinematics', 'flex_planner.arms.inverse_kinematics',
             'flex_planner.dynamics.arm_dynamics', 'flex_planner.optimal_control.arm_model'),
    'Arms in space': ('flex_planner.arms.spatial_arm', 'flex_planner.arms.spatial_joint',
                      'flex_planner.arms.spatial_link', 'flex_planner.arms.spatial_beam',
                      'flex_planner.arms.elements', 'flex_planner.arms.element_modes',
                      'flex_planner.arms.spatial_body',
                      'flex_planner.arms.spatial_inverse_kinematics'),
    'Tasks and plans': ('flex_planner.optimal_control.task',
                        'flex_planner.optimal_control.goal_in_pose',
                        'flex_planner.optimal_control.path_constraints',
                        'flex_planner.optimal_control.via_points',
                        'flex_planner.planning.objectives',
                        'flex_planner.planning.plan', 'flex_planner.planning.plan_path',
                        'flex_planner.planning.certificate', 'flex_planner.planning.warnings',
                        'flex_planner.planning.replan',
                        'flex_planner.planning.sampling', 'flex_planner.planning.robustness',
                        'flex_planner.planning.residuals', 'flex_planner.planning.uncertainty',
                        'flex_planner.planning.robust.objective',
                        'flex_planner.planning.robust.effort_front'),
    'Limits': ('flex_planner.capacity.max_payload', 'flex_planner.capacity.min_duration',
               'flex_planner.capacity.results', 'flex_planner.optimal_control.free_payload',
               'flex_planner.planning.proofs'),
    'Feedback': ('flex_planner.planning.feedback.find_gains',
                 'flex_planner.planning.feedback.gains',
                 'flex_planner.planning.feedback.carried_motion',
                 'flex_planner.planning.feedback.differing_arm',
                 'flex_planner.control.state_feedback', 'flex_planner.control.linear_feedback'),
    'Simulation': ('flex_planner.simulation.comparison', 'flex_planner.simulation.execution',
                   'flex_planner.simulation.mismatch', 'flex_planner.simulation.plant',
                   'flex_planner.control.joint_controller'),
    'Identification': ('flex_planner.identification.identify',
                       'flex_planner.identification.identification',
                       'flex_planner.identification.excitation',
                       'flex_planner.identification.plan_residuals',
                       'flex_planner.identification.experiments',
                       'flex_planner.identification.joint_log',
                       'flex_planner.identification.drive',
                       'flex_planner.identification.fit',
                       'flex_planner.identification.plant_parameters',
                       'flex_planner.logs.csv_log', 'flex_planner.logs.recorded_log',
                       'flex_planner.logs.drive_file',
                       'flex_planner.logs.identified_uncertainty'),
    'Maps': ('flex_planner.maps.study', 'flex_planner.maps.run_map', 'flex_planner.maps.store',
             'flex_planner.maps.draw_map', 'flex_planner.maps.map_starts',
             'flex_planner.maps.cell_results'),
    'Pictures and recordings': ('flex_planner.plotting', 'flex_planner.recording',
                                'flex_planner.reports.arm', 'flex_planner.reports.arm_file',
                                'flex_planner.reports.comparison',
                                'flex_planner.reports.motion', 'flex_planner.reports.recording',
                                'flex_planner.cli.request', 'flex_planner.cli.recorder'),
    'Boundary-value problems': ('flex_planner.collocation',),
    'Errors and progress': ('flex_planner.base.errors', 'flex_planner.base.progress'),
}


def public_names(module: ModuleType) -> list[str]:
    """Return the names that a module offers: its __all__, or the functions and classes in it."""
    listed = getattr(module, '__all__', None)
    names = listed if listed is not None else [
        name for name, value in vars(module).items()
        if (inspect.isclass(value) or inspect.isfunction(value))
        and value.__module__ == module.__name__ and not name.startswith('_')]
    return [name for name in names if callable(getattr(module, name))]


def python_page() -> str:
    """Return the page: a summary for each module, from which Sphinx makes a page per name."""
    lines, shown = [_HEAD], set[int]()
    for section, modules in SECTIONS.items():
        lines += [f'## {section}', '']
        for name in modules:
            module = import_module(name)
            entries = [entry for entry in public_names(module)
                       if id(getattr(module, entry)) not in shown]
            shown |= {id(getattr(module, entry)) for entry in entries}
            lines += [*_summary(name, module, entries)] if entries else []
    return '\n'.join(lines)


def _summary(name: str, module: ModuleType, entries: list[str]) -> list[str]:
    """Return the lines of a module."""
    purpose = (inspect.getdoc(module) or '').strip().splitlines()[0]
    return [f'### {name}', '', purpose, '', '```{eval-rst}', f'.. currentmodule:: {name}', '',
            '.. autosummary::', '   :toctree: api', '   :nosignatures:', '',
            *(f'   {entry}' for entry in entries), '```', '']
