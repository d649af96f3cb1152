# SPDX-License-Identifier: Apache-2.0
"""Parameters and their values."""

from __future__ import annotations

import array
from enum import Enum
from typing import Any

import yaml  # type: ignore[import-untyped]
from rcl_interfaces.msg import Parameter as ParameterMsg
from rcl_interfaces.msg import ParameterType, ParameterValue

PARAMETER_SEPARATOR_STRING = "."

#: types whose value the message keeps in ``<name>_value``
_MEMBERS = {
    ParameterType.PARAMETER_BOOL: "bool_value",
    ParameterType.PARAMETER_INTEGER: "integer_value",
    ParameterType.PARAMETER_DOUBLE: "double_value",
    ParameterType.PARAMETER_STRING: "string_value",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte_array_value",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool_array_value",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer_array_value",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double_array_value",
    ParameterType.PARAMETER_STRING_ARRAY: "string_array_value",
}


class Parameter:
    """A name, a type and a value."""

    class Type(Enum):
        """What a parameter may hold."""

        NOT_SET = ParameterType.PARAMETER_NOT_SET
        BOOL = ParameterType.PARAMETER_BOOL
        INTEGER = ParameterType.PARAMETER_INTEGER
        DOUBLE = ParameterType.PARAMETER_DOUBLE
        STRING = ParameterType.PARAMETER_STRING
        BYTE_ARRAY = ParameterType.PARAMETER_BYTE_ARRAY
        BOOL_ARRAY = ParameterType.PARAMETER_BOOL_ARRAY
        INTEGER_ARRAY = ParameterType.PARAMETER_INTEGER_ARRAY
        DOUBLE_ARRAY = ParameterType.PARAMETER_DOUBLE_ARRAY
        STRING_ARRAY = ParameterType.PARAMETER_STRING_ARRAY

        @classmethod
        def from_parameter_value(cls, parameter_value: Any) -> Parameter.Type:
            """The type of a Python value; an empty list counts as bytes.

            :raises TypeError: no parameter can hold the value.
            """
            if parameter_value is None:
                return cls.NOT_SET
            for python_type, scalar in _SCALARS:
                if isinstance(parameter_value, python_type):
                    return cls[scalar]
            if isinstance(parameter_value, (list, tuple, array.array)):
                for python_type, scalar in ((bytes, "BYTE"), *_SCALARS):
                    if all(isinstance(item, python_type) for item in parameter_value):
                        return cls[scalar + "_ARRAY"]
                raise TypeError(
                    f"The given value is not a list of one of the allowed types "
                    f"'{parameter_value}'."
                )
            raise TypeError(f"The given value is not one of the allowed types '{parameter_value}'.")

        def check(self, parameter_value: Any) -> bool:
            """Whether a Python value is of this type."""
            if self is Parameter.Type.NOT_SET:
                return parameter_value is None
            scalars = {name: python_type for python_type, name in _SCALARS}
            if self.name in scalars:
                return isinstance(parameter_value, scalars[self.name])
            sequences: tuple[type, ...] = (list, tuple)
            if self in (Parameter.Type.INTEGER_ARRAY, Parameter.Type.DOUBLE_ARRAY):
                sequences = (list, tuple, array.array)
            if not isinstance(parameter_value, sequences):
                return False
            items: Any = parameter_value
            if self is Parameter.Type.BYTE_ARRAY:
                return all(isinstance(item, bytes) and len(item) == 1 for item in items)
            kind = scalars[self.name.removesuffix("_ARRAY")]
            return all(isinstance(item, kind) for item in items)

    def __init__(self, name: str, type_: Parameter.Type | None = None, value: Any = None) -> None:
        """Make a parameter; the type is found from the value where it is not given.

        :raises TypeError: the value is of no type that a parameter can hold, or ``type_`` is no
            type.
        :raises ValueError: type and value do not agree.
        """
        if type_ is None:
            type_ = Parameter.Type.from_parameter_value(value)
        if not isinstance(type_, Parameter.Type):
            raise TypeError(f"type must be an instance of '{Parameter.Type!r}'")
        if not type_.check(value):
            raise ValueError(f"Type '{type_}' and value '{value}' do not agree")
        self._type_ = type_
        self._name = name
        self._value = value

    @classmethod
    def from_parameter_msg(cls, param_msg: Any) -> Parameter:
        """From rcl_interfaces/msg/Parameter."""
        member = _MEMBERS.get(param_msg.value.type)
        value = getattr(param_msg.value, member) if member else None
        return cls(param_msg.name, Parameter.Type(param_msg.value.type), value)

    @property
    def name(self) -> str:
        """The full name."""
        return self._name

    @property
    def type_(self) -> Parameter.Type:
        """The type."""
        return self._type_

    @property
    def value(self) -> Any:
        """The value, None when not set."""
        return self._value

    def __repr__(self) -> str:
        return f"Parameter(name={self._name!r}, type_={self._type_.name}, value={self._value!r})"

    def get_parameter_value(self) -> Any:
        """As rcl_interfaces/msg/ParameterValue."""
        message = ParameterValue(type=self._type_.value)
        member = _MEMBERS.get(self._type_.value)
        if member:
            setattr(message, member, self._value)
        return message

    def to_parameter_msg(self) -> Any:
        """As rcl_interfaces/msg/Parameter."""
        return ParameterMsg(name=self._name, value=self.get_parameter_value())


