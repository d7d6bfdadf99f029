"""
The joint controller that carries out a trajectory: what it makes of points, and of the arm.

`joint_controller` says what is known of it, `joint_reference` how it interpolates, and
`controlled_motion` takes an arm through time under it, in compiled code.

"""
