# SPDX-License-Identifier: Apache-2.0
"""What rosbags' Jazzy store does not hold: package names, default values, services and actions."""

import re

_PACKAGES = """
action_msgs actionlib_msgs builtin_interfaces composition_interfaces diagnostic_msgs
example_interfaces geometry_msgs lifecycle_msgs nav_msgs rcl_interfaces rmw_dds_common
rosbag2_interfaces rosgraph_msgs sensor_msgs service_msgs shape_msgs statistics_msgs std_msgs
std_srvs stereo_msgs tf2_msgs trajectory_msgs type_description_interfaces unique_identifier_msgs
visualization_msgs
"""
#: every package that is served without a definition on disk
PACKAGES = frozenset(_PACKAGES.split())

#: default values of the .msg texts: message -> member -> value
DEFAULTS: dict[str, dict[str, object]] = {
    "geometry_msgs/msg/Quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    "rcl_interfaces/msg/ParameterDescriptor": {"read_only": False, "dynamic_typing": False},
    "sensor_msgs/msg/NavSatStatus": {"status": -2},
    "type_description_interfaces/msg/FieldType": {"type_id": 0},
}

#: services and actions of the standard packages: sections divided by ---, members by semicolons
_SERVICES = """
action_msgs/srv/CancelGoal: GoalInfo goal_info --- int8 ERROR_NONE=0; int8 ERROR_REJECTED=1;
    int8 ERROR_UNKNOWN_GOAL_ID=2; int8 ERROR_GOAL_TERMINATED=3; int8 return_code;
    GoalInfo[] goals_canceling
composition_interfaces/srv/ListNodes: --- string[] full_node_names; uint64[] unique_ids
composition_interfaces/srv/LoadNode: string package_name; string plugin_name; string node_name;
    string node_namespace; uint8 log_level; string[] remap_rules;
    rcl_interfaces/Parameter[] parameters; rcl_interfaces/Parameter[] extra_arguments
    --- bool success; string error_message; string full_node_name; uint64 unique_id
composition_interfaces/srv/UnloadNode: uint64 unique_id --- bool success; string error_message
diagnostic_msgs/srv/AddDiagnostics: string load_namespace --- bool success; string message
diagnostic_msgs/srv/SelfTest: --- string id; byte passed; DiagnosticStatus[] status
example_interfaces/action/Fibonacci: int32 order --- int32[] sequence --- int32[] sequence
example_interfaces/srv/AddTwoInts: int64 a; int64 b --- int64 sum
example_interfaces/srv/SetBool: bool data --- bool success; string message
example_interfaces/srv/Trigger: --- bool success; string message
lifecycle_msgs/srv/ChangeState: Transition transition --- bool success
lifecycle_msgs/srv/GetAvailableStates: --- State[] available_states
lifecycle_msgs/srv/GetAvailableTransitions: --- TransitionDescription[] available_transitions
lifecycle_msgs/srv/GetState: --- State current_state
nav_msgs/srv/GetMap: --- OccupancyGrid map
nav_msgs/srv/GetPlan: geometry_msgs/PoseStamped start; geometry_msgs/PoseStamped goal;
    float32 tolerance --- Path plan
nav_msgs/srv/LoadMap: string map_url --- uint8 RESULT_SUCCESS=0;
    uint8 RESULT_MAP_DOES_NOT_EXIST=1; uint8 RESULT_INVALID_MAP_DATA=2;
    uint8 RESULT_INVALID_MAP_METADATA=3; uint8 RESULT_UNDEFINED_FAILURE=255;
    nav_msgs/OccupancyGrid map; uint8 result
nav_msgs/srv/SetMap: nav_msgs/OccupancyGrid map;
    geometry_msgs/PoseWithCovarianceStamped initial_pose --- bool success
rcl_interfaces/srv/DescribeParameters: string[] names --- ParameterDescriptor[] descriptors
rcl_interfaces/srv/GetLoggerLevels: string[] names --- LoggerLevel[] levels
rcl_interfaces/srv/GetParameterTypes: string[] names --- uint8[] types
rcl_interfaces/srv/GetParameters: string[] names --- ParameterValue[] values
rcl_interfaces/srv/ListParameters: uint64 DEPTH_RECURSIVE=0; string[] prefixes; uint64 depth
    --- ListParametersResult result
rcl_interfaces/srv/SetLoggerLevels: LoggerLevel[] levels --- SetLoggerLevelsResult[] results
rcl_interfaces/srv/SetParameters: Parameter[] parameters --- SetParametersResult[] results
rcl_interfaces/srv/SetParametersAtomically: Parameter[] parameters --- SetParametersResult result
sensor_msgs/srv/SetCameraInfo: sensor_msgs/CameraInfo camera_info --- bool success;
    string status_message
std_srvs/srv/Empty: ---
std_srvs/srv/SetBool: bool data --- bool success; string message
std_srvs/srv/Trigger: --- bool success; string message
tf2_msgs/action/LookupTransform: string target_frame; string source_frame;
    builtin_interfaces/Time source_time; builtin_interfaces/Duration timeout;
    builtin_interfaces/Time target_time; string fixed_frame; bool advanced
    --- geometry_msgs/TransformStamped transform; tf2_msgs/TF2Error error ---
tf2_msgs/srv/FrameGraph: --- string frame_yaml
type_description_interfaces/srv/GetTypeDescription: string type_name; string type_hash;
    bool include_type_sources true --- bool successful; string failure_reason;
    TypeDescription type_description; TypeSource[] type_sources; KeyValue[] extra_information
visualization_msgs/srv/GetInteractiveMarkers: --- uint64 sequence_number;
    InteractiveMarker[] markers
"""

_NUMBERS = "float32 float64 int8 int16 int32 int64 uint8 uint16 uint32 uint64"


def _texts() -> dict[str, str]:
    texts = {}
    for entry in re.split(r"\n(?=\S)", _SERVICES.strip()):
        name, _, body = entry.partition(":")
        lines = body.replace("---", ";---;").split(";")
        texts[name] = "\n".join(" ".join(line.split()) for line in lines if line.strip())
    own = "example_interfaces/msg/"
    texts[f"{own}Empty"] = ""
    texts[f"{own}MultiArrayDimension"] = "string label\nuint32 size\nuint32 stride"
    texts[f"{own}MultiArrayLayout"] = "MultiArrayDimension[] dim\nuint32 data_offset"
    for base in f"bool byte char {_NUMBERS} string wstring".split():
        name = base.capitalize().replace("Uint", "UInt").replace("Wst", "WSt")
        texts[own + name] = f"{base} data"
        if base in f"byte {_NUMBERS}".split():
            texts[f"{own}{name}MultiArray"] = f"MultiArrayLayout layout\n{base}[] data"
    return texts


#: definitions that rosbags' store does not hold: name -> text
TEXTS = _texts()
