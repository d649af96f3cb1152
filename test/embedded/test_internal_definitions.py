# SPDX-License-Identifier: Apache-2.0
"""Reading definitions: the text of files, where they are looked for, which one counts."""

import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from embedded_ros.interfaces.classes import make_message_class
from embedded_ros.interfaces.packages import (
    folders_of_environment,
    interface_folders,
    package_name,
)
from embedded_ros.interfaces.parser import parse_message, split_sections
from embedded_ros.interfaces.registry import Registry, registry
from embedded_ros.interfaces.spec import (
    PRIMITIVES,
    STRINGS,
    Constant,
    DefinitionError,
    Field,
    FieldType,
    MessageSpec,
    int_range,
)

ROOT = Path(__file__).parents[2]
SAMPLES = Path(__file__).parent / "interfaces" / "sample_msgs"


def parse(text):
    (section,) = split_sections(text, 1, "Some.msg")
    return parse_message(section, "pkg/msg/Some")


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("float64", "expected"),
        ("float64[ x", "type"),
        ("float64[0] x", "type"),
        ("float64[<=] x", "bound"),
        ("float64<=3 x", "only strings"),
        ("string<=0 x", "type"),
        ("int32 X=1.5", "1.5"),
        ("uint8 X=256", "0 to 255"),
        ("int8 x -129", "-128 to 127"),
        ("byte x 0x100", "0 to 255"),
        ("int32[] X=[1]", "constant"),
        ("Other X=1", "constant"),
        ("int32 lower=1", "CAPITALS"),
        ("unknown! x", "neither"),
        ("lower_case x", "neither"),
        ("three/part/Names x", "neither"),
        ("bool flag maybe", "boolean"),
        ("int8 9lives", "member"),
        ("int8 camelCase", "member"),
        ("int8 two__underscores", "member"),
        ("int8 ends_", "member"),
        ("int8 class", "Python"),
        ("int32 fine", "two members"),
        ("int32[2] x [1]", "1 values"),
        ("int32[<=1] x [1, 2]", "2 values"),
        ("int32[] x 1, 2", "expected"),
        ("Other x 1", "no default"),
        ("string<=2 x abc", "longer"),
        ('string x "a"b"', "backslash"),
        ('string[] x ["a]', "strings"),
        ("string[] x [a,,b]", "strings"),
    ],
)
def test_bad_definitions_name_the_line(line, reason):
    with pytest.raises(DefinitionError, match=f"^Some.msg:2: .*{reason}") as caught:
        parse(f"int32 fine\n{line}\n")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("line", "value"),
    [
        # What rosidl_adapter and rosidl_parser of ROS 2 Jazzy read.
        ('string x "a b"', "a b"),
        ("string x 'a b'", "a b"),
        ("string x a b", "a b"),
        (r'string x "a\"b"', 'a"b'),
        (r"string x 'a\'b'", "a'b"),
        ('string x "it\'s"', "it's"),
        (r'string x "tab\there"', "tab\there"),
        (r'string x "hex\x41 oct\101"', "hexA octA"),
        ('string x "é"', "é"),
        ('string x ""', ""),
        ('string x "a # b"', '"a'),
        ("string X = 'q'  # c", "q"),
        ("string X=", ""),
        ('wstring x "ハ"', "ハ"),
        ("bool x TRUE", True),
        ("bool X=0", False),
        ("byte x 0xff", b"\xff"),
        ("char x 65", 65),
        ("int8 X=010", 10),
        ("int8 X=-0x10", -16),
        ("uint8 X=0b101", 5),
        ("uint64 X=18446744073709551615", 2**64 - 1),
        ("float64 x -.5", -0.5),
        ("float32 x 1e5", 1e5),
        ("int32[] x [1, 2,3]", [1, 2, 3]),
        ("bool[] x [true, False, 1]", [True, False, True]),
        ("byte[] x [1, 255]", [b"\x01", b"\xff"]),
        ("string[] x [\"a\", 'b', c d]", ["a", "b", "c d"]),
        ("string[] x [\"a,b\", ' c ']", ["a,b", "c"]),
        (r'string[] x ["\t", "a\\b",]', ["\t", "a\\b"]),
        ("string<=2[] x [ab]", ["ab"]),
        ("int32\tx\t5", 5),
        ("int32 x   5   # hi", 5),
    ],
)
def test_values_are_read_as_rosidl_reads_them(line, value):
    spec = parse(line)
    found = spec.fields[0].default if spec.fields else spec.constants[0].value
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("text", "ftype"),
    [
        ("int32[3]", FieldType("int32", "array", 3)),
        ("string<=5", FieldType("string", string_bound=5)),
        ("wstring<=5[<=3]", FieldType("wstring", "sequence", 3, 5)),
        ("Other[]", FieldType("pkg/msg/Other", "sequence")),
        ("other_pkg/Other", FieldType("other_pkg/msg/Other")),
    ],
)
def test_types_are_read_and_written(text, ftype):
    assert parse(f"{text} x").fields == (Field("x", ftype),)
    assert ftype.text("pkg") == text


