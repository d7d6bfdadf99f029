"""
An arm's equations of motion as symbols and as compiled functions, its statics, an integrator.

Read `chain` first: it is what is known of an arm above here. `planar_chain` derives one,
`dynamics_functions` makes functions of it, `arm_dynamics` calls them with arrays.

"""
