"""A lifecycle node that starts itself if asked to, and that no request can bring down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from w2b_ros.ros_messages import STEADY

#: Between the shutdown transition and the end of the process: the answer has to get through.
FAREWELL_S = 0.5


@dataclass(frozen=True)
class Parameter:
    """
    A parameter of a node: its default, what it means, and its range if it is a number.

    A `fixed` one is given at the start and cannot be changed while the node runs.
    """

    name: str
    default: str | float | int | bool
    description: str
    range: tuple[float, float] | None = None
    fixed: bool = False


def declare(node: Node, parameters: tuple[Parameter, ...]) -> None:
    """Declare parameters with descriptions and ranges; a whole number will do for any number."""
    numbers = {parameter.name for parameter in parameters if isinstance(parameter.default, float)}

    def as_numbers(given: list[RosParameter]) -> list[RosParameter]:
        return [RosParameter(one.name, RosParameter.Type.DOUBLE, float(one.value))
                if one.name in numbers and one.type_ == RosParameter.Type.INTEGER else one
                for one in given]
    # What was given at the start; ROS takes only a DOUBLE for a DOUBLE.
    node._parameter_overrides.update({
        one.name: one for one in as_numbers(list(node._parameter_overrides.values()))})
    node.add_pre_set_parameters_callback(as_numbers)
    for parameter in parameters:
        descriptor = ParameterDescriptor(description=parameter.description,
                                         read_only=parameter.fixed)
        if parameter.range is not None:
            low, high = parameter.range
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=low, to_value=high, step=0.0)]
        node.declare_parameter(parameter.name, parameter.default, descriptor)
    _warn_of_unknown(node, [parameter.name for parameter in parameters])


def _warn_of_unknown(node: Node, names: list[str]) -> None:
    """Warn of what was given at the start and is no parameter; a shared file may hold others'."""
    for given in node._parameter_overrides:
        if not node.has_parameter(given) and not given.startswith('qos_overrides.'):
            near = get_close_matches(given, names, 1)
            node.get_logger().warning(f'ignored: no parameter {given!r} here'
                                      + (f'; did you mean {near[0]!r}?' if near else ''))


class ManagedNode(LifecycleNode):
    """
    A lifecycle node with autostart and one-line errors.

    Subclasses define `configure`, `activate`, `deactivate` and `cleanup`, which raise an error of
    `expected_errors` to refuse; `exit_code` is None until the process shall end.
    """

    expected_errors: tuple[type[Exception], ...] = (ValueError, OSError)

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.exit_code: int | None = None
        # rclpy 7.1 raises out of the executor when a transition is requested that the state does
        # not have, which would end the process.
        self._rclpy_change_state = self._service_change_state.callback
        self._service_change_state.callback = self._change_state

    def _change_state(self, request: ChangeState.Request,
                      response: ChangeState.Response) -> ChangeState.Response:
        try:
            return self._rclpy_change_state(request, response)
        except rclpy_implementation.RCLError:
            asked = request.transition.label or request.transition.id
            self.get_logger().error(f'no transition {asked!r} from the state {self.state_label!r}')
            response.success = False
            return response

    @property
    def state_label(self) -> str:
        """The state of the lifecycle: unconfigured, inactive, active or finalized."""
        return str(self._state_machine.current_state[1])

    def autostart(self) -> None:
        """Configure and activate; a refusal ends the process with exit code 1."""
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() != TransitionCallbackReturn.SUCCESS:
                self.exit_code = 1
                return

    def configure(self) -> None:
        """Load what the node needs."""

    def activate(self) -> None:
        """Begin to act."""

    def deactivate(self) -> None:
        """Stop acting."""

    def cleanup(self) -> None:
        """Let go of what `configure` loaded."""

    def close(self) -> None:
        """Do the last things before the process ends."""
        if self.state_label == 'active':
            self.trigger_deactivate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Handle the configure transition."""
        return self._try(self.configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Handle the activate transition."""
        return self._try(self.activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Handle the deactivate transition."""
        return self._try(self.deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Handle the cleanup transition."""
        return self._try(self.cleanup)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Handle the shutdown transition: the process ends."""
        if state.label == 'active':
            self._try(self.deactivate)
        self.create_timer(FAREWELL_S, self._end, clock=STEADY)
        return self._try(self.cleanup)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Handle a failed transition: back to unconfigured, with nothing held."""
        self._try(self.deactivate)
        return self._try(self.cleanup)

    def _end(self) -> None:
        self.exit_code = 0

    def _try(self, act: Callable[[], None]) -> TransitionCallbackReturn:
        try:
            act()
        except self.expected_errors as error:
            self.get_logger().error(' '.join(str(error).split()))
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            # rclpy swallows it without a word.
            self.get_logger().error(f'{act.__name__}: {type(error).__name__}: {error}')
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS
