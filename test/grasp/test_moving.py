# SPDX-License-Identifier: Apache-2.0
"""What is held is moved, on simulated fingers: how it goes, how it ends, and what is refused."""

import math

import numpy as np
import pytest
from plant import NAMES, Plant

from ccr_ros.grasp.machine import State
from ccr_ros.grasp.move_path import MovePath
from ccr_ros.grasp.runs import End, Refused
from ccr_ros.grasp.settings import GraspSettings
from ccr_ros.model import CcrError, InvalidValue

X = 3e-4  # m


@pytest.fixture
def plant():
    return Plant().holding()


def going(plant, x=X, **values):
    """Begin a motion and let it come to its second half."""
    run = plant.move(x, **values)
    plant.until(lambda: run.motion is not None and run.motion.fraction > 0.5)
    assert plant.gripper.state is State.MOVING and plant.gripper.phase == "go"
    return run


def keeps(plant, seconds=3.0):
    """Tell whether nothing is let go of: the forces stay."""
    before = plant.forces()
    plant.run(seconds)
    return np.allclose(plant.forces(), before, atol=0.03) and min(before) > 0.1


def test_it_goes_where_it_was_asked_to(plant):
    run = plant.move(X)
    assert plant.gripper.state is State.MOVING and plant.gripper.phase == "plan"
    before = [finger.place for finger in plant.control.values()]
    plant.until(lambda: plant.gripper.phase == "go" or run.outcome)
    assert [finger.place for finger in plant.control.values()] == before  # it stood until then
    outcome = plant.finish(run)
    assert (outcome.end, outcome.reached, outcome.limiting) == (End.DONE, True, "")
    assert run.motion.shift == pytest.approx([X, 0.0, 0.0], abs=3e-5)
    assert run.motion.fraction == 1.0
    assert plant.gripper.state is State.HOLDING and plant.gripper.object_held
    assert keeps(plant)
    assert plant.x == pytest.approx(X, abs=3e-5)
    assert plant.finish(plant.release()).reached


@pytest.mark.parametrize("values, seconds", [({"duration": 2.0}, 2.0), ({"speed": 1e-4}, 3.0)])
def test_it_takes_as_long_as_was_said(plant, values, seconds):
    run = plant.move(X, **values)
    plant.until(lambda: plant.gripper.phase == "go")
    began = plant.now
    plant.until(lambda: run.motion.fraction == 1.0)
    assert plant.now - began == pytest.approx(seconds, abs=0.1)


def test_commands_never_run_away_from_the_pose(plant):
    plant.solve_every = 10  # steps; a slow solver
    run = plant.move(X, speed=0.05)
    plant.until(lambda: plant.gripper.phase == "go" or run.outcome)
    while run.outcome is None:
        plant.advance()
        for finger in plant.control.values():
            ahead = abs(finger.place - finger.solved_place)
            # A step of the command beyond what it may be ahead by.
            assert ahead <= plant.settings.move_lead + 0.05 * plant.seconds + 1e-5
    assert run.outcome.reached


def test_a_plan_that_does_not_reach(plant):
    short = plant.plan

    def planned(run):
        path = short(run)
        return MovePath(path.pulls, False, 0.4, "friction at disk 9 of finger_1: it would slip")

    plant.planner = planned
    at = dict(plant.at)
    outcome = plant.finish(plant.move(X))
    assert outcome.end is End.FAILED and not outcome.reached
    assert outcome.limiting == "friction at disk 9 of finger_1: it would slip"
    assert "40 % of the way" in outcome.message
    assert plant.gripper.state is State.HOLDING
    assert all(abs(plant.at[name] - at[name]) < 2e-5 for name in NAMES)
    run = plant.move(X, partial=True)
    outcome = plant.finish(run)
    assert (outcome.end, outcome.reached) == (End.DONE, False)
    assert outcome.limiting.startswith("friction at disk 9") and run.motion.fraction == 1.0
    assert plant.x == pytest.approx(X, abs=3e-5)


def offset(plan, by):
    def planned(run):
        path = plan(run)
        return MovePath({name: rows + by for name, rows in path.pulls.items()})

    return planned


