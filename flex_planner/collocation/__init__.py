"""
Gauss collocation for two-point boundary-value problems z' = F(t, z).

Knows a right-hand side, boundary rows and a mesh, and nothing of arms.

"""

from flex_planner.collocation.gauss import GaussRule
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.solution import CollocationSolution
from flex_planner.collocation.solver import CollocationResult, solve, SolverSettings, SolverStatus

__all__ = ['BoundaryValueProblem', 'CollocationResult', 'CollocationSolution', 'GaussRule',
           'SolverSettings', 'SolverStatus', 'solve']
