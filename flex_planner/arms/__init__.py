"""
An arm as data: links, joints, motors, nodes, and its files.

Also what follows from geometry alone: mode shapes of single links, and kinematics.

"""
