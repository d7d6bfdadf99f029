"""The page of measured figures, docs/benchmarks.md."""

from __future__ import annotations

from datetime import date
from typing import Any

from bench import (
    battery,
    earlier,
    growth,
    limits_battery,
    model,
    payload,
    replanning,
    robust,
    soak,
    solver,
    spatial,
)
import numpy as np

INTRODUCTION = """# Benchmarks

Written by `make bench`, {date}: one run on one machine, medians. Times are per point, for {points}
points at a time. They say how things compare; on another machine they differ.

{versions}

## The model

Paper-like arms of equal links (length 0.5 m, 6 kg/m, EI = 50 N m²) with the same number of
pinned-pinned modes on each. *z'* is the right-hand side of the optimality conditions, *dz'/dz* its
full Jacobian. *First build* is a fresh process with an empty cache, *later start* a fresh process
that finds the compiled functions. *CasADi VM* evaluates the same functions (z' with dz'/dz) by
CasADi's virtual machine. *SymPy* is the same z' as one would first write it: energies with
quadrature inside, differentiated by SymPy, lambdified with common subexpressions; its derivation
takes minutes from 2 links with 2 modes on, and was not run there.

{table}
"""


SOLVER = """
## The solver

The paper's arm with two modes per link (24 unknowns), its motion of section 5.2, without (1 kg)
and with (5.5 kg) saturated motors. Every method runs at the coarsest level that reaches the
accuracy; the errors are relative, of J and of the worst initial costate. solve_bvp has the same
compiled functions and Jacobian, IPOPT the same dynamics with exact derivatives; the time to
derive its programme (0.1 to 0.7 s) is not counted. *Cold* is a straight line, *warm* the solution
with 0.5 % other payload. `nan`: not run warm, because it took too long.

{table}

A whole plan at default settings, certificate included: {cold_1:.0f} ms cold and {warm_1:.0f} ms
warm at 1 kg, {cold_2:.0f} and {warm_2:.0f} ms at 5.5 kg.

### Where the time goes

Each part once, on the final mesh of the plan at 1 kg. A plan takes about two of each on a mesh of
half the size, then one of each with three corrections.

{shares}

All of it is compiled, and works interval by interval within the cache; the simulation of the
certificate and the estimate of the error, which solves with a rule of one stage more, take the
most.

### Growth

Equal links of 50 N m² whose joints each turn by 0.6 rad in 2 s, motors without limits. The highest
natural frequency sets the mesh, and it grows with the square of the number of modes; links mostly
make Newton's method work harder. *Not solved* is within {limit:.0f} s. The memory is that of the
whole process, interpreter and libraries (90 MB) included.

{growth}
"""


CLAMPED = """
### Growth with clamped links

The same motion with clamped links, lying and under gravity, of at most 12 coordinates. *Not
solved* is within {limit:.0f} s of CPU time, without helper processes; other work on the machine
makes the time longer. Links have no rotors at their joints: the torque of a motor drives the
bending of its own link alone, and where a price on bending *is left* the plan is that of a task
with such a price, see [links that ring](solver.md#links-that-ring-at-no-cost). Four links with two
modes each are *refused* under gravity: bent so far, they find no equilibrium.

{table}
"""


PAYLOAD = """
## Maximum payload

The motion of section 5.3: {accuracies}. A result counts if the payload is that near to the limit
and its torque, re-simulated by SciPy's DOP853, leads the tip that near to the goal. Times of
flex_planner are of whole searches, certified plan and bound included: of one kind of motion
(`search='fast'`), as by IPOPT from its one start, and of the best of the kinds that are found,
which is the default and shares its work among processes. Those of IPOPT (minimise the cost less
a high price of the payload; the programme of `flex_planner.optimal_control.direct.programme`,
whose derivation is not counted) are of the coarsest of meshes of {meshes} intervals that counts,
found by trying.

{table}

IPOPT gives no bound from above: the bracket of flex_planner says how much more there may be. The
shortest duration with 1 kg takes {durations}.
"""


