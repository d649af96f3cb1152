# SPDX-License-Identifier: Apache-2.0
"""Newton's step for several fingers and an object, by elimination of one finger after the other.

The matrix is block diagonal but for the object's border of six. With the active constraints'
augmentation (`ccr_ros.model.sqp`) in it, D_f a finger's block, B_f its border, E_f that of the
object (B_f' where nothing slips, see `surface`), Q the object's block, and for all constraints of a
finger the rows R_f, C_f in its coordinates and in q, of how they change, and the rows F_f, G_f of
how their forces act (the same where nothing slips),

    S = Q - sum E_f D_f^-1 B_f,     P_f = C_f - R_f D_f^-1 B_f,     O_f' = G_f' - E_f D_f^-1 F_f'
    W = blockdiag(R_f D_f^-1 F_f') + P S^-1 O'

maps the constraints' forces to their changes. A point that sticks has two rows more, its ways along
the surface, which must vanish. Of one that slips, the normal's force acts along normal + mu times
the direction of slip; across that direction it has one row more, with a compliance: the way's
direction turns as the force does (the linearised projection of `friction`).

Rows that fingers share (`shared`) have parts R_f in several fingers: their entries of W are the
sums of what the fingers give, and so are their P and O.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model.qp import solve_multipliers
from ccr_ros.model.sqp import Bounds

from .assembly import GraspPoint, Hand
from .elimination import System, Task, eliminated, made_definite, upright
from .shared import shared_rows
from .surface import surface_of

# Weights of the augmentation (as in ccr_ros.model.sqp), in turn until the matrix is definite; in
# a grasp it is the others' contacts that make a finger stable, which may take more than 10. A
# constraint that lets go is held back by its weight, so the first is low where some may.
_AUGMENT = (10.0, 1e3, 1e5)
_AUGMENT_HELD = (1e3, 1e5)
_ROUNDING = 1e-12  # units of length
_YIELD = 1e-8  # relative compliance of points that stick, from force to force: twins share a load


@dataclass(frozen=True, eq=False)
class Step:
    """A step and the multipliers after it.

    Attributes:
        fingers: Per finger (N,).
        body: (6,) of q.
        multipliers: Per finger (C + c,), in the finger's own units.
        friction: Per finger (g, 2), of its `FrictionRows`, in the finger's own units.
        disks: (k,) forces of the pairs of disks that are near each other, in the hand's units.
    """

    fingers: list[np.ndarray]
    body: np.ndarray
    multipliers: list[np.ndarray]
    friction: list[np.ndarray]
    disks: np.ndarray


def newton_step(
    hand: Hand,
    at: GraspPoint,
    bounds: Sequence[Bounds],
    free: bool = True,
    support: float = 0.0,
) -> Step | None:
    """Return the step from a point, or None where the quadratic problem has no solution.

    Args:
        hand: The fingers.
        at: Where.
        bounds: Per finger.
        free: Whether the object moves; else its support holds it where it is.
        support: Stiffness of a support that gives way, in units; its force is in the load.
    """
    sizes = [len(part.unbalanced) for part in at.blocks]
    touching = (
        np.empty(0, dtype=int) if at.near_disks is None else np.flatnonzero(at.near_disks.active)
    )
    task = Task(
        hand, at, free, support,
        [part.point.slacks(bound) for part, bound in zip(at.blocks, bounds, strict=True)],
        [surface_of(part) for part in at.blocks],
        shared_rows(at.near_disks, sizes, touching),
    )  # fmt: skip
    # Mostly the constraints that carry force go on doing so, and no others come to.
    pressed = [np.flatnonzero(part.point.active) for part in at.blocks]
    guess = _attempt(task, pressed, _held)
    if guess is not None and _keeps_off(task, guess):
        return guess
    every = [np.arange(len(part.point.rows)) for part in at.blocks]
    if at.near_disks is None or not len(at.near_disks):
        return _attempt(task, every, None)
    near = np.arange(len(at.near_disks))
    found = _attempt(replace(task, shared=shared_rows(at.near_disks, sizes, near)), every, None)
    if found is None and len(touching):
        convex = shared_rows(at.near_disks, sizes, near, convex=True)
        found = _attempt(replace(task, shared=convex), every, None)
    return found


Solve = Callable[..., np.ndarray | None]


def _attempt(task: Task, chosen: list[np.ndarray], solve: Solve | None) -> Step | None:
    """The step with some of each finger's lengths and normals; their forces by ``solve``."""
    for weight in _AUGMENT if solve is None else _AUGMENT_HELD:
        checked = made_definite if weight == _AUGMENT[-1] else upright
        system = eliminated(task, chosen, weight, checked)
        if system is not None:
            return _solved(task, chosen, system, solve or solve_multipliers)
    return None


