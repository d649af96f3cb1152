# SPDX-License-Identifier: Apache-2.0
"""Parameters of the solver node, and its markers under them."""

import pytest
from probe import shown
from rcl_interfaces.srv import SetParameters
from rclpy.exceptions import ParameterException
from rclpy.parameter import Parameter
from visualization_msgs.msg import Marker, MarkerArray

from ccr_ros.model import CcrError

OWN = (
    "gripper_file",
    "arcs_per_segment",
    "cable_model",
    "time_limit",
    "frame_prefix",
    "gripper_frame",
    "mode",
    "object",
    "gravity",
    "grasp_state_rate",
    "quality_rate",
    "disk_contact",
    "disk_rim",
    "markers",
    "marker_rate",
)
FIXED = OWN[:13]


def test_every_parameter_is_described(start):
    node = start()
    for descriptor in node.describe_parameters(list(OWN)):
        assert len(descriptor.description) > 20, descriptor.name
        assert descriptor.read_only == (descriptor.name in FIXED), descriptor.name
    arcs = node.describe_parameter("arcs_per_segment").integer_range[0]
    assert (arcs.from_value, arcs.to_value) == (1, 64)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("arcs_per_segment", 0),
        ("arcs_per_segment", 65),
        ("arcs_per_segment", "two"),
        ("time_limit", 0.0),
        ("disk_contact", 1),
        ("disk_rim", -0.001),
        ("marker_rate", 0.0),
        ("marker_rate", 1000.0),
        ("markers", 1),
    ],
)
def test_out_of_range_at_start(start, name, value):
    with pytest.raises(ParameterException, match=name):
        start(**{name: value})


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("cable_model", "sticky", "'frictionless' or 'proportional'"),
        ("gripper_file", "no_such_gripper", "gripper_sphere"),
        ("gripper_file", "/no/such/file.yaml", "no such file"),
        ("gripper_file", "straight", "straight.yaml"),
        ("frame_prefix", "/left", "frame_prefix"),
        ("gripper_frame", "", "gripper_frame"),
    ],
)
def test_not_valid_at_start(start, name, value, text):
    with pytest.raises(CcrError, match=text):
        start(**{name: value})


def test_refused_while_running(start):
    node = start()
    for name, value in (
        ("arcs_per_segment", 2),
        ("gripper_file", "other"),
        ("marker_rate", -1.0),
        ("marker_rate", "fast"),
    ):
        before = node.get_parameter(name).value
        (result,) = node.set_parameters([Parameter(name, value=value)])
        assert not result.successful, name
        assert result.reason
        assert node.get_parameter(name).value == before


def test_frames_can_be_named(probe, start, small_gripper):
    start(gripper_file=small_gripper, frame_prefix="", gripper_frame="tool0")
    static = probe.transforms(static=True)
    transforms = probe.until(lambda: [t for m in static for t in m.transforms])
    found = {(t.header.frame_id, t.child_frame_id) for t in transforms}
    assert found == {("tool0", "thumb_base"), ("tool0", "index_base")}


def test_settings_reach_the_solver(probe, start, small_gripper):
    start(gripper_file=small_gripper, cable_model="proportional")
    proportional = probe.pull_and_wait("thumb", [0.0, 0.004])
    start(namespace="other", gripper_file=small_gripper, arcs_per_segment=3)
    frictionless = probe.pull_and_wait("/other/thumb", [0.0, 0.004])
    assert proportional.tip.position.x != pytest.approx(frictionless.tip.position.x, abs=1e-5)


def test_markers_show_the_gripper(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    arrays = probe.markers()

    def complete():
        return arrays and all(shown(arrays[-1], f"{f}/disks") for f in ("thumb", "index"))

    probe.until(complete, "markers of both fingers")
    array = arrays[-1]
    (backbone,) = shown(array, "thumb/backbone")
    assert backbone.header.frame_id == "gripper/thumb_base"
    assert len(shown(array, "thumb/disks")) == 10
    assert len(shown(array, "thumb/cables")) == 2
    assert len(shown(array, "index/cables")) == 1
    ids = [(m.ns, m.id) for m in array.markers]
    assert len(set(ids)) == len(ids)

    slack = shown(array, "thumb/cables")[0].color
    count = len(arrays)
    probe.pull_and_wait("thumb", [0.005, 0.0])
    probe.until(lambda: len(arrays) > count)
    taut = shown(arrays[-1], "thumb/cables")[0].color
    assert (slack.r, slack.g, slack.b) != (taut.r, taut.g, taut.b)
    assert ids == [(m.ns, m.id) for m in arrays[-1].markers]


def test_a_stale_finger_is_see_through(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    arrays = probe.markers()
    probe.pull_and_wait("thumb", [0.005, 0.0])

    def alphas():
        lines = [shown(arrays[-1], f"{f}/backbone") for f in ("thumb", "index")] if arrays else []
        return [line.color.a for found in lines for line in found]

    probe.until(lambda: alphas() == [1.0, 1.0])
    probe.pull("thumb", [1.0, 0.0])
    probe.until(lambda: len(alphas()) == 2 and alphas()[0] < 0.5)
    assert alphas()[1] == 1.0
    probe.pull("thumb", [0.0, 0.0])
    probe.until(lambda: alphas() == [1.0, 1.0])


def test_late_joiner_gets_the_last_markers(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    arrays = probe.markers()

    def complete():
        return arrays and all(shown(arrays[-1], f"{f}/disks") for f in ("thumb", "index"))

    probe.until(complete, "markers of both fingers")
    late = probe.join(MarkerArray, "markers")
    array = probe.until(lambda: late, "the latched markers")[0]
    assert len(shown(array, "index/disks")) == 10


def test_markers_can_be_switched(probe, start, small_gripper):
    node = start(gripper_file=small_gripper, markers=False)
    arrays = probe.markers()
    probe.pull_and_wait("thumb", [0.005, 0.0])
    probe.spin_for(0.3)
    assert not arrays
    assert node.set_parameters([Parameter("markers", value=True)])[0].successful
    probe.until(lambda: arrays and shown(arrays[-1], "thumb/backbone"), "markers")
    assert node.set_parameters([Parameter("marker_rate", value=50.0)])[0].successful
    assert node.set_parameters([Parameter("markers", value=False)])[0].successful
    probe.until(lambda: arrays[-1].markers[0].action == Marker.DELETEALL, "their deletion")
    assert len(arrays[-1].markers) == 1


def test_others_set_parameters_through_the_service(probe, start, small_gripper):
    node = start(gripper_file=small_gripper, markers=False)
    arrays = probe.markers()
    client = probe.node.create_client(SetParameters, f"{node.get_name()}/set_parameters")
    assert client.wait_for_service(60)

    def set_from_outside(**values):
        wanted = [Parameter(name, value=v).to_parameter_msg() for name, v in values.items()]
        future = client.call_async(SetParameters.Request(parameters=wanted))
        return probe.until(future.done) and list(future.result().results)

    (result,) = set_from_outside(markers=True)
    assert result.successful
    probe.until(lambda: arrays and shown(arrays[-1], "thumb/backbone"), "markers")
    for name, value in (("marker_rate", -1.0), ("gripper_file", "other"), ("no_such", 1)):
        (result,) = set_from_outside(**{name: value})
        assert not result.successful
        assert name in result.reason or name == "no_such"
    probe.pull_and_wait("thumb", [0.005, 0.0])