EARLIER = """
## The model and the lift against those before

The same processor, interpreter and libraries, by turns, CPU time: the earlier version derives its
equations from energies and lifts a rigid motion with straight links; this one takes virtual power,
and bends the links by the forces of the rigid motion. The arms are presets; a *first build* is a
fresh process, imports included, that finds no compiled functions, except for arms that share those
of an arm above. Iterations are those of the strategy *rigid motion first* alone, the rigid motion
included.

{table}
"""


SPEED = """
## The solver against the first one

CPU time of whole calls, certificates included, by turns as above: a commit whose solver was
NumPy's linear algebra, and this one. Both follow the kind of motion of a straight start
(`search='fast'`); the paper's motion, EI 50 with two modes a link where nothing else is said;
payloads to 1e-3 kg.

{table}
"""


BATTERY = """
## Arms that people have

Published arms and one from data sheets (`config/arms/`). T is the shortest time of the same arm
made rigid, P the period of its lowest mode with the joints held; a motion takes max(3 T, 1.5 P)
(moderate), 1.2 T + P/2 (fast), 2 T + P (long, another start and goal) or 2.5 T + P (with a load).
Planned at default settings within {limit:g} s of time, other kinds of motion included; the CPU
time counts helper processes that have ended.

{table}
"""


SPATIAL = """
## Arms in space

Motions from cold with the compiled functions at hand; `python -m bench.spatial` has the arms, the
ends and the weights. CPU time of the quicker one of two runs, and the time that was set as a bar
beforehand where there is one; other work on the machine, as when this was measured (a load of 8 to
12 on two cores), makes it up to twice as long. On the way to *far* goals joints meet their limits.

{table}

Of the bars those of the Panda within its joint limits are missed, 1.8 and 3.1 times. With four
elastic joints half of that time goes into the last meshes, of up to 500 intervals of four points,
with seven a third; the rest goes into the motion without limits and the barrier. By turns in one
run, a straight line first took 1.3 to 2.1 times as long as the motion of the rigid arm first where
nine to fourteen coordinates ring, and the same for the near goal; a first mesh of the barrier that
shows the motion without limits, instead of all that may ring, makes 2.9 of 5.1 s.
"""


LIMITS = """
## Random limits on the way

Random arms of two rigid links, and the paper's arm with one mode per link, a random E I of 20 to
100 N m² and up to 1.5 kg; one or two random limits that the free motion breaks: ranges and speeds
of joints, posts for the tip or for stations of the links, lines, moments and deflections. IPOPT,
with a transcription and a model of its own, starts from the free motion, a straight line and the
plan, on finer meshes where it seems cheaper; it keeps limits at its points only. Tasks that
neither solves are counted in the third column alone. The slack is that on a grid of 4001 points, a
share of the limit's scale. CPU times hold the search for other kinds of motion and the first
compilation of an arm's functions.

{table}
"""


ROBUST = """
## Plans that forgive a wrong model

The motions of [robust_plans.md](robust_plans.md), with and without a limit of residual bending by
turns: whole requests, certificate included, the least of some rounds. The *arms* are those that
are simulated with the last plan.

{table}
"""


SOAK = """
## The node under mixed requests

One planner of the arm with EI 50 N m², recordings on, is asked for everything in turn:

{table}

{summary}
"""


REPLANNING = """
## Planning again over ROS

A motion of {duration:g} s whose goal moves by up to {most:g} m with every request, from a client
in Python that reads a parameter beside each request and asks again once it has the answer, at most
at the rate asked for. CPU time of the node per request, recording included; times to the answers,
of plans and of parameters, in milliseconds. {load}

{table}
"""


