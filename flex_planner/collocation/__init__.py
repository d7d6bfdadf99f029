"""
Gauss collocation for two-point boundary-value problems z' = F(t, z).

Knows a right-hand side, boundary rows and a mesh, and nothing of arms.

"""

from flex_planner.collocation.gauss import differentiation_matrix, GaussRule
from flex_planner.collocation.homotopy import follow_homotopy
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.restart import KnownSolution
from flex_planner.collocation.result import (
    CollocationResult,
    INTERRUPTED,
    SolverSettings,
    SolverStatus,
)
from flex_planner.collocation.solution import CollocationSolution
from flex_planner.collocation.solve import solve
from flex_planner.collocation.solver import Backend, Solver

__all__ = ['INTERRUPTED', 'Backend', 'BoundaryValueProblem', 'CollocationResult',
           'CollocationSolution', 'GaussRule', 'KnownSolution', 'Solver', 'SolverSettings',
           'SolverStatus', 'differentiation_matrix', 'follow_homotopy', 'solve']