def _keeps_off(task: Task, step: Step) -> bool:
    """Whether a step violates none of the constraints that carry no force."""
    for part, slack, way, pushed in zip(
        task.at.blocks, task.slacks, step.fingers, step.multipliers, strict=True
    ):
        room = slack - part.point.rows @ way - part.columns @ step.body
        if float(np.where(pushed > 0, 0.0, room).min()) < -_ROUNDING:
            return False
    near_disks = task.at.near_disks
    if near_disks is None or not len(near_disks):
        return True
    closing = sum(rows @ way for rows, way in zip(near_disks.rows, step.fingers, strict=True))
    room = np.where(step.disks > 0, 0.0, near_disks.near.gaps - closing)
    return float(room.min()) >= -_ROUNDING


def _held(
    s: np.ndarray, t: np.ndarray, active: np.ndarray, symmetric: bool = True
) -> np.ndarray | None:
    """The forces with which all constraints are kept; None where one would pull."""
    if not len(t):
        return t
    try:
        forces = np.linalg.solve(s, -t)
    except np.linalg.LinAlgError:
        return None
    return forces if forces.min() >= 0 else None


def _solved(task: Task, chosen: list[np.ndarray], system: System, solve: Solve) -> Step | None:
    """The step and the constraints' forces."""
    order = [i for stack in system.stacks for i in stack.members]
    shared = task.shared
    counts = [len(chosen[i]) + len(task.surfaces[i].ways) + len(shared) for i in order]
    ends = np.cumsum([0, *counts])
    total = int(ends[-1])
    residual = np.concatenate([stack.residual() for stack in system.stacks])
    gram, first = np.zeros((total, total)), 0
    for stack in system.stacks:
        own = slice(first, first + len(stack.real))
        gram[own, own] = stack.gram()
        first += len(stack.real)
    body_step = np.zeros(6)
    if task.free:
        pairs = [stack.reach() for stack in system.stacks]
        reach = np.concatenate([out for out, _ in pairs])
        back = np.concatenate([into for _, into in pairs])
        by_slope = system.inverse @ system.right
        gram += reach @ system.inverse @ back.T
        residual = residual + reach @ by_slope
    sums = None
    if len(shared):
        sums = _sums(counts, len(shared))
        gram, residual = sums @ gram @ sums.T, sums @ residual
        residual[-len(shared) :] += shared.values
    found = _forces(task, chosen, order, gram, residual, solve)
    if found is None or not np.isfinite(found).all():
        return None
    disks = np.zeros(0 if task.at.near_disks is None else len(task.at.near_disks))
    if sums is not None:
        disks[shared.gaps] = found[len(found) - len(shared) :][: len(shared.gaps)]
        found = found @ sums
    if task.free:
        body_step = -(by_slope + system.inverse @ (back.T @ found))
    steps: list[np.ndarray] = [body_step] * len(order)
    first = 0
    for stack in system.stacks:
        pushed = found[first : first + len(stack.real)]
        first += len(stack.real)
        for i, step in zip(stack.members, stack.steps(pushed, body_step), strict=True):
            steps[i] = step
    if not all(np.isfinite(step).all() for step in [*steps, body_step]):
        return None
    multipliers, friction = [np.empty(0)] * len(order), [np.empty(0)] * len(order)
    for i, begin, end in zip(order, ends, ends[1:], strict=False):
        part, surface, index = task.at.blocks[i], task.surfaces[i], chosen[i]
        own_forces = found[begin:end] / task.hand.weights[i]
        normal = np.zeros(len(part.point.rows))
        normal[index] = own_forces[: len(index)]
        multipliers[i] = normal
        along = own_forces[len(index) : len(index) + len(surface.ways)]
        across = np.einsum("s,sgi->gi", along, surface.axes)
        friction[i] = across + normal[part.friction.index, None] * surface.drag
    return Step(steps, body_step, multipliers, friction, disks)