def text(figures: dict[str, Any]) -> str:
    """Return the page."""
    rows = [model.Row(**row) for row in figures['model']]
    (cold_1, warm_1), (cold_2, warm_2) = (np.array(pair) * 1e3 for pair in figures['plans'])
    shares = '\n'.join(['| part | ms |', '|---|---|', *(
        f'| {name} | {value:.1f} |' for name, value in figures['shares'].items())])
    used = ', '.join(f'{name} {value}' for name, value in figures['versions'].items())
    return INTRODUCTION.format(
        date=date.today().isoformat(), points=model.POINTS, table=model.table(rows),
        versions=used) + SOLVER.format(
        table=solver.table([solver.Row(**row) for row in figures['solver']]), shares=shares,
        cold_1=cold_1, warm_1=warm_1, cold_2=cold_2, warm_2=warm_2, limit=growth.TIME_LIMIT,
        growth=growth.table([growth.Growth(**row) for row in figures['growth']])) + (
        clamped_text(figures) + payload_text(figures) + earlier_text(figures)
        + battery_text(figures) + limits_text(figures) + robust_text(figures)
        + spatial_text(figures) + soak_text(figures) + replanning_text(figures))


def earlier_text(figures: dict[str, Any]) -> str:
    """Return the parts on earlier versions, once they were measured."""
    parts = [(EARLIER, 'earlier', earlier.tables), (SPEED, 'speed', earlier.speed_table)]
    return ''.join(page.format(table=table(figures[name])) for page, name, table in parts
                   if name in figures)


def battery_text(figures: dict[str, Any]) -> str:
    """Return the part on arms that people have, once it was measured."""
    if 'battery' not in figures:
        return ''
    return BATTERY.format(limit=battery.LIMITS[-1], table=battery.table(figures['battery']))


def spatial_text(figures: dict[str, Any]) -> str:
    """Return the part on arms in space, once it was measured."""
    if 'spatial' not in figures:
        return ''
    return SPATIAL.format(table=spatial.table(figures['spatial']))


def limits_text(figures: dict[str, Any]) -> str:
    """Return the part on random limits on the way, once it was measured."""
    if 'limits' not in figures:
        return ''
    return LIMITS.format(table=limits_battery.table(
        [limits_battery.Row(**row) for row in figures['limits']]))


def robust_text(figures: dict[str, Any]) -> str:
    """Return the part on plans that forgive errors of the model, once it was measured."""
    if 'robust' not in figures:
        return ''
    return ROBUST.format(table=robust.table([robust.Row(**row) for row in figures['robust']]))


def clamped_text(figures: dict[str, Any]) -> str:
    """Return the part on clamped links, once it was measured."""
    if 'clamped' not in figures:
        return ''
    rows = [growth.Growth(**row) for row in figures['clamped']]
    return CLAMPED.format(limit=growth.CLAMPED_LIMIT, table=growth.clamped_table(rows))


def payload_text(figures: dict[str, Any]) -> str:
    """Return the part on the maximum payload, once it was measured."""
    if 'payload' not in figures:
        return ''
    return PAYLOAD.format(
        accuracies=', '.join(f'{accuracy:g} kg with {tip:g} m at the tip'
                             for accuracy, tip in payload.ACCURACIES.items()),
        meshes=', '.join(map(str, payload.INTERVALS)),
        table=payload.table([payload.Row(**row) for row in figures['payload']]),
        durations=', '.join(f'{seconds:.2g} s ({name})'
                            for name, seconds in figures['durations'].items()))


def soak_text(figures: dict[str, Any]) -> str:
    """Return the part on the node, once it was measured."""
    if 'soak' not in figures:
        return ''
    measured = soak.Soak(**figures['soak'])
    return SOAK.format(table=soak.table(measured), summary=soak.summary(measured))


def replanning_text(figures: dict[str, Any]) -> str:
    """Return the part on planning again, once it was measured."""
    if 'replanning' not in figures:
        return ''
    found = figures['replanning']
    runs = found.get('runs', 1)
    load = (f'Load of the machine when it ended: {found["load"]:.1f}.' if runs == 1 else
            f'Means of {runs} runs; load of the machine when they ended, with other work on it: '
            f'{found["load"]:.1f}.')
    return REPLANNING.format(
        duration=replanning.DURATION, most=replanning.MOST, table=replanning.table(found['rows']),
        load=load)
