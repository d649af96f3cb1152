# SPDX-License-Identifier: Apache-2.0
"""Fingers that press on each other with their disks: problems whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest
from friction_cases import LONG, about, around, finger

from ccr_ros.grasp.clearance import disk_clearance
from ccr_ros.grasp.statics import DiskShape, GraspSolver, sphere_body
from ccr_ros.grasp.statics.sensitivity import grasp_sensitivity
from ccr_ros.model import Cable, InvalidValue, MountedFinger, Pose, load_gripper
from ccr_ros.model.solver import FingerSolver
from ccr_ros.resources import find_config

SHAPE = DiskShape(thickness=0.004)
FAR = sphere_body(0.01, pose=Pose(np.array([0.0, 0.0, 0.5])))  # nothing to grasp


def solver_of(fingers, shape=SHAPE, body=FAR, **options):
    return GraspSolver(fingers, body, LONG, disks=shape, **options)


def pulled(solver, *pulls):
    return dict(zip(solver.names, [np.atleast_1d(p) for p in pulls], strict=True))


def in_gripper(solver, solution, index):
    """Disk centres (k, 3) of a finger in the gripper's frame."""
    return solver.hand.mounted[index].base.points(solution.fingers[index].backbone)


def test_two_alike_press_each_other_in_the_middle():
    solver = solver_of(around(2, 0.03))
    free = solver.solve(pulled(solver, 0.002, 0.002)).require_converged()
    assert not free.disk_contacts
    solution = solver.solve(pulled(solver, 0.0042, 0.0042)).require_converged()
    (contact,) = solution.disk_contacts
    assert contact.fingers == ("finger_1", "finger_2") and contact.disks == (6, 6)
    assert contact.force > 0.2
    assert abs(contact.position[0]) < 1e-9  # the plane of symmetry
    assert contact.normal == pytest.approx([-1, 0, 0], abs=1e-9)  # from finger_1, at +x
    one, other = (in_gripper(solver, solution, k) for k in (0, 1))
    assert np.abs(one * [-1, 1, 1] - other).max() < 1e-9
    assert solution.residual < 1e-9
    # Without contact they go through each other.
    through = GraspSolver(around(2, 0.03), FAR, LONG).solve(pulled(solver, 0.0042, 0.0042))
    assert not through.disk_contacts
    assert in_gripper(solver, through, 0)[-1, 0] < one[-1, 0] - 0.002


def test_the_force_bends_a_finger_as_an_external_force_would():
    """What one finger feels is what it feels of a small fixed ball in the other's place."""
    solver = solver_of(around(2, 0.03))
    solution = solver.solve(pulled(solver, 0.0042, 0.0042)).require_converged()
    (contact,) = solution.disk_contacts
    mounted = solver.hand.mounted[0]
    # The generalised force of it, with the disk's own Jacobian by differences
    problem, at = solver.hand.problems[0], solver.point.blocks[0].point
    arms = mounted.base.inverse().points(contact.position) - at.at.points[
        problem.points.backbone[6]] * mounted.finger.length  # fmt: skip
    push = mounted.base.inverse().vectors(-contact.force * contact.normal)

    def work(y):
        state = problem.evaluate(y)
        rod = state.rod
        tip = rod.positions[-1] * mounted.finger.length
        turn = rod.rotations[-1] @ at.at.rod.rotations[-1].T
        return push @ (tip + turn @ arms)

    size, slope = 1e-6, np.zeros(problem.size)
    for k in range(problem.size):
        ahead, back = at.at.y.copy(), at.at.y.copy()
        ahead[k] += size
        back[k] -= size
        slope[k] = (work(ahead) - work(back)) / (2 * size)
    unit = mounted.finger.bending_stiffness / mounted.finger.length
    left = at.at.y + at.multipliers @ at.rows - slope / unit
    assert np.abs(left).max() < 1e-6 * np.abs(at.at.y).max()


def test_work_done_on_the_way_is_stored():
    solver = solver_of(around(2, 0.03))
    pull, work, stored = 0.0034, 0.0, None
    before = solver.solve(pulled(solver, pull, pull)).require_converged()
    start = before.energy
    for _ in range(16):
        pull += 0.0001
        after = solver.solve(pulled(solver, pull, pull)).require_converged()
        work += 1e-4 * sum(
            0.5 * (a.tensions[0] + b.tensions[0])
            for a, b in zip(before.fingers, after.fingers, strict=True)
        )
        before, stored = after, after.energy
    assert before.disk_contacts[0].force > 0.3
    assert work == pytest.approx(stored - start, rel=2e-4)