def _sums(counts: Sequence[int], shared: int) -> np.ndarray:
    """(r, m) 0 and 1: which of all fingers' m rows, shared ones last of each, are the same row."""
    own = sum(counts) - shared * len(counts)
    sums, first, row = np.zeros((own + shared, sum(counts))), 0, 0
    for count in counts:
        alone = np.arange(count - shared)
        sums[row + alone, first + alone] = 1.0
        sums[own:, first + count - shared : first + count] = np.eye(shared)
        first, row = first + count, row + len(alone)
    return sums


def _forces(
    task: Task,
    chosen: list[np.ndarray],
    order: list[int],
    gram: np.ndarray,
    residual: np.ndarray,
    solve: Solve,
) -> np.ndarray | None:
    """Forces of rows: those along the surface by elimination, the others by complementarity."""
    surfaces, shared = [task.surfaces[i] for i in order], task.shared
    active = np.concatenate(
        [*(task.at.blocks[i].point.active[chosen[i]] for i in order), shared.active[~shared.along]]
    )
    if not any(len(s.ways) for s in surfaces) and not shared.along.any():
        return solve(0.5 * (gram + gram.T), residual, active)
    # Which rows are inequalities (lengths, normals), which are ways along the surface.
    along = np.concatenate(
        [
            *(
                np.repeat([False, True], [len(chosen[i]), len(s.ways)])
                for i, s in zip(order, surfaces, strict=True)
            ),
            shared.along,
        ]
    )
    bound, way = np.flatnonzero(~along), np.flatnonzero(along)
    inner = gram[way[:, None], way]
    weights = np.repeat(task.hand.weights[order], [len(s.ways) for s in surfaces])
    joins = np.zeros(int(shared.along.sum()))
    sticks = np.concatenate([*(s.sticks for s in surfaces), joins > 0])
    yields = np.concatenate([s.yields for s in surfaces]) / weights
    yields = np.concatenate([yields, shared.yields[shared.along]])
    kept = np.concatenate([np.concatenate([s.forces for s in surfaces]) * weights, joins])
    soft = np.where(sticks, _YIELD * np.maximum(np.diag(inner), 1e-12), yields)
    inner = inner + np.diag(soft)
    # residual + W m + soft (m - kept) = 0 for rows that stick; kept does not count in slip
    rest = residual[way] - np.where(sticks, soft * kept, 0.0)
    try:
        solved = np.linalg.solve(inner, np.column_stack([rest, gram[way[:, None], bound]]))
    except np.linalg.LinAlgError:
        return None
    across = gram[bound[:, None], way]
    left = gram[bound[:, None], bound] - across @ solved[:, 1:]
    value = residual[bound] - across @ solved[:, 0]
    symmetric = all(s.sticks.all() for s in surfaces)
    pushing = solve(left, value, active, symmetric)
    if pushing is None:
        return None
    found = np.zeros(len(residual))
    found[bound] = pushing
    found[way] = -(solved[:, 0] + solved[:, 1:] @ pushing)
    return found
