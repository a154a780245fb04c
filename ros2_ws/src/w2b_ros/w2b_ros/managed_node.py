"""A lifecycle node that starts itself if asked to, and that no request can bring down."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from w2b_ros.ros_messages import STEADY

#: Between the shutdown transition and the end of the process: the answer has to get through.
FAREWELL_S = 0.5


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
        """Release what the node holds before the process ends."""
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