NAMES = "self cls value other property array float sorted unknown data names str2 a_b"


def test_any_member_name_that_ros_allows_is_allowed():
    names = NAMES.split()
    cls = make_message_class(parse("\n".join(f"int32 {name}" for name in names)), Registry().spec)
    assert cls(**{name: 1 for name in names}) != cls()
    assert "self=0, cls=0" in repr(cls())
    with pytest.raises(AssertionError, match="nope"):
        cls(nope=1)


def scalars(base):
    if base in ("string", "wstring"):
        return st.text(st.characters(exclude_categories=["Cs", "Cc", "Zl", "Zp"]))
    if base == "bool":
        return st.booleans()
    if base == "byte":
        return st.binary(min_size=1, max_size=1)
    if base.startswith("float"):
        return st.floats(allow_nan=False, allow_infinity=False)
    return st.integers(*int_range(base))


BASES = sorted({*PRIMITIVES, *STRINGS})


@given(st.sampled_from(BASES), st.data())
@settings(max_examples=300, deadline=None)
def test_a_specification_survives_as_text(base, data):
    value = data.draw(scalars(base))
    spec = MessageSpec(
        "pkg/msg/Some",
        (Field("x", FieldType(base), value), Field("y", FieldType(base, "sequence", 2))),
        (Constant("X", FieldType(base), value),),
    )
    assert parse(spec.text()) == spec


def test_every_interface_has_a_text_that_says_the_same():
    names = [f"{p}/msg/{n}" for p in sorted(registry.packages) for n in registry.names(p, "msg")]
    assert len(names) > 150
    for name in names:
        (section,) = split_sections(registry.text(name), 1, name)
        assert parse_message(section, name) == registry.spec(name)
    assert registry.text("std_srvs/srv/SetBool") == "bool data\n---\nbool success\nstring message\n"
    assert "float64 w 1.0\n" in registry.text("geometry_msgs/msg/Quaternion")
    assert "# SPDX" in registry.text("embedded_sample_msgs/msg/Part")
    with pytest.raises(KeyError):
        registry.text("std_msgs/msg/NoSuch")


def test_line_numbers_of_services_are_those_of_the_file(tmp_path):
    package(tmp_path, "own_msgs", {"srv/Bad.srv": "int32 a\n---\nint32 b\nint32\n"})
    own = Registry()
    own.add_package(tmp_path / "own_msgs")
    with pytest.raises(DefinitionError, match=r"own_msgs/srv/Bad\.srv:4: 'int32': expected"):
        own.spec("own_msgs/srv/Bad_Request")


@pytest.mark.parametrize(
    ("file", "text", "count"),
    [("srv/Bad.srv", "int32 a\n", "0 lines"), ("action/Bad.action", "---\n", "1 lines")],
)
def test_sections_are_counted(tmp_path, file, text, count):
    package(tmp_path, "own_msgs", {file: text})
    own = Registry()
    own.add_package(tmp_path / "own_msgs")
    with pytest.raises(DefinitionError, match=f"Bad.*: {count} '---'"):
        own.interface_class("own_msgs/" + file.partition(".")[0])


def package(folder, name, files):
    """Make an interface package, and return its folder."""
    home = folder / name
    for path, text in files.items():
        (home / path).parent.mkdir(parents=True, exist_ok=True)
        (home / path).write_bytes(text if isinstance(text, bytes) else text.encode())
    (home / "package.xml").write_text(f"<package><name>{name}</name></package>")
    return home


def test_windows_line_ends_and_byte_order_marks(tmp_path):
    text = b'\xef\xbb\xbfint32 X=1\r\nstring text "h\xc3\xa9"\r\n'
    home = package(tmp_path, "own_msgs", {"msg/A.msg": text, "srv/B.srv": b"---\r\nint32 x\r\n"})
    own = Registry()
    own.add_package(home)
    assert own.message_class("own_msgs/msg/A")().text == "hé"
    assert own.message_class("own_msgs/srv/B_Response")().x == 0


def test_one_bad_file_spoils_no_other(tmp_path):
    files = {
        "msg/Good.msg": "int32 x",
        "msg/Latin.msg": b"# \xe9\nint32 x",
        "msg/Broken.msg": "int32",
        "msg/User.msg": "int32 x\nBroken part",
        "msg/Stranger.msg": "other_msgs/Thing thing",
        "msg/Missing.msg": "NoSuch[] thing",
        "msg/Selfish.msg": "Selfish[] inner",
        "msg/Ping.msg": "Pong other",
        "msg/Pong.msg": "Ping[] other",
    }
    own = Registry()
    own.add_package(package(tmp_path, "own_msgs", files))
    reasons = {
        "Latin": "Latin.msg: .*utf-8",
        "Broken": "Broken.msg:1: 'int32'",
        "User": "Broken.msg:1: 'int32'",
        "Stranger": "Stranger.msg: member 'thing' is of type other_msgs/msg/Thing, but the package"
        " other_msgs is on no search path",
        "Missing": "Missing.msg: member 'thing' is of type own_msgs/msg/NoSuch, but no message",
        "Selfish": "Selfish.msg: member 'inner' makes own_msgs/msg/Selfish hold itself",
        "Ping": "Pong.msg: member 'other' makes own_msgs/msg/Ping hold itself",
    }
    for name, reason in reasons.items():
        with pytest.raises(DefinitionError, match=reason):
            own.message_class(f"own_msgs/msg/{name}")
    assert own.message_class("own_msgs/msg/Good")(x=1).x == 1
    # When what was lacking is there, all is well.
    own.add_package(package(tmp_path, "other_msgs", {"msg/Thing.msg": "int32 x"}))
    assert own.message_class("own_msgs/msg/Stranger")().thing.x == 0


def test_a_package_is_named_by_its_manifest(tmp_path):
    home = package(tmp_path, "from_manifest", {"msg/Thing.msg": "int32 x 5\n"})
    moved = home.rename(tmp_path / "elsewhere")
    own = Registry()
    assert own.add_package(moved) == "from_manifest"
    assert own.names("from_manifest", "msg") == ["Thing"]
    assert own.message_class("from_manifest/msg/Thing")().x == 5
    assert own.folder("from_manifest") == moved
    assert own.path("from_manifest/msg/Thing") == moved / "msg" / "Thing.msg"
    (moved / "package.xml").write_text("<package><name>no/name</name></package>")
    with pytest.raises(DefinitionError, match="no/name"):
        package_name(moved)
    (moved / "package.xml").write_text("<package>")
    with pytest.raises(DefinitionError, match=r"package\.xml"):
        package_name(moved)


def test_the_first_definition_counts_and_others_are_told_of(tmp_path, caplog):
    first = package(tmp_path / "a", "own_msgs", {"msg/A.msg": "int32 x", "msg/B.msg": "int32 x"})
    second = package(
        tmp_path / "b", "own_msgs", {"msg/A.msg": "int32 y", "msg/B.msg": "int32 x # same"}
    )
    own = Registry()
    for folder in (first, second, first):
        own.add_package(folder)
    with caplog.at_level(logging.WARNING, "embedded_ros"):
        assert own.message_class("own_msgs/msg/B")().x == 0
        assert not caplog.messages
        assert own.message_class("own_msgs/msg/A")().x == 0
    (told,) = caplog.messages
    assert told == (
        f"{first}/msg/A.msg is used for own_msgs/msg/A; {second}/msg/A.msg differs from it"
    )