def test_the_way_there_does_not_matter():
    straight, around_it = solver_of(around(2, 0.03)), solver_of(around(2, 0.03))
    one = straight.solve(pulled(straight, 0.0042, 0.0038)).require_converged()
    around_it.solve(pulled(around_it, 0.0042, 0.0)).require_converged()
    around_it.solve(pulled(around_it, 0.0045, 0.0042)).require_converged()
    other = around_it.solve(pulled(around_it, 0.0042, 0.0038)).require_converged()
    assert one.disk_contacts and len(one.disk_contacts) == len(other.disk_contacts)
    for a, b in zip(one.disk_contacts, other.disk_contacts, strict=True):
        assert a.force == pytest.approx(b.force, rel=1e-6)
        assert np.abs(a.position - b.position).max() < 1e-9


def test_rigid_motion_and_units_do_not_matter():
    turn = Pose(np.array([0.1, -0.2, 0.3]), about([0.6, 0.0, 0.8], 1.1))
    plain, moved = solver_of(around(2, 0.03)), solver_of(around(2, 0.03, turn), body=sphere_body(
        0.01, pose=turn @ FAR.pose))  # fmt: skip
    a = plain.solve(pulled(plain, 0.0042, 0.0036)).require_converged().disk_contacts
    b = moved.solve(pulled(moved, 0.0042, 0.0036)).require_converged().disk_contacts
    assert len(a) == len(b) == 1
    assert b[0].force == pytest.approx(a[0].force, rel=1e-7)
    assert b[0].position == pytest.approx(turn.points(a[0].position), abs=1e-9)
    assert b[0].normal == pytest.approx(turn.vectors(a[0].normal), abs=1e-7)


def test_fingers_of_unlike_length_and_stiffness():
    """Which finger comes first gives the units, and must not matter."""
    long, stout = around(2, 0.03)
    stout = MountedFinger(
        replace(finger("finger_2", length=0.1), backbone_diameter=0.003), stout.base
    )
    found = []
    for fingers in ([long, stout], [stout, long]):
        solver = solver_of(fingers)
        pulls = {"finger_1": [0.0045], "finger_2": [0.004]}
        solution = solver.solve(pulls).require_converged()
        (contact,) = solution.disk_contacts
        first = contact.fingers[0] == "finger_1"
        found.append((contact.force, contact.position, contact.normal * (1 if first else -1)))
        assert solution.residual < 1e-9
    assert found[0][0] == pytest.approx(found[1][0], rel=1e-7)
    assert found[0][1] == pytest.approx(found[1][1], abs=1e-9)
    assert found[0][2] == pytest.approx(found[1][2], abs=1e-7)


def test_a_stiff_finger_is_an_obstacle():
    """Against a finger a million times as stiff: the pose hardly changes with its stiffness."""
    forces = []
    for modulus in (1e13, 1e15):
        one, other = around(2, 0.026)
        other = MountedFinger(replace(other.finger, youngs_modulus=modulus), other.base)
        solver = solver_of([one, other])
        solution = solver.solve(pulled(solver, 0.008, 0.0)).require_converged()
        (contact,) = solution.disk_contacts
        assert contact.fingers == ("finger_1", "finger_2")
        rest = FingerSolver(other.finger).rest.backbone
        assert np.abs(solution.fingers[1].backbone - rest).max() < 4e-6
        forces.append(contact.force)
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)


def test_three_fingers_close_on_nothing_and_meet_in_the_middle():
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    solver = solver_of(fingers, DiskShape(rim=0.0015))
    length = fingers[0].finger.length
    for percent in (4.6, 6.0):
        solution = solver.solve(
            {name: [percent / 100 * length] for name in solver.names}
        ).require_converged()
        contacts = solution.disk_contacts
        assert [c.disks for c in contacts] == [(9, 9)] * 3
        forces = [c.force for c in contacts]
        assert max(forces) == pytest.approx(min(forces), rel=1e-7)
        places = np.array([c.position for c in contacts])
        assert np.ptp(places[:, 2]) < 1e-8
        assert np.abs(places[:, :2].sum(axis=0)).max() < 1e-8  # threefold
        bases = [m.base for m in fingers]
        clear = disk_clearance(solution.fingers, bases, rim=0.0015)
        assert not clear.touching


