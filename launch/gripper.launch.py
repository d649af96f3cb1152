# SPDX-License-Identifier: Apache-2.0
"""All nodes of one gripper: ``ros2 launch ccr_ros gripper.launch.py driver:=loopback rviz:=true``.

``ros2 launch ccr_ros gripper.launch.py --show-args`` lists the arguments.
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

# Name, default, description, and, where not every text is allowed, the choices.
ARGUMENTS = (
    ("gripper_file", "gripper_sphere", "Gripper file: a path, or the name of one in config/", None),
    ("servo_file", "", "Servo file: a path or a name; empty: the servo bridge's default", None),
    ("driver", "loopback", "How servos are reached", ["loopback", "ros2_control", "dynamixel"]),
    (
        "mode",
        "",
        "Solver node: each finger by itself, or with the object; empty: its own default",
        ["", "fingers", "gripper"],
    ),
    ("namespace", "gripper", "Namespace of the nodes, and prefix of the frames", None),
    ("params_file", "", "Parameter file for all nodes; empty: none", None),
    ("coordinator", "true", "Whether the gripper coordinator runs", ["true", "false"]),
    ("rviz", "false", "Whether RViz is started, with the package's view", ["true", "false"]),
)


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the nodes that they ask for."""
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text, choices=choices)
                for name, value, text, choices in ARGUMENTS
            ),
            OpaqueFunction(function=_nodes),
        ]
    )


def _nodes(context, *args, **kwargs):
    given = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    namespace = given["namespace"].strip("/")
    files = [given["params_file"]] if given["params_file"] else []

    def node(executable, **parameters):
        return Node(
            package="ccr_ros",
            executable=executable,
            namespace=namespace,
            # Files first: what is said on the command line counts more.
            parameters=[*files, {"gripper_file": given["gripper_file"], **parameters}],
            output="screen",
        )

    servos = {"servo_file": given["servo_file"]} if given["servo_file"] else {}
    mode = {"mode": given["mode"]} if given["mode"] else {}
    nodes = [
        node("solver_node", **mode),
        node("servo_bridge_node", driver=given["driver"], **servos),
    ]
    if given["coordinator"] == "true":
        nodes.append(node("gripper_coordinator_node"))
    if given["rviz"] == "true":
        view = f"{FindPackageShare('ccr_ros').perform(context)}/rviz/gripper.rviz"
        frame = f"{namespace}/gripper_base" if namespace else "gripper_base"
        nodes.append(
            Node(
                package="rviz2",
                executable="rviz2",
                namespace=namespace,
                # The view's topics are relative to the namespace; the frame is not.
                arguments=["-d", view, "-f", frame],
                output="log",
            )
        )
    return nodes