# bool comes before int, which it is a kind of
_SCALARS: tuple[tuple[type, str], ...] = (
    (bool, "BOOL"),
    (int, "INTEGER"),
    (float, "DOUBLE"),
    (str, "STRING"),
)


def get_parameter_value(string_value: str) -> Any:
    """Guess from text what value is meant, as the command line tools do; text that is nothing else
    stays text.
    """
    try:
        value = yaml.safe_load(string_value)
    except yaml.YAMLError:
        value = string_value
    if value is None:
        value = string_value
    try:
        kind = Parameter.Type.from_parameter_value(value)
    except TypeError:
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=string_value)
    if value == []:
        kind = Parameter.Type.BOOL_ARRAY
    return Parameter("", kind, value).get_parameter_value()


def parameter_value_to_python(parameter_value: Any) -> Any:
    """The value that a ParameterValue message holds, arrays as lists.

    :raises RuntimeError: its type is unknown.
    """
    if parameter_value.type == ParameterType.PARAMETER_NOT_SET:
        return None
    member = _MEMBERS.get(parameter_value.type)
    if member is None:
        raise RuntimeError(f"unexpected parameter type {parameter_value.type}")
    value = getattr(parameter_value, member)
    return list(value) if member.endswith("array_value") else value


def parameter_dict_from_yaml_file(
    parameter_file: str,
    use_wildcard: bool = False,
    target_nodes: list[str] | None = None,
    namespace: str = "",
) -> dict[str, Any]:
    """Parameter messages by name from a parameter file, of some nodes or of all.

    :raises RuntimeError: a wanted node is not in the file, or the file is no parameter file.
    """
    with open(parameter_file, encoding="utf-8") as stream:
        tree = yaml.safe_load(stream)
    keys = ["/**"] if use_wildcard and "/**" in tree else []
    if target_nodes:
        for node in target_nodes:
            if node not in tree:
                raise RuntimeError(
                    f"Param file does not contain parameters for {node}, only for nodes: "
                    f"{list(tree)}"
                )
        keys += target_nodes
    else:
        keys += [key for key in tree if key != "/**"]
    if not keys:
        raise RuntimeError("Param file does not contain selected parameters")
    wanted: dict[str, Any] = {}
    for key in keys:
        branch = tree[key]
        if not isinstance(branch, dict) or "ros__parameters" not in branch:
            raise RuntimeError(f"YAML file is not a valid ROS parameter file for node {key}")
        wanted.update(branch["ros__parameters"])
    return _messages(wanted, namespace)


def _messages(tree: dict[str, Any], prefix: str) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            result.update(_messages(value, name + PARAMETER_SEPARATOR_STRING))
        else:
            result[name] = ParameterMsg(name=name, value=get_parameter_value(str(value)))
    return result