def test_a_large_step_does_not_go_through():
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    length = fingers[0].finger.length
    small, large = (solver_of(fingers, DiskShape(rim=0.0015)) for _ in range(2))
    for percent in (4.0, 4.5, 5.0, 5.5, 6.0):
        slow = small.solve({name: [percent / 100 * length] for name in small.names})
    fast = large.solve({name: [0.06 * length] for name in large.names}).require_converged()
    assert [c.disks for c in fast.disk_contacts] == [c.disks for c in slow.disk_contacts]
    for a, b in zip(fast.disk_contacts, slow.disk_contacts, strict=True):
        assert a.force == pytest.approx(b.force, rel=1e-6)


def test_pushed_head_on_thin_rims_are_not_stable_and_say_so():
    solver = solver_of(around(2, 0.03), DiskShape(thickness=0.001))
    solution = solver.solve(pulled(solver, 0.0042, 0.0042)).require_converged()
    assert solution.disk_contacts and not solution.stable
    assert solution.smallest_eigenvalue < 0 and "finger" in solution.message
    # One that leans on the side of the other is.
    solver = solver_of(around(2, 0.03))
    solution = solver.solve(pulled(solver, 0.0072, 0.0)).require_converged()
    assert solution.disk_contacts and solution.stable
    assert solution.smallest_eigenvalue > 0.1


def test_stability_is_the_energys_own():
    """The reduced Hessian against second differences of the energy along its softest direction."""
    solver = solver_of(around(2, 0.03))
    solver.solve(pulled(solver, 0.0042, 0.0038)).require_converged()
    stability = solver.solve({}).stability
    value, direction = stability._softest
    point, room = solver.point, solver.room
    sizes = [p.size for p in solver.hand.problems]
    ways = np.split(direction[: sum(sizes)], [sizes[0]])

    def lagrangian(size):
        parts = []
        for p, part, way in zip(solver.hand.problems, point.blocks, ways, strict=True):
            at = p.evaluate(part.point.at.y + size * way)
            parts.append((at, 0.5 * at.y @ at.y + part.point.tensions @ at.lengths))
        total = sum(w * e for w, (_, e) in zip(solver.hand.weights, parts, strict=True))

        class Near:
            def __init__(self, at, first):
                self.at, self.first = at, first

        points = [
            Near(at, p.linearize(at))
            for p, (at, _) in zip(solver.hand.problems, parts, strict=True)
        ]
        near = room.near_disks(
            points, replace(point.near_disks, forces=0 * point.near_disks.forces)
        )
        index = [list(near.pairs).index(k) for k in point.near_disks.pairs]
        return total - point.near_disks.forces @ near.near.gaps[index]

    size = 1e-3
    second = (lagrangian(size) - 2 * lagrangian(0.0) + lagrangian(-size)) / size**2
    assert value == pytest.approx(second, rel=1e-4, abs=1e-4)


def test_sensitivities_go_through_the_contact():
    solver = solver_of(around(2, 0.03))
    solver.solve(pulled(solver, 0.0042, 0.0036)).require_converged()
    found = grasp_sensitivity(solver)
    size, base = 1e-6, solver.pulls
    tensions = []
    for sign in (1, -1):
        pulls = {n: p.copy() for n, p in base.items()}
        pulls["finger_2"][0] += sign * size
        solution = solver.solve(pulls).require_converged()
        tensions.append([f.tensions[0] for f in solution.fingers])
    expected = np.subtract(*tensions) / (2 * size)
    assert abs(expected[0]) > 1.0  # N/m: the other finger feels it
    assert found.tensions[:, 1] == pytest.approx(expected, rel=1e-4)


def backed(friction):
    """Three fingers on a ball, a fourth of which leans on the back of the first."""
    fingers = around(3, 0.03)
    behind = fingers[0].base @ Pose(np.array([-0.024, 0.0, 0.0]))
    fingers.append(MountedFinger(finger("behind"), behind))
    ball = sphere_body(0.04, 0.002, Pose(np.array([0.0, 0.0, 0.118])), friction)
    return GraspSolver(fingers, ball, LONG, disks=SHAPE)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_finger_leans_on_one_that_grasps(friction):
    solver = backed(friction)
    pulls = {f"finger_{k}": [0.0008] for k in (1, 2, 3)}
    alone = solver.solve(pulls).require_converged()
    solution = solver.solve({"behind": [0.0028]}).require_converged()
    (contact,) = solution.disk_contacts
    assert contact.fingers == ("finger_1", "behind") and contact.force > 0.01

    def presses(found):
        return sum(c.force for c in found.contacts if c.finger == "finger_1")

    assert presses(solution) > presses(alone) + 0.3 * contact.force
    free = solver.let_go().require_converged()
    assert free.disk_contacts and not free.supported
    grip = sum(c.force for c in free.contacts)
    assert np.abs(free.net_force).max() < 1e-6 * grip
    assert np.abs(free.net_moment).max() < 1e-6 * grip * 0.02
    assert free.residual < 1e-9