def refused(text):
    return lambda run: CcrError(text)


def too_far(plant):
    return lambda run: MovePath({n: np.array([[plant.at[n]], [0.0065]]) for n in NAMES})


PLANS = {
    "another plan is being made": lambda plant: refused("another plan is being made"),
    "is not allowed; must be between": too_far,
    "the fingers moved while the plan was made": lambda plant: offset(plant.plan, -6e-4),
}


@pytest.mark.parametrize("reason", PLANS)
def test_plans_that_are_not_followed(plant, reason):
    plant.planner = PLANS[reason](plant)
    places = [finger.place for finger in plant.control.values()]
    outcome = plant.finish(plant.move(X))
    assert outcome.end is End.FAILED and reason in outcome.message and outcome.limiting
    assert plant.gripper.state is State.HOLDING
    assert np.allclose([f.place for f in plant.control.values()], places, atol=2e-5)
    assert keeps(plant)


def test_no_plan_comes():
    plant = Plant(GraspSettings(plan_timeout=2.0)).holding()
    plant.planner = None
    outcome = plant.finish(plant.move(X))
    assert outcome.limiting == "no plan within 2 s" and plant.gripper.state is State.HOLDING


def test_a_plan_that_comes_too_late_is_for_nothing(plant):
    plant.planner = None
    run = plant.move(X)
    plant.until(lambda: plant.gripper.plan_wanted is run)
    plant.gripper.cancel(run)
    assert plant.gripper.plan_wanted is None
    plant.gripper.take_plan(run, CcrError("late"))
    assert plant.gripper.state is State.HOLDING and run.outcome.end is End.CANCELED


HALTS = {
    "margin": (lambda p: setattr(p, "margin", 0.01), State.HOLDING, "friction margin: 0.010"),
    "stuck": (lambda p: p.stuck.add("finger_1"), State.HOLDING, "finger_1 does not follow"),
    "dropped": (lambda p: setattr(p, "held", False), State.FAULT, "do not carry 'ball'"),
    "stale": (lambda p: setattr(p, "lost_pose", True), State.FAULT, "pose of 'ball' is stale"),
    "untold": (lambda p: setattr(p, "told", False), State.FAULT, "nothing heard of 'ball'"),
    "solver": (lambda p: setattr(p, "solver_silent", True), State.FAULT, "solver: no state"),
    "finger stale": (lambda p: p.stale.update(NAMES), State.FAULT, "pose of finger_1 is stale"),
    "bridge": (lambda p: setattr(p, "bridge_silent", True), State.FAULT, "servo bridge: no"),
    "another": (lambda p: setattr(p, "thing", "cube"), State.FAULT, "lost the object"),
    "nothing": (lambda p: setattr(p, "thing", ""), State.FAULT, "knows of no object"),
}


@pytest.mark.parametrize("what", HALTS)
def test_what_ends_a_motion_leaves_it_where_it_is(plant, what):
    plant.gripper.grip.thing = "ball"
    happen, state, text = HALTS[what]
    run = going(plant, -2 * X, speed=1e-4)
    happen(plant)
    begin = run.motion.fraction
    outcome = plant.finish(run)
    assert outcome.end is End.FAILED and text in outcome.message, outcome.message
    assert outcome.limiting
    assert plant.gripper.state is state
    assert run.motion is None or begin <= run.motion.fraction < 0.95
    floors = dict(plant.gripper.grip.floors)
    places = {n: f.place for n, f in plant.control.items()}
    plant.run(1.0)
    assert plant.gripper.grip.floors == floors
    for name, finger in plant.control.items():
        assert finger.place >= floors[name]
        if state is State.FAULT:
            assert finger.place == pytest.approx(places[name], abs=1e-4)


CALLS = {
    "cancel": (lambda p, run: p.gripper.cancel(run), State.HOLDING, End.CANCELED),
    "stop": (lambda p, run: p.gripper.stop(), State.STOPPED, End.FAILED),
    "hold": (lambda p, run: p.gripper.hold(p.now), State.HOLDING, End.FAILED),
    "another": (lambda p, run: p.move(-X), State.MOVING, End.FAILED),
}


@pytest.mark.parametrize("what", CALLS)
def test_calls_while_it_moves(plant, what):
    call, state, end = CALLS[what]
    run = going(plant, speed=1e-4)
    call(plant, run)
    assert plant.gripper.state is state and run.outcome.end is end
    if state is not State.MOVING:
        x = plant.x
        assert keeps(plant)
        assert plant.x == pytest.approx(x, abs=5e-5)
        assert plant.gripper.object_held
    else:
        plant.until(lambda: plant.gripper.state is State.HOLDING)
        assert plant.x < X / 2 + 1e-4  # back from where the first one had come to


def test_a_release_ends_it(plant):
    run = going(plant, speed=1e-4)
    assert plant.finish(plant.release()).reached
    assert run.outcome.limiting == "a release came" and plant.gripper.state is State.READY


def test_a_grasp_waits_until_it_is_over(plant):
    going(plant, speed=1e-4)
    with pytest.raises(Refused, match="the gripper is moving"):
        plant.grasp(force=0.2)


def ready(plant):
    plant.finish(plant.release())


def due(plant):
    plant.release(delay=60.0)


def other(plant):
    plant.gripper.grip.thing, plant.thing = "ball", "cube"
    plant.run(0.1)


NOT_NOW = {
    "the gripper is ready": ready,
    "a release is due": due,
    "friction margin: 0.010": lambda plant: (setattr(plant, "margin", 0.01), plant.run(0.1)),
    "do not carry": lambda plant: (setattr(plant, "held", False), plant.run(0.1)),
    "is stale since": lambda plant: (setattr(plant, "lost_pose", True), plant.run(1.0)),
    "the solver tells of 'cube'": other,
    "nothing is gripped: finger_1": lambda plant: (plant.limp.add("finger_1"), plant.run(0.2)),
}


@pytest.mark.parametrize("reason", NOT_NOW)
def test_not_now(plant, reason):
    NOT_NOW[reason](plant)
    state = plant.gripper.state
    with pytest.raises(Refused, match=reason):
        plant.move(X)
    assert plant.gripper.state is state and reason in plant.gripper.refusal


def test_nobody_tells_of_an_object():
    plant = Plant()
    plant.told = False
    with pytest.raises(Refused, match="knows of no object"):
        plant.holding().move(X)


BAD = {
    "target": {"x": 0.0},
    r"shift\[0\]": {"x": math.nan},
    r"turn\[2\]": {"turn": (0.0, 0.0, math.inf)},
    "turn": {"turn": (3.0, 3.0, 0.0)},
    "margin": {"margin": 1.0},
    "duration": {"duration": -1.0},
    "speed": {"speed": math.nan},
    "0 where a duration is given": {"speed": 0.001, "duration": 1.0},
}


@pytest.mark.parametrize("reason", BAD)
def test_bad_goals(plant, reason):
    with pytest.raises(InvalidValue, match=reason):
        plant.move(**{"x": X, **BAD[reason]})
    assert plant.gripper.state is State.HOLDING


def test_bad_paths():
    with pytest.raises(InvalidValue, match=r"waypoints\.a"):
        MovePath({"a": np.array([[0.0], [math.nan]])})
    with pytest.raises(InvalidValue, match="as many for each finger"):
        MovePath({"a": np.zeros((2, 1)), "b": np.zeros((3, 1))})
    with pytest.raises(InvalidValue, match="at least one"):
        MovePath({})
    path = MovePath({"a": np.array([[0.0, 0.0], [1e-3, 0.0], [1e-3, -3e-3]])})
    assert path.length == pytest.approx(4e-3)
    assert path.at(2e-3)["a"] == pytest.approx([1e-3, -1e-3])
    path.check_within({"a": np.array([[0.0, 1e-3], [-3e-3, 0.0]])})
    with pytest.raises(InvalidValue, match=r"waypoints\[2\]\.a"):
        path.check_within({"a": np.array([[0.0, 1e-3], [-2e-3, 0.0]])})
