"""Parameters of a node: declared once, checked when set, refused where they would do nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from enum import Enum
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from w2b_ros.ros_process import StartError

Value = str | float | int | bool
LARGEST_INTEGER = 2**63 - 1


class When(Enum):
    """When a parameter can be set; the value is a part of a sentence."""

    START = 'when the node is started'
    CONFIGURE = 'in the state unconfigured, it counts from the next configure on'
    ACTIVATE = 'in the states unconfigured and inactive, it counts from the next activate on'
    ANY = 'at any time'


_STATES = {When.CONFIGURE: ('unconfigured',), When.ACTIVATE: ('unconfigured', 'inactive')}
_TODO = {When.CONFIGURE: 'deactivate, then cleanup', When.ACTIVATE: 'deactivate'}


@dataclass(frozen=True)
class Parameter:
    """
    A parameter of a node.

    Attributes
    ----------
    name, default, description
        As ROS shows them. A whole number will do for any number.
    range
        Least and greatest value of a number.
    when
        When it can be set; at another time it is refused, with what to do.
    topic
        Whether it is the name of a topic, relative to the node's namespace.
    check
        Raises ValueError, with what was expected, for a value that will not do. What is loaded when
        the node is configured is checked then, and by `check` when it is set.

    """

    name: str
    default: Value
    description: str
    range: tuple[float, float] | None = None
    when: When = When.ANY
    topic: bool = False
    check: Callable[[Any], object] | None = None

    def descriptor(self) -> ParameterDescriptor:
        """Return what ROS shows of it."""
        descriptor = ParameterDescriptor(
            description=self.description, read_only=self.when is When.START,
            additional_constraints=f'Can be set {self.when.value}.')
        if self.range is not None:
            low, high = self.range
            if isinstance(self.default, int):
                descriptor.integer_range = [
                    IntegerRange(from_value=int(low), to_value=int(high), step=1)]
            else:
                descriptor.floating_point_range = [
                    FloatingPointRange(from_value=low, to_value=high, step=0.0)]
        return descriptor


def declare(node: Node, parameters: Sequence[Parameter], *, state: Callable[[], str] = str,
            applied: Callable[[], None] | None = None) -> None:
    """
    Declare a node's parameters, and check what was given at the start (StartError).

    Parameters
    ----------
    node
        The node.
    parameters
        Its parameters.
    state
        Returns the state of its life cycle; without one no parameter depends on it.
    applied
        Called after parameters were set while the node runs.

    """
    known = {parameter.name: parameter for parameter in parameters}

    def as_numbers(given: list[RosParameter]) -> list[RosParameter]:
        return [RosParameter(one.name, RosParameter.Type.DOUBLE, float(one.value))
                if one.name in known and isinstance(known[one.name].default, float)
                and one.type_ == RosParameter.Type.INTEGER else one for one in given]
    # What was given at the start; ROS takes only a DOUBLE for a DOUBLE.
    node._parameter_overrides.update({
        one.name: one for one in as_numbers(list(node._parameter_overrides.values()))})
    node.add_pre_set_parameters_callback(as_numbers)
    for parameter in parameters:
        value = node.declare_parameter(
            parameter.name, parameter.default, parameter.descriptor()).value
        if parameter.when is not When.CONFIGURE:
            try:
                _check(node, parameter, value)
            except ValueError as error:
                raise StartError(f'{parameter.name}: {error}') from error
    _warn_of_unknown(node, list(known))

    def refuse(given: list[RosParameter]) -> SetParametersResult:
        for one in given:
            if one.name in known:
                reason = _refusal(node, known[one.name], one.value, state())
                if reason:
                    return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)
    node.add_on_set_parameters_callback(refuse)
    _say_when(node, known)
    if applied is not None:
        node.add_post_set_parameters_callback(lambda _given: applied())


def _refusal(node: Node, parameter: Parameter, value: Value, state: str) -> str:
    """Return why a value cannot be set now, empty if it can."""
    if value == node.get_parameter(parameter.name).value:
        return ''
    states = _STATES.get(parameter.when)
    if states is not None and state not in states:
        return (f'{parameter.name}: can be set {parameter.when.value}; the node is {state}: '
                f'{_TODO[parameter.when]} it first (ros2 lifecycle set '
                f'{node.get_fully_qualified_name()} deactivate)')
    try:
        _check(node, parameter, value)
    except (ValueError, OSError) as error:
        return f'{parameter.name}: {" ".join(str(error).split())}'
    return ''


def _check(node: Node, parameter: Parameter, value: Any) -> None:
    """Raise ValueError or OSError, with what was expected, for a value that will not do."""
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f'expected a finite number, got {value}')
    if parameter.topic:
        try:
            node.resolve_topic_name(value)
        except rclpy_implementation.RCLError as error:
            raise ValueError(f'expected the name of a topic, got {value!r} '
                             f'({str(error).split(", at ")[0]})') from error
    if parameter.check is not None:
        parameter.check(value)


def check_frame_id(value: str) -> None:
    """Raise ValueError unless a value can be the name of a frame (tf2 takes no leading slash)."""
    if not value or value.startswith('/') or not all(
            character.isprintable() and not character.isspace() for character in value):
        raise ValueError('expected the name of a frame, without spaces and a leading slash, '
                         f'got {value!r}')


def _say_when(node: Node, known: dict[str, Parameter]) -> None:
    """Make the refusal of a parameter that ROS guards itself say when it can be set."""
    atomically = node.set_parameters_atomically

    def set_parameters_atomically(given: list[RosParameter]) -> SetParametersResult:
        result = atomically(given)
        fixed = [one.name for one in given if one.name in known
                 and known[one.name].when is When.START]
        if not result.successful and fixed and 'read-only' in result.reason:
            result.reason = (f'{fixed[0]}: read-only while the node runs: start it again with '
                             f'--ros-args -p {fixed[0]}:=VALUE')
        return result
    setattr(node, 'set_parameters_atomically', set_parameters_atomically)  # noqa: B010


def _warn_of_unknown(node: Node, names: list[str]) -> None:
    """Warn of what was given at the start and is no parameter; a shared file may hold others'."""
    for given in node._parameter_overrides:
        if not node.has_parameter(given) and not given.startswith('qos_overrides.'):
            near = get_close_matches(given, names, 1)
            node.get_logger().warning(f'ignored: no parameter {given!r} here'
                                      + (f'; did you mean {near[0]!r}?' if near else ''))
