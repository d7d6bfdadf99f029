"""Console script ``flex-planner``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

from flex_planner import __version__
from flex_planner.arm import Arm
from flex_planner.arm_files import load_arm, preset_files
from flex_planner.arm_report import describe_arm, standard_postures
from flex_planner.errors import FlexPlannerError
from flex_planner.model import ArmModel
from flex_planner.validation import Array, number, vector
import numpy as np


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run the console script.

    Returns
    -------
    int
        Exit code: 0, or 1 after a message on standard error.

    """
    options = _parser().parse_args(arguments)
    try:
        print(options.run(options))
    except (FlexPlannerError, OSError) as error:
        print(f'flex-planner: {error}', file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    """Return the description of the command line."""
    parser = argparse.ArgumentParser(
        prog='flex-planner', description='Motion planning for flexible-link manipulators.')
    parser.add_argument('--version', action='version', version=__version__)
    commands = parser.add_subparsers(required=True, metavar='COMMAND')
    arm = commands.add_parser('arm', help='print the properties of an arm, draw its mode shapes')
    arm.add_argument('arm', metavar='FILE',
                     help=f'arm file, or a preset: {", ".join(sorted(preset_files()))}')
    arm.add_argument('--payload', type=float, default=0.0, metavar='KG',
                     help='mass at the tip (default: 0)')
    arm.add_argument('--posture', action='append', metavar='DEG,DEG,...',
                     help='joint angles for frequencies and deflections; may be repeated '
                     '(default: stretched, and bent by 90 degrees)')
    arm.add_argument('--plot', type=Path, metavar='PNG',
                     help='picture of the mode shapes (default: <arm>_modes.png)')
    arm.add_argument('--no-plot', action='store_true', help='draw nothing')
    arm.set_defaults(run=_arm)
    return parser


def _arm(options: argparse.Namespace) -> str:
    """Print an arm's properties and draw its mode shapes."""
    arm = load_arm(options.arm)
    payload = number('--payload', options.payload, at_least=0, unit='kg')
    postures = ([_posture(arm, text) for text in options.posture] if options.posture
                else standard_postures(arm))
    model = ArmModel(arm)
    text = describe_arm(model, postures, payload)
    if options.no_plot or not arm.n_modes:
        return text
    from flex_planner.plotting import draw_mode_shapes

    path = options.plot or Path(f'{Path(options.arm).stem}_modes.png')
    draw_mode_shapes(path, model, postures[-1], payload)
    return f'{text}\n\nmode shapes: {path}'


def _posture(arm: Arm, text: str) -> Array:
    """Return joint angles [rad] from comma-separated degrees."""
    try:
        degrees = [float(part) for part in text.split(',')]
    except ValueError:
        degrees = []
    return np.radians(vector('--posture', degrees, arm.n_joints, unit='deg'))


if __name__ == '__main__':
    sys.exit(main())
