# SPDX-License-Identifier: Apache-2.0
"""Markers: what they show, where, and how their ids live."""

from dataclasses import replace

import numpy as np
import pytest
from probe import shown
from visualization_msgs.msg import Marker

from ccr_ros.model import Capsule, Contact, Plane, Pose, load_finger, solve
from ccr_ros.resources import find_config
from ccr_ros.viz.markers import (
    HALF_COLOUR_TENSION,
    SLACK,
    STALE_ALPHA,
    FingerView,
    SceneMarkers,
    tension_colour,
)
from ccr_ros.viz.recording import SolidObject


@pytest.fixture(scope="module")
def solution():
    return solve(load_finger(find_config("two_cables")), [0.005, -0.01])


def touching(solution, *disks, force=1.0):
    contacts = tuple(
        Contact(d, "backbone", "", "wall", solution.backbone[d], np.array([0.0, 1.0, 0.0]), force)
        for d in disks
    )
    return replace(solution, contacts=contacts)


def draw(scene, solution, *objects, stale=False):
    return scene.message([FingerView(solution, "base", stale)], objects, "gripper")


def ids(array, namespace):
    """Return ids by what they show: position of a contact's point."""
    return {m.pose.position.z: m.id for m in shown(array, namespace)}


def deleted(array, namespace):
    return {m.id for m in array.markers if m.ns == namespace and m.action == Marker.DELETE}


def test_disks_stand_where_the_solution_has_them(solution):
    disks = shown(draw(SceneMarkers(), solution), "two_cables/disks")
    found = [[m.pose.position.x, m.pose.position.y, m.pose.position.z] for m in disks]
    np.testing.assert_array_equal(found, solution.backbone)
    turn = disks[-1].pose.orientation
    np.testing.assert_array_equal([turn.x, turn.y, turn.z, turn.w], solution.quaternions[-1])
    assert all(m.scale.z < m.scale.x == m.scale.y for m in disks)
    assert {m.header.frame_id for m in disks} == {"base"}


def test_backbone_runs_from_base_to_tip(solution):
    (line,) = shown(draw(SceneMarkers(), solution), "two_cables/backbone")
    ends = [[p.x, p.y, p.z] for p in (line.points[0], line.points[-1])]
    np.testing.assert_allclose(ends, solution.backbone[[0, -1]], atol=1e-9)
    assert line.scale.x == 0.0025


def test_tension_has_a_colour_and_slack_is_grey(solution):
    assert tension_colour(0.0) == SLACK
    low, high = tension_colour(1.0), tension_colour(10 * HALF_COLOUR_TENSION)
    assert high[0] > low[0]
    assert high[2] < low[2]
    taut, slack = shown(draw(SceneMarkers(), solution), "two_cables/cables")
    assert solution.tensions[0] > 0.0 == solution.tensions[1]
    assert (round(slack.color.r, 6), round(slack.color.b, 6)) == (SLACK[0], SLACK[2])
    assert taut.color.r != taut.color.b


def test_stale_is_see_through(solution):
    scene = SceneMarkers()
    fresh = draw(scene, solution)
    stale = draw(scene, solution, stale=True)
    assert shown(fresh, "two_cables/backbone")[0].color.a == 1.0
    assert shown(stale, "two_cables/backbone")[0].color.a == pytest.approx(STALE_ALPHA)


def test_ids_stay_with_their_contacts_and_the_vacant_are_deleted(solution):
    scene = SceneMarkers()
    z = solution.backbone[:, 2]
    first = ids(draw(scene, touching(solution, 5, 7)), "two_cables/contacts")
    assert set(first) == {z[5], z[7]}

    array = draw(scene, touching(solution, 7))
    assert ids(array, "two_cables/contacts") == {z[7]: first[z[7]]}
    assert deleted(array, "two_cables/contacts") == {first[z[5]]}
    assert deleted(array, "two_cables/forces") == {first[z[5]]}

    # A new contact takes the vacant id, and what is still vacant is deleted again and again.
    array = draw(scene, touching(solution, 7, 9))
    assert ids(array, "two_cables/contacts") == {z[7]: first[z[7]], z[9]: first[z[5]]}
    assert not deleted(array, "two_cables/contacts")
    for _ in range(2):
        array = draw(scene, touching(solution))
        assert deleted(array, "two_cables/contacts") == set(first.values())


def test_arrows_grow_with_the_force_along_the_normal(solution):
    def arrow(force):
        scene = SceneMarkers()
        (marker,) = shown(draw(scene, touching(solution, 6, force=force)), "two_cables/forces")
        tail, head = marker.points
        np.testing.assert_allclose([tail.x, tail.y, tail.z], solution.backbone[6])
        assert (head.x, head.z) == (tail.x, tail.z)
        return head.y - tail.y

    assert arrow(0.2) == pytest.approx(2 * arrow(0.1))
    assert arrow(1e6) == pytest.approx(solution.finger.length / 2)


def test_objects_and_the_files_own_obstacles(solution):
    wall = Plane(np.array([0.0, 0.1, 0.0]), np.array([0.0, -1.0, 0.0]), name="wall")
    finger = replace(solution.finger, obstacles=(wall,))
    can = SolidObject("can", "cylinder", (0.1, 0.03), Pose(np.array([0.0, 0.0, 0.2])))
    array = draw(SceneMarkers(), replace(solution, finger=finger), can)
    (marker,) = shown(array, "objects")
    assert (marker.type, marker.header.frame_id) == (Marker.CYLINDER, "gripper")
    assert (marker.scale.x, marker.scale.z, marker.pose.position.z) == (0.06, 0.1, 0.2)
    assert marker.color.a < 1.0
    (own,) = shown(array, "two_cables/obstacles")
    assert (own.type, own.header.frame_id) == (Marker.CUBE, "base")


def test_what_viewers_have_no_marker_for_is_drawn_as_triangles(solution):
    there = Pose(np.array([0.1, 0.0, 0.2]))
    corners, faces = np.vstack([np.zeros((1, 3)), 0.1 * np.eye(3)]), [[0, 2, 1], [1, 2, 3]]
    mesh = SolidObject("wedge", "mesh", (), there, corners, faces)
    pill = SolidObject("pill", "capsule", (0.06, 0.02), there)
    scene = SceneMarkers()
    wedge_shown, pill_shown = shown(draw(scene, solution, mesh, pill), "objects")
    assert wedge_shown.type == pill_shown.type == Marker.TRIANGLE_LIST
    for marker in (wedge_shown, pill_shown):
        assert (marker.scale.x, marker.scale.y, marker.scale.z) == (1.0, 1.0, 1.0)
        assert (marker.pose.position.x, marker.pose.position.z) == (0.1, 0.2)
        assert 0.0 < marker.color.a < 1.0 and len(marker.points) % 3 == 0
    points = np.array([[p.x, p.y, p.z] for p in wedge_shown.points])
    np.testing.assert_allclose(points, corners[np.ravel(mesh.faces)])
    points = np.array([[p.x, p.y, p.z] for p in pill_shown.points])
    assert len(points) < 3000
    capsule = Capsule([0, 0, -0.03], [0, 0, 0.03], 0.02)
    np.testing.assert_allclose(capsule.signed_distance(points), 0, atol=1e-12)
    # Another shape under the same name is another set of triangles.
    (marker,) = shown(draw(scene, solution, replace(mesh, vertices=2 * corners)), "objects")
    np.testing.assert_allclose(marker.points[1].y, 0.2)


def test_clear_takes_all_away_and_ids_start_again(solution):
    scene = SceneMarkers()
    draw(scene, touching(solution, 5, 7))
    assert [m.action for m in scene.clear().markers] == [Marker.DELETEALL]
    array = draw(scene, touching(solution, 7))
    assert set(ids(array, "two_cables/contacts").values()) == {0}
    assert not deleted(array, "two_cables/contacts")
