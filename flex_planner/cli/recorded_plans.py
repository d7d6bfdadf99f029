"""Commands that take a recorded plan where others take a motion that is planned."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from flex_planner.base.errors import InvalidValueError, RecordingError
from flex_planner.cli.controller_options import given_controller, given_uncertainty
from flex_planner.cli.options import path_argument
from flex_planner.cli.request import add_task, translate_errors
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.feedback.carried_motion import CarriedMotion
from flex_planner.planning.uncertainty import ASSUMED, Uncertainty
from flex_planner.recording import shown_path
from flex_planner.reports.motion import Row
from flex_planner.reports.recording import RecordedRequest
from flex_planner.reports.recording.execution import carried_motion, recorded_robustness

TIME_LIMIT = 3600.0  # [s]


def names_recording(options: argparse.Namespace) -> bool:
    """Return whether what is given as the arm is a recording, a folder or a .mcap file."""
    path = Path(str(options.arm))
    return path.is_dir() or path.suffix == '.mcap'


class RecordedPlan:
    """
    The plan of a recording, and what else a command line says.

    Parameters
    ----------
    options : argparse.Namespace
        With those of `add_task`, of the controller, and of errors of the model.

    Raises
    ------
    FlexPlannerError
        If it is no recording of a plan, or an option of the motion is given, too.

    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        with translate_errors():
            _refuse_motion(options)
        self.request = RecordedRequest.read(path_argument(options.arm))
        if self.request.motion is None:
            raise RecordingError(f'{shown_path(self.request.path)} has no plan: '
                                 f'{self.request.report.error_msg or "the request failed"}')

    @property
    def uncertainty(self) -> Uncertainty:
        """Return the errors of the model: as given, else as recorded, else a tenth."""
        known, recorded = ASSUMED, recorded_robustness(self.request)
        if recorded is not None:
            known = Uncertainty(stiffness=recorded.stiffness_difference,
                                payload=recorded.payload_difference, source='as recorded')
        with translate_errors():
            return given_uncertainty(self._options, known)

    def carried(self, model: ArmModel) -> CarriedMotion:
        """Return the recorded trajectory under its controller, or the one that is given."""
        motion = carried_motion(self.request, model)
        controller = given_controller(self._options, self.request.arm, motion.controller)
        return replace(motion, execution=replace(motion.execution, controller=controller))

    @property
    def rows(self) -> list[Row]:
        """Return arm and recording as lines of text."""
        return [('arm', self.request.arm.name), ('recording', shown_path(self.request.path))]


def _refuse_motion(options: argparse.Namespace) -> None:
    """Raise InvalidValueError if an option of the motion is given, also with its default."""
    parser = argparse.ArgumentParser()
    add_task(parser, payload='', recorded=True)
    names = [*vars(parser.parse_args(['recording'])), 'controller_period', 'start_hold']
    for name in names:
        if name in options.given and name != 'time_limit':
            raise InvalidValueError('--limit' if name == 'limits' else name,
                                    getattr(options, name),
                                    'left out: the recording has the motion')
