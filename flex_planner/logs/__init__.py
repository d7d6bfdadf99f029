"""
Logs of motions from files: tables as CSV, and recordings of ROS 2; files that describe a drive.

They become what `flex_planner.identification` takes.

"""
