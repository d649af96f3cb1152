# SPDX-License-Identifier: Apache-2.0
"""Whatever is commanded and whatever happens: what is held is let go of by a release only."""

from contextlib import suppress

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from plant import LENGTH, NAMES, TOUCH, Plant

from ccr_ros.grasp.machine import State
from ccr_ros.grasp.runs import Refused
from ccr_ros.model import CcrError

ONE = st.sampled_from(NAMES)
SHORT = st.sampled_from([0.3, 1.0])  # s
KEEPING = (State.HOLDING, State.MOVING, State.STOPPED, State.FAULT, State.CLOSING)
CHANGES = (-5e-4, -2e-4, 4e-4, 1.0)  # m, of the place of touch


class Person(RuleBasedStateMachine):
    """Commands and mishaps in any order, on simulated fingers.

    Once all fingers hold, no command may be below the place where its finger touched, until a
    release begins. While the object is moved these places go along with the commands, which are
    the plan's and nothing else.
    """

    @initialize(held=st.booleans())
    def begin(self, held):
        self.plant = Plant(step=0.04, **dict.fromkeys(NAMES, TOUCH + 2e-4 if held else 0.0))
        self.gripper = self.plant.gripper
        self.run = self.letting = None
        self.kept = None  # floors of what is held, by finger
        self.moved = None  # those, and the places, when the motion began
        self.planned = {}  # how far back and on the plan goes, by finger
        self.plant.planner = self.plan
        self.wait(0.2)

    def wait(self, seconds):
        end = self.plant.now + seconds
        while self.plant.now < end:
            self.plant.advance()
            self.check()

    def plan(self, run):
        path = self.plant.plan(run)
        self.planned = {
            name: (float(rows.min() - rows[0, 0]), float(rows.max() - rows[0, 0]))
            for name, rows in path.pulls.items()
        }
        return path

    def follow(self, places):
        """The floors go with the object while it is moved."""
        if self.moved is None:
            self.moved = dict(self.kept), dict(places)
            self.planned = {}
        floors, begin = self.moved
        for name, floor in floors.items():
            back, on = self.planned.get(name, (0.0, 0.0))
            assert back - 1e-9 <= places[name] - begin[name] <= on + 1e-9
            gone = min(places[name], self.plant.wanted[name]) - begin[name]
            self.kept[name] = floor + gone

    def check(self):
        state, grip = self.gripper.state, self.gripper.grip
        places = {name: finger.place for name, finger in self.plant.control.items()}
        if state is State.RELEASING:
            self.kept = None
            assert self.letting is not None and self.letting.outcome is None
        elif self.kept is None and state is State.HOLDING:
            self.kept = {
                name: min(self.plant.wanted[name], grip.floors[name]) for name in grip.targets
            }
        if state is State.MOVING:
            self.follow(places)
        else:
            self.moved = None
        if self.kept is not None:
            assert state in KEEPING, state
            for name, floor in self.kept.items():
                assert min(places[name], self.plant.wanted[name]) >= floor - 1e-12
        for name in NAMES:
            assert places[name] <= LENGTH + 1e-12

    @rule(force=st.sampled_from([0.0, 0.05, 0.2, 0.5]), some=st.lists(ONE, unique=True))
    def grasp(self, force, some):
        try:
            self.run = self.plant.grasp(force=force, required=tuple(some), speed=0.005)
        except Refused as refused:
            assert self.gripper.refusal == str(refused)
        self.check()

    @rule(x=st.sampled_from([-3e-4, 1e-4, 3e-4]), planned=st.sampled_from(["", "no", "never"]))
    def move(self, x, planned):
        """Ask for a motion, which is planned, refused, or never answered."""
        answers = {"": self.plan, "no": lambda run: CcrError("no"), "never": None}
        self.plant.planner = answers[planned]
        try:
            self.run = self.plant.move(x)
        except Refused as refused:
            assert self.gripper.refusal == str(refused)
        self.check()

    @rule(margin=st.sampled_from([0.5, 0.0]), held=st.booleans(), lost=st.booleans())
    def object_is_told_of(self, margin, held, lost):
        self.plant.margin, self.plant.held, self.plant.lost_pose = margin, held, lost
        self.wait(0.3)
        self.plant.margin, self.plant.held, self.plant.lost_pose = 0.5, True, False

    @rule(x=st.sampled_from([-3e-4, 3e-4]), how=st.sampled_from(["stop", "hold", "cancel", "wait"]))
    def move_for_a_while(self, x, how):
        """As people do most: what is held is moved, and somebody changes his mind on the way."""
        self.grasp_to_the_end(0.3)
        self.move(x, "")
        self.wait(0.6)
        if how == "wait":
            self.wait(2.0)
        else:
            getattr(self, how)()

    @rule(delay=st.sampled_from([0.0, 0.5, 2.0]), fast=st.booleans())
    def release(self, delay, fast):
        try:
            self.run = self.letting = self.plant.release(delay=delay, fast=fast)
        except Refused as refused:
            assert self.gripper.refusal == str(refused)

    @rule()
    def cancel(self):
        if self.run is not None and self.run.outcome is None:
            self.gripper.cancel(self.run)
        self.check()

    @rule()
    def stop(self):
        self.gripper.stop()
        self.letting = None  # whatever waited is off
        assert self.gripper.state in (State.STOPPED, State.FAULT)
        self.check()

    @rule()
    def hold(self):
        with suppress(Refused):
            self.gripper.hold(self.plant.now)
            self.letting = None
        self.check()

    @rule()
    def reset(self):
        with suppress(Refused):
            self.gripper.reset(self.plant.now)
        self.check()

    @rule(seconds=st.sampled_from([0.2, 2.4]))
    def time_passes(self, seconds):
        self.wait(seconds)

    @rule(names=st.lists(ONE, min_size=1, unique=True), change=st.sampled_from(CHANGES))
    def object_changes(self, names, change):
        for name in names:
            self.plant.touch[name] = TOUCH + change
        self.wait(2.4)

    @rule(what=st.sampled_from(["bridge_silent", "solver_silent"]), seconds=SHORT)
    def silence(self, what, seconds):
        setattr(self.plant, what, True)
        self.wait(seconds)
        setattr(self.plant, what, False)

    @rule(what=st.sampled_from(["stale", "unstable", "stuck", "limp"]), name=ONE, seconds=SHORT)
    def mishap(self, what, name, seconds):
        getattr(self.plant, what).add(name)
        self.wait(seconds)
        getattr(self.plant, what).clear()

    @rule(how=st.sampled_from(["stop", "hold", "cancel"]))
    def a_release_is_put_off(self, how):
        self.release(0.5, True)
        getattr(self, how)()
        self.wait(1.0)

    @rule()
    def grasp_at_nothing(self):
        """What was held is no more there, it seems: fingers that held must not open for that."""
        self.stop()
        self.reset()
        self.plant.touch = dict.fromkeys(NAMES, 1.0)
        self.wait(0.2)
        self.grasp(0.2, [])
        self.wait(2.5)

    @rule()
    def servo_fault(self):
        servos = self.gripper.servos
        servos.heard, servos.active, servos.reason = True, False, "stall"
        self.wait(0.1)
        servos.active = True

    @rule(force=st.sampled_from([0.1, 0.3]))
    def grasp_to_the_end(self, force):
        """As people do most: they wait for a grasp, and put right what went wrong before."""
        self.reset()
        self.plant.touch = dict.fromkeys(NAMES, TOUCH)
        self.wait(0.1)
        self.grasp(force, [])
        self.wait(5.0)

    @invariant()
    def message_is_one_line(self):
        assert "\n" not in self.gripper.message


Person.TestCase.settings = settings(max_examples=100, stateful_step_count=15, deadline=None)


class TestNeverDropped(Person.TestCase):
    """Run by pytest as a test of its own."""


TestNeverDropped = pytest.mark.long(TestNeverDropped)