def test_a_standard_type_may_be_replaced_but_not_silently(tmp_path, caplog):
    same = "float64 x\nfloat64 y\nfloat64 z\n"
    files = {"msg/Point.msg": same, "msg/Vector3.msg": same + "float64 w\n", "msg/New.msg": same}
    own = Registry()
    own.add_package(package(tmp_path, "geometry_msgs", files))
    with caplog.at_level(logging.WARNING, "embedded_ros"):
        assert own.type_hash("geometry_msgs/msg/Point") == registry.type_hash(
            "geometry_msgs/msg/Point"
        )
        assert own.message_class("geometry_msgs/msg/New")().z == 0.0
        assert own.message_class("geometry_msgs/msg/Pose")().orientation.w == 1.0
        assert not caplog.messages
        assert own.message_class("geometry_msgs/msg/Twist")().linear.w == 0.0
    assert "geometry_msgs/msg/Vector3 (built in) differs" in caplog.messages[0]


def test_packages_are_found_as_in_a_workspace(tmp_path):
    deep = package(tmp_path / "src" / "group", "deep_msgs", {"msg/A.msg": "int32 x"})
    package(deep, "inner_msgs", {"msg/A.msg": "int32 x"})
    package(tmp_path / "src" / ".hidden", "hidden_msgs", {"msg/A.msg": "int32 x"})
    package(tmp_path / "src" / "left_out", "ignored_msgs", {"msg/A.msg": "int32 x"})
    (tmp_path / "src" / "left_out" / "COLCON_IGNORE").touch()
    package(tmp_path / "src", "code_only", {"code_only/__init__.py": ""})
    package(tmp_path / "src" / "code_only", "below_msgs", {"srv/A.srv": "---"})
    (tmp_path / "src" / "msg").mkdir()
    assert interface_folders(tmp_path) == [deep]
    assert interface_folders(deep) == [deep]
    with pytest.raises(FileNotFoundError, match="nowhere"):
        interface_folders(tmp_path / "nowhere")


def test_packages_of_the_environment(tmp_path):
    own = package(tmp_path / "ws" / "src", "own_msgs", {"msg/A.msg": "int32 x"})
    share = tmp_path / "prefix" / "share"
    installed = package(share, "installed_msgs", {"msg/A.msg": "int32 x", "msg/A.idl": "..."})
    package(share, "no_interfaces", {"config/a.yaml": ""})
    index = share / "ament_index" / "resource_index" / "rosidl_interfaces"
    index.mkdir(parents=True)
    (index / "installed_msgs").write_text("msg/A.idl\nmsg/A.msg")
    nowhere = tmp_path / "no"
    environ = {
        "EMBEDDED_ROS_INTERFACE_PATH": f"{nowhere}{os.pathsep}{tmp_path / 'ws'}",
        "AMENT_PREFIX_PATH": f"{nowhere}{os.pathsep}{tmp_path / 'prefix'}",
    }
    assert list(folders_of_environment(environ)) == [own, installed]
    assert list(folders_of_environment({})) == []


def test_types_are_imported_from_the_search_path(tmp_path):
    package(tmp_path, "own_msgs", {"msg/A.msg": "int32 x 5"})
    package(tmp_path, "broken_msgs", {"msg/A.msg": "int32 x"})
    (tmp_path / "broken_msgs" / "package.xml").write_text("<package>")
    program = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "import embedded_ros\n"
        "embedded_ros.enable()\n"
        "from own_msgs.msg import A\n"
        "print(A())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, "EMBEDDED_ROS_INTERFACE_PATH": str(tmp_path)},
    )
    assert done.stdout == "own_msgs.msg.A(x=5)\n"
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"{tmp_path}/broken_msgs/package.xml: ")


def test_unknown_interfaces_are_key_errors():
    for name in ("std_msgs/msg/No", "std_srvs/srv/No_Request", "nothing/msg/X"):
        with pytest.raises(KeyError):
            registry.spec(name)
