"""
Parameters of an arm and its drive from recorded motions.

`identify` fits a model of the arm to logs of joint angles; see `flex_planner.identification.fit`
for the three ways to do so. Reading logs is in `flex_planner.logs`.

"""
