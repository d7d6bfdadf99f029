"""
The optimal control problem by direct collocation and IPOPT: a start where others fail, a check.

Read `ipopt` first; `programme` is the nonlinear programme, `mesh` its collocation methods,
`ipopt_crew` runs IPOPT in other processes.

"""
