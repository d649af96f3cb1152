# SPDX-License-Identifier: Apache-2.0
import io

import pytest


def test_list_has_every_kind(ccr):
    lines = ccr("interface", "list").out.splitlines()
    assert [line for line in lines if line[0] != " "] == ["Messages:", "Services:", "Actions:"]
    assert "    std_msgs/msg/String" in lines
    assert "    std_srvs/srv/SetBool" in lines
    services = ccr("interface", "list", "-s").out.splitlines()
    assert services[0] == "Services:" and "    std_msgs/msg/String" not in services


def test_package_and_packages(ccr):
    names = ccr("interface", "package", "std_srvs").out.splitlines()
    assert names == ["std_srvs/srv/Empty", "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"]
    assert ccr("interface", "package", "std_srvs", "-m").out == ""
    packages = ccr("interface", "packages").out.splitlines()
    assert {"std_msgs", "std_srvs"} <= set(packages)
    assert "std_srvs" not in ccr("interface", "packages", "-m").out.splitlines()


def test_show_nests_with_tabs(ccr):
    assert ccr("interface", "show", "geometry_msgs/msg/PointStamped", "--no-comments").out == (
        "std_msgs/Header header\n"
        "\tbuiltin_interfaces/Time stamp\n"
        "\t\tint32 sec\n"
        "\t\tuint32 nanosec\n"
        "\tstring frame_id\n"
        "Point point\n"
        "\tfloat64 x\n"
        "\tfloat64 y\n"
        "\tfloat64 z\n"
    )


def test_show_services_constants_and_standard_input(ccr, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("diagnostic_msgs/srv/SelfTest\n"))
    lines = ccr("interface", "show", "-", "--no-comments").out.splitlines()
    assert lines[:4] == ["---", "string id", "byte passed", "DiagnosticStatus[] status"]
    constants = [line.replace(" ", "") for line in lines if "=" in line]
    assert constants == ["\tbyteOK=0", "\tbyteWARN=1", "\tbyteERROR=2", "\tbyteSTALE=3"]


def test_show_keeps_comments_of_types_that_come_as_text(ccr):
    """Comments of the type itself are shown, those of nested types when asked for."""
    pytest.importorskip("ccr_msgs.msg")
    name = "ccr_msgs/msg/ObjectArray"
    plain, full, bare = (
        ccr("interface", "show", name, *options).out.splitlines()
        for options in ((), ("--all-comments",), ("--no-comments",))
    )
    assert any(line.startswith("#") for line in plain)
    assert not any(line.startswith("\t#") for line in plain)
    assert any(line.startswith("\t#") for line in full)
    assert bare and not any("#" in line for line in bare)


def test_proto(ccr):
    assert ccr("interface", "proto", "std_srvs/srv/SetBool").out == '"data: false\n"\n'
    bare = ccr("interface", "proto", "geometry_msgs/msg/Point", "--no-quotes").out
    assert bare == "x: 0.0\ny: 0.0\nz: 0.0\n\n"


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (
            ("show", "std_msgs/msg/Strin"),
            "no message type 'Strin' in std_msgs (did you mean 'String'?)",
        ),
        (
            ("show", "std_srvs/srv/Flip"),
            "no service type 'Flip' in std_srvs; there are: Empty, SetBool, Trigger",
        ),
        (
            ("show", "String"),
            "type: 'String' is not allowed; must be written as package/msg/Name (or srv, action)",
        ),
        (("package", "std_msg"), "no package 'std_msg' (did you mean 'std_msgs'?)"),
    ],
)
def test_unknown_names(ccr, words, error):
    assert ccr("interface", *words) == (2, "", f"ccr: error: {error}\n")
