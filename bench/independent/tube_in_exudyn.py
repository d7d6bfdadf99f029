"""
The path of a bending, turning tube by EXUDYN, as a table for test/dynamics/test_exudyn.py.

    pip install exudyn==1.13.6; python bench/independent/tube_in_exudyn.py > tube.json

EXUDYN (J. Gerstmayr, University of Innsbruck) is a multibody code of its own; its beams here are
geometrically exact, shear-deformable finite elements, so nothing of the assumed modes, of their
integrals or of small slopes enters. A tube stands out at 40 degrees from a vertical axis that a
torque turns; a body is fixed beside its end; it begins straight and at rest, and its weight bends
it from there on. Paths by 8 and 16 elements are extrapolated with the square of their length.

"""

from __future__ import annotations

import json
import math
from typing import Any

import exudyn as exu  # type: ignore[import-not-found]
from exudyn.itemInterface import (  # type: ignore[import-not-found]
    GenericJoint,
    LoadMassProportional,
    LoadTorqueVector,
    MarkerBodyMass,
    MarkerBodyRigid,
    MarkerNodeRigid,
    NodeRigidBodyEP,
    ObjectBeamGeometricallyExact,
    ObjectGround,
    ObjectRigidBody,
    SensorNode,
)
import numpy as np

LENGTH, ANGLE, DURATION = 0.9, math.radians(40), 1.0
OUTER, INNER, MODULUS, DENSITY, POISSON = 0.011, 0.010, 70e9, 2700.0, 0.33
GRAVITY = 9.81
HUB = 0.06  # inertia about the vertical axis [kg m^2]
TIP_MASS, TIP_AT, TIP_INERTIA = 0.4, (0.03, 0.05, 0.02), (6e-4, 8e-4, 5e-4)
TORQUE = 5.0  # [N m], a sine of one period
STEPS = 4000
ROWS = 50


def turned() -> Any:
    """Return the axes of the tube in those of the base: along it, and two across."""
    c, s = math.cos(ANGLE), math.sin(ANGLE)
    return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])


def section() -> Any:
    """Return the tube's section."""
    area, second = math.pi * (OUTER**2 - INNER**2), math.pi / 4 * (OUTER**4 - INNER**4)
    shear = MODULUS / (2 * (1 + POISSON))
    made = exu.BeamSection()
    made.massPerLength = DENSITY * area
    made.inertia = DENSITY * second * np.diag([2.0, 1.0, 1.0])
    made.stiffnessMatrix = np.diag([MODULUS * area, shear * area / 2, shear * area / 2,
                                    2 * shear * second, MODULUS * second, MODULUS * second])
    return made


def simulate(elements: int) -> Any:
    """Return times and the path of the tip, shape (k, 4)."""
    system = exu.SystemContainer()
    mbs, axes = system.AddSystem(), turned()
    w, x, y, z = math.cos(ANGLE / 2), 0.0, -math.sin(ANGLE / 2), 0.0
    nodes = [mbs.AddNode(NodeRigidBodyEP(
        referenceCoordinates=[*(axes[:, 0] * LENGTH * i / elements), w, x, y, z]))
        for i in range(elements + 1)]
    bodies = [mbs.AddObject(ObjectBeamGeometricallyExact(
        nodeNumbers=list(pair), length=LENGTH / elements, sectionData=section()))
        for pair in zip(nodes[:-1], nodes[1:], strict=True)]
    hub = axes.T @ np.diag([HUB, HUB, HUB]) @ axes
    mbs.AddObject(ObjectRigidBody(mass=1.0, inertia=_six(hub), nodeNumber=nodes[0]))
    at = axes.T @ np.array(TIP_AT)
    about = axes.T @ np.diag(TIP_INERTIA) @ axes + TIP_MASS * (
        at @ at * np.eye(3) - np.outer(at, at))
    bodies.append(mbs.AddObject(ObjectRigidBody(
        mass=TIP_MASS, inertia=_six(about), centerOfMass=at,
        nodeNumber=nodes[-1])))
    for body in bodies:
        mbs.AddLoad(LoadMassProportional(markerNumber=mbs.AddMarker(MarkerBodyMass(
            bodyNumber=body)), loadVector=[0, 0, -GRAVITY]))
    ground = mbs.AddMarker(MarkerBodyRigid(bodyNumber=mbs.AddObject(ObjectGround())))
    base = mbs.AddMarker(MarkerNodeRigid(nodeNumber=nodes[0]))
    mbs.AddObject(GenericJoint(markerNumbers=[ground, base], constrainedAxes=[1, 1, 1, 1, 1, 0],
                               rotationMarker1=axes.T))
    mbs.AddLoad(LoadTorqueVector(
        markerNumber=base, loadVectorUserFunction=lambda _mbs, t, _load: [
            0, 0, TORQUE * math.sin(2 * math.pi * t / DURATION)]))
    sensor = mbs.AddSensor(SensorNode(
        nodeNumber=nodes[-1], storeInternal=True,
        outputVariableType=exu.OutputVariableType.Position))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = STEPS
    settings.timeIntegration.endTime = DURATION
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = DURATION / ROWS
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    mbs.SolveDynamic(settings)
    return mbs.GetSensorStoredData(sensor)


def _six(matrix: Any) -> list[float]:
    """Return an inertia as EXUDYN has it: xx, yy, zz, yz, xz, xy."""
    return [matrix[0, 0], matrix[1, 1], matrix[2, 2], matrix[1, 2], matrix[0, 2], matrix[0, 1]]


def main() -> None:
    """Print the table."""
    coarse, fine = simulate(8), simulate(16)
    path = fine[:, 1:] + (fine[:, 1:] - coarse[:, 1:]) / 3
    print(json.dumps({
        'source': f'EXUDYN {exu.__version__}, bench/independent/tube_in_exudyn.py',
        'length': LENGTH, 'angle': ANGLE, 'outer_radius': OUTER, 'inner_radius': INNER,
        'youngs_modulus': MODULUS, 'density': DENSITY, 'poissons_ratio': POISSON,
        'hub_inertia': HUB, 'tip_mass': TIP_MASS, 'tip_at': TIP_AT, 'tip_inertia': TIP_INERTIA,
        'torque': TORQUE, 'duration': DURATION, 'gravity': GRAVITY,
        'largest_change_from_8_to_16_elements': float(
            np.linalg.norm(fine[:, 1:] - coarse[:, 1:], axis=1).max()),
        'times': fine[:, 0].round(9).tolist(), 'tip': path.round(8).tolist()}))


if __name__ == '__main__':
    main()