def rolling(pull):
    """A slim finger that rolls up until its tip lies on its base, face to face."""
    slim = replace(
        finger("slim", length=0.2), segments=20, rest_curvature=np.zeros((20, 3)),
        disk_radius=0.005, cables=[Cable("pull", [0.0] * 21)],
    )  # fmt: skip
    solver = GraspSolver([MountedFinger(slim, Pose())], FAR, LONG, disks=DiskShape())
    return solver, solver.solve({"slim": [pull]})


def test_a_finger_rolls_up_onto_itself():
    solver, free = rolling(0.031)
    assert free.converged and not free.disk_contacts
    places = []
    for pull in (0.032, 0.0321, 0.0323):
        solution = solver.solve({"slim": [pull]}).require_converged()
        (contact,) = solution.disk_contacts
        assert contact.fingers == ("slim", "slim") and contact.disks == (0, 20)
        assert contact.normal == pytest.approx([0, 0, -1], abs=0.04)
        assert contact.position[2] == pytest.approx(-0.001, abs=2e-5)  # half a thickness below
        places.append(contact.position[0])
    # The force wanders over the face from rim to rim as the tip disk turns over it.
    assert places[0] == pytest.approx(0.004, abs=1e-4)
    assert abs(places[1]) < 0.003 and places[2] == pytest.approx(-0.004, abs=1e-4)


@pytest.mark.parametrize(("name", "least"), [("gripper_cube", 0.0), ("gripper_sphere", 0.038)])
def test_no_pose_that_converged_has_disks_in_each_other(name, least):
    """Random pulls, small steps and large ones; `disk_clearance` finds gaps in another way."""
    rng, shape = np.random.default_rng(4), DiskShape(rim=0.0015)
    fingers = load_gripper(find_config(name)).fingers
    solver, length = solver_of(fingers, shape), fingers[0].finger.length
    bases = [m.base for m in fingers]
    pressed = 0
    for k in range(16):
        size = 0.02 if k % 4 == 0 else 0.004
        pulls = {n: p + size * length * rng.normal(size=len(p)) for n, p in solver.pulls.items()}
        pulls = {n: np.clip(p, least * length, 0.08 * length) for n, p in pulls.items()}
        solution = solver.solve(pulls)
        if not solution.converged:
            continue
        pressed += bool(solution.disk_contacts)
        clear = disk_clearance(solution.fingers, bases, rim=shape.rim - shape.thickness / 2)
        assert clear.gap > shape.thickness - 2e-6
        assert solution.residual < 1e-9
        assert all(c.force > 0 for c in solution.disk_contacts)
    assert pressed >= 2


@pytest.mark.parametrize(
    ("values", "place"),
    [
        ({"rim": -0.001}, "disks.rim"),
        ({"rim": np.nan}, "disks.rim"),
        ({"thickness": 0.0}, "disks.thickness"),
        ({"thickness": np.inf}, "disks.thickness"),
        ({"thickness": "thin"}, "disks.thickness"),
    ],
)
def test_bad_shapes(values, place):
    with pytest.raises(InvalidValue, match=place):
        DiskShape(**values)


def test_disks_that_cut_each_other_at_rest_are_refused():
    with pytest.raises(InvalidValue, match="disk 0 of finger_1 and disk 0 of finger_2") as error:
        solver_of(around(2, 0.007))
    assert "at rest" in str(error.value)
    for thickness in (0.02, 0.00007):
        with pytest.raises(InvalidValue, match=r"disks\.thickness.* 8e-05 to 0.008 m"):
            solver_of(around(2, 0.03), DiskShape(thickness=thickness))


def test_off_by_default():
    solver = GraspSolver(around(2, 0.03), FAR, LONG)
    solution = solver.solve(pulled(solver, 0.0042, 0.0042)).require_converged()
    assert solution.disk_contacts == () and solver.room is None
