"""
A simulator of arms under their joint controllers that shares no code with the planner.

It knows the fields of an `Arm` and the points of a `trajectory_msgs/JointTrajectory`; all else is
derived here once more. `python -m bench.independent` compares it with what reports certify.

"""
