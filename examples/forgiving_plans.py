"""
Plans that forgive a model that is wrong: less residual vibration for little more effort.

No arm is quite its model. Here the stiffness of the links and the payload may be off by a tenth,
and the planner looks for the motion after which the links still hardly bend, under a joint
controller. Then the whole front: what less and less vibration costs.

    tools/run python examples/forgiving_plans.py

"""

from __future__ import annotations

from pathlib import Path
import sys

from flex_planner import load_arm, Objectives, plan_path, Task
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.planning.robust.effort_front import trace_effort_front
from flex_planner.planning.robust.objective import Robustness
from flex_planner.plotting import draw_effort_front, save

LIMIT = 1.65e-3  # [m]


def main() -> None:
    """Plan without and with forgiveness, then draw the front."""
    arm = load_arm('clamped_motors')
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])
    robustness = Robustness(stiffness_error=0.1, payload_error=0.1, max_residual=LIMIT,
                            controller=JointController(gains=Gains.of(2, 40.0, 4.0)))

    plain = plan_path(task)
    forgiving = plan_path(task, objectives=Objectives(robustness=robustness))
    if not forgiving.solved or forgiving.objectives is None or forgiving.objectives.robust is None:
        sys.exit(forgiving.message)
    search = forgiving.objectives.robust
    print(f'least effort: {search.plain_residual * 1e3:.2f} mm of residual bending, J = '
          f'{plain.cost:.4f}')
    print(f'forgiving:    {search.residual * 1e3:.2f} mm, J = {forgiving.cost:.4f} '
          f'({forgiving.cost / plain.cost - 1:+.2%}), worst of {len(search.errors)} arms')

    # a controller with these gains answers an error of the payload itself: no motion repairs that
    front = trace_effort_front(plain, robustness, [0.1, 0.3, 1, 3, 10])
    for weight, growth, residual in zip(front.weights, front.growth, front.residuals, strict=True):
        print(f'weight {weight:4.1f}: {growth:6.2%} more cost, {residual * 1e3:.2f} mm')
    save(draw_effort_front(front, LIMIT), Path('output') / 'forgiving_plans.png')


if __name__ == '__main__':
    main()
