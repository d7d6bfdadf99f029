"""
Plans whose residual vibration forgives errors of stiffness and payload.

`objective` says what is asked and what was found, `differing_arms` which other arms are looked
at, `arrivals` what vibration they arrive with under the joint controller, `responses` how a
change of the torque moves that, `offset_step` makes an offset of the effort of it, and
`make_robust` raises its weight until the vibration is small enough. `effort_front` shows what that
costs.

"""
