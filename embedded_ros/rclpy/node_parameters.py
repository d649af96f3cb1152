# SPDX-License-Identifier: Apache-2.0
"""The part of a node that keeps its parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterEvent,
    SetParametersResult,
)

from .exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from .impl.parameter_checks import (
    PARAM_REL_TOL,
    apply_descriptor,
    failure,
    read_declaration,
)
from .parameter import PARAMETER_SEPARATOR_STRING, Parameter

if TYPE_CHECKING:
    from .clock import ROSClock
    from .publisher import Publisher

PreSet = Callable[[list[Parameter]], list[Parameter]]
OnSet = Callable[[list[Parameter]], Any]
PostSet = Callable[[list[Parameter]], None]


class ParameterHolder:
    """Declares, checks, sets and announces parameters."""

    PARAM_REL_TOL = PARAM_REL_TOL

    _clock: ROSClock
    _parameter_event_publisher: Publisher

    def __init__(self, allow_undeclared_parameters: bool) -> None:
        self._parameters: dict[str, Parameter] = {}
        self._descriptors: dict[str, Any] = {}
        self._parameter_overrides: dict[str, Parameter] = {}
        self._allow_undeclared_parameters = allow_undeclared_parameters
        self._pre_set_parameters_callbacks: list[PreSet] = []
        self._on_set_parameters_callbacks: list[OnSet] = []
        self._post_set_parameters_callbacks: list[PostSet] = []

    def get_fully_qualified_name(self) -> str:
        raise NotImplementedError

    def declare_parameter(
        self, name: str, value: Any = None, descriptor: Any = None, ignore_override: bool = False
    ) -> Parameter:
        """Declare a parameter with a default value, or with a type and no value.

        The value of the command line, a parameter file or the node's constructor beats the default.

        :param value: default value or Parameter.Type.
        :raises ParameterAlreadyDeclaredException: it is declared already.
        :raises InvalidParameterException: the name is invalid.
        :raises InvalidParameterTypeException: the overriding value has another type than the
            default.
        :raises InvalidParameterValueException: a callback or the descriptor refuses the value.
        """
        if value is None and descriptor is None:
            entry: tuple[Any, ...] = (name,)
        else:
            entry = (name, value, ParameterDescriptor() if descriptor is None else descriptor)
        return self.declare_parameters("", [entry], ignore_override)[0]

    def declare_parameters(
        self, namespace: str, parameters: Iterable[tuple[Any, ...]], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare several: tuples of name, value or type, and descriptor. Names get ``namespace.``
        in front.

        :raises TypeError: a tuple has another shape.
        """
        wanted: list[Parameter] = []
        descriptors: dict[str, Any] = {}
        for index, entry in enumerate(parameters):
            if not 1 <= len(entry) <= 3:
                raise TypeError(
                    f"Invalid parameter tuple length at index {index} in parameters list: {entry}; "
                    "expecting length between 1 and 3"
                )
            name, value, descriptor = read_declaration(namespace, index, entry)
            if not ignore_override and name in self._parameter_overrides:
                value = self._parameter_overrides[name].value
            wanted.append(Parameter(name, value=value))
            descriptors[name] = descriptor
        declared = [parameter.name for parameter in wanted if parameter.name in self._parameters]
        if declared:
            raise ParameterAlreadyDeclaredException(declared)
        for parameter in wanted:
            result = self._ros_set_checked([parameter], descriptors, allow_not_set_type=True)
            if not result.successful:
                if result.reason.startswith("Wrong parameter type"):
                    expected = Parameter.Type(descriptors[parameter.name].type).name
                    raise InvalidParameterTypeException(parameter, expected)
                raise InvalidParameterValueException(parameter.name, parameter.value, result.reason)
        return [self._parameters[parameter.name] for parameter in wanted]

    def undeclare_parameter(self, name: str) -> None:
        """Forget a parameter.

        :raises ParameterNotDeclaredException: it is not declared.
        :raises ParameterImmutableException: it is read-only.
        """
        if name not in self._parameters:
            raise ParameterNotDeclaredException(name)
        if self._descriptors[name].read_only:
            raise ParameterImmutableException(name)
        del self._parameters[name]
        del self._descriptors[name]

    def has_parameter(self, name: str) -> bool:
        """Whether a parameter is declared."""
        return name in self._parameters

    def get_parameter_type(self, name: str) -> Any:
        """The type of a parameter.

        :raises ParameterNotDeclaredException: it is not declared.
        """
        if name in self._parameters:
            return self._parameters[name].type_.value
        if self._allow_undeclared_parameters:
            return Parameter.Type.NOT_SET
        raise ParameterNotDeclaredException(name)

    def get_parameter_types(self, names: list[str]) -> list[Any]:
        """The types of several parameters."""
        self._ros_check_names(names)
        return [self.get_parameter_type(name) for name in names]

    @staticmethod
    def _ros_check_names(names: list[str]) -> None:
        if not all(isinstance(name, str) for name in names):
            raise TypeError("All names must be instances of type str")

    def get_parameter(self, name: str) -> Parameter:
        """A parameter.

        :raises ParameterNotDeclaredException: it is not declared.
        :raises ParameterUninitializedException: it is statically typed and has no value yet.
        """
        if name in self._parameters:
            parameter = self._parameters[name]
            if parameter.type_ != Parameter.Type.NOT_SET or self._descriptors[name].dynamic_typing:
                return parameter
            raise ParameterUninitializedException(name)
        if self._allow_undeclared_parameters:
            return Parameter(name, Parameter.Type.NOT_SET, None)
        raise ParameterNotDeclaredException(name)

    def get_parameters(self, names: list[str]) -> list[Parameter]:
        """Several parameters; see :meth:`get_parameter`."""
        self._ros_check_names(names)
        return [self.get_parameter(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """A parameter, or the alternative when it is undeclared or has no value."""
        parameter = self._parameters.get(name)
        if parameter is not None and parameter.type_ != Parameter.Type.NOT_SET:
            return parameter
        return (
            Parameter(name, Parameter.Type.NOT_SET)
            if alternative_value is None
            else alternative_value
        )

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Parameters named ``prefix.rest``, by ``rest``."""
        start = prefix + PARAMETER_SEPARATOR_STRING if prefix else ""
        return {
            name[len(start) :]: parameter
            for name, parameter in self._parameters.items()
            if name.startswith(start)
        }

    def set_parameters(self, parameter_list: list[Parameter]) -> list[Any]:
        """Set parameters one after the other and return a result for each.

        :raises ParameterNotDeclaredException: one is undeclared and that is not allowed.
        """
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> Any:
        """Set all parameters or none.

        :raises ParameterNotDeclaredException: one is undeclared and that is not allowed.
        """
        if self._pre_set_parameters_callbacks:
            before = parameter_list
            parameter_list = [
                p for callback in self._pre_set_parameters_callbacks for p in callback(before)
            ]
            if not parameter_list:
                return failure(
                    "parameter list cannot be empty, this might be due to "
                    "pre_set_parameters_callback "
                    "modifying the original parameters list."
                )
        if not all(isinstance(parameter, Parameter) for parameter in parameter_list):
            raise TypeError(f"parameter must be instance of type '{Parameter!r}'")
        unknown = [p.name for p in parameter_list if p.name not in self._parameters]
        if unknown and not self._allow_undeclared_parameters:
            raise ParameterNotDeclaredException(unknown)
        return self._ros_set_checked(parameter_list)

    def _ros_set_checked(
        self,
        parameter_list: list[Parameter],
        descriptors: dict[str, Any] | None = None,
        allow_not_set_type: bool = False,
    ) -> Any:
        """Apply descriptors (new ones, or those known), ask the callbacks, store, announce."""
        known = self._descriptors if descriptors is None else descriptors
        for parameter in parameter_list:
            if parameter.name in known:
                name = parameter.name
                declared = name in self._parameters
                result = apply_descriptor(parameter, known[name], declared, descriptors is None)
                if not result.successful:
                    return result
        for callback in self._on_set_parameters_callbacks:
            result = callback(parameter_list)
            if not result.successful:
                return result
        event = ParameterEvent(node=self.get_fully_qualified_name())
        for parameter in parameter_list:
            name = parameter.name
            if parameter.type_ == Parameter.Type.NOT_SET and not allow_not_set_type:
                event.deleted_parameters.append(parameter.to_parameter_msg())
                self._parameters.pop(name, None)
                self._descriptors.pop(name, None)
                continue
            if descriptors is not None:
                self._descriptors[name] = descriptors[name]
            elif name not in self._descriptors:
                self._descriptors[name] = ParameterDescriptor(name=name, dynamic_typing=True)
            is_new = self.get_parameter_or(name).type_ == Parameter.Type.NOT_SET
            changes = event.new_parameters if is_new else event.changed_parameters
            changes.append(parameter.to_parameter_msg())
            self._parameters[name] = parameter
        event.stamp = self._clock.now().to_msg()
        self._parameter_event_publisher.publish(event)
        for post in self._post_set_parameters_callbacks:
            post(parameter_list)
        return SetParametersResult(successful=True)

    def list_parameters(self, prefixes: list[str], depth: int) -> Any:
        """Names and prefixes of parameters below ``prefixes`` (none: all), at most ``depth`` levels
        (0: any).

        :raises TypeError: an argument has another type.
        :raises ValueError: ``depth`` is negative.
        """
        if not isinstance(prefixes, list):
            raise TypeError("The prefixes argument must be a list")
        if not all(isinstance(prefix, str) for prefix in prefixes):
            raise TypeError("All prefixes must be instances of type str")
        if not isinstance(depth, int):
            raise TypeError("The depth must be instance of type int")
        if depth < 0:
            raise ValueError("The depth must be greater than or equal to zero")
        result = ListParametersResult()

        def fits(name: str) -> bool:
            return depth == 0 or name.count(PARAMETER_SEPARATOR_STRING) < depth

        for name in self._parameters:
            below = [
                name == prefix
                or (
                    name.startswith(prefix + PARAMETER_SEPARATOR_STRING)
                    and fits(name[len(prefix) + 1 :])
                )
                for prefix in prefixes
            ]
            if any(below) if prefixes else fits(name):
                result.names.append(name)
                prefix = name.rpartition(PARAMETER_SEPARATOR_STRING)[0]
                if prefix and prefix not in result.prefixes:
                    result.prefixes.append(prefix)
        return result

    def describe_parameter(self, name: str) -> Any:
        """The descriptor of a parameter.

        :raises ParameterNotDeclaredException: it is not declared.
        """
        if name in self._descriptors:
            return self._descriptors[name]
        if self._allow_undeclared_parameters:
            return ParameterDescriptor()
        raise ParameterNotDeclaredException(name)

    def describe_parameters(self, names: list[str]) -> list[Any]:
        """The descriptors of several parameters."""
        return [self.describe_parameter(name) for name in names]

    def set_descriptor(self, name: str, descriptor: Any, alternative_value: Any = None) -> Any:
        """Give a parameter a new descriptor; where its value does not fit, the alternative takes
        its place.

        :raises InvalidParameterValueException: neither value fits.
        """
        if name not in self._parameters:
            if not self._allow_undeclared_parameters:
                raise ParameterNotDeclaredException(name)
            return self.get_parameter(name).get_parameter_value()
        if self._descriptors[name].read_only:
            raise ParameterImmutableException(name)
        current = self.get_parameter(name)
        candidates = [current]
        if alternative_value is not None:
            from rcl_interfaces.msg import Parameter as ParameterMsg

            message = ParameterMsg(name=name, value=alternative_value)
            candidates.append(Parameter.from_parameter_msg(message))
        for candidate in candidates:
            result = apply_descriptor(candidate, descriptor, True, False)
            if result.successful:
                result = self._ros_set_checked([candidate], {name: descriptor})
            if result.successful:
                return self.get_parameter(name).get_parameter_value()
        raise InvalidParameterValueException(name, candidates[-1].value, result.reason)

    def add_pre_set_parameters_callback(self, callback: PreSet) -> None:
        """Have ``callback`` change the list of parameters before they are checked and set."""
        self._pre_set_parameters_callbacks.insert(0, callback)

    def add_on_set_parameters_callback(self, callback: OnSet) -> None:
        """Have ``callback`` accept or refuse values: it returns a SetParametersResult."""
        self._on_set_parameters_callbacks.insert(0, callback)

    def add_post_set_parameters_callback(self, callback: PostSet) -> None:
        """Have ``callback`` told of parameters that were set."""
        self._post_set_parameters_callbacks.insert(0, callback)

    def remove_pre_set_parameters_callback(self, callback: PreSet) -> None:
        """:raises ValueError: the callback was not added."""
        self._pre_set_parameters_callbacks.remove(callback)

    def remove_on_set_parameters_callback(self, callback: OnSet) -> None:
        """:raises ValueError: the callback was not added."""
        self._on_set_parameters_callbacks.remove(callback)

    def remove_post_set_parameters_callback(self, callback: PostSet) -> None:
        """:raises ValueError: the callback was not added."""
        self._post_set_parameters_callbacks.remove(callback)
