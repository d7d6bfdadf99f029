"""
A task and its optimality conditions: Pontryagin's equations, both ends, free payload or duration.

Read `task` first, then `motion_problem`, which makes a boundary-value problem of it; the equations
are in `pontryagin`, `running_cost`, `torque_limits` and `boundary_conditions`.

"""
