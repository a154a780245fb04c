"""Twists on `cmd_vel` for the brain: they move the robot as words do, for as long as they come."""

from __future__ import annotations

from collections.abc import Callable

from geometry_msgs.msg import Twist
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from w2b_core.status import Status
from w2b_core.twist import TwistDriver, TwistRefusedError, Velocity
from w2b_ros.ros_messages import STEADY

#: The newest alone counts, and one that got lost is not sent again: it would come late.
TWISTS_IN = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
#: How often it is looked whether velocities have ended.
CHECK_S = 0.05


class TwistInput:
    """
    Listens to Twists.

    Parameters
    ----------
    node
        The brain's node.
    topic
        Where velocities are published.
    driver
        Decides which of them count.
    hear, stand, renew
        Called with a word to hear, with the reason to stand, and when a velocity goes on.

    """

    def __init__(self, node: Node, topic: str, driver: TwistDriver, *, hear: Callable[[str], None],
                 stand: Callable[[str], None], renew: Callable[[], None]) -> None:
        self._node, self._topic, self.driver = node, topic, driver
        self._hear, self._stand, self._renew = hear, stand, renew
        self._subscription = node.create_subscription(Twist, topic, self._on_twist, TWISTS_IN)
        self._timer = node.create_timer(CHECK_S, self.check, clock=STEADY)

    def close(self) -> None:
        """Listen no more."""
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._subscription)

    def check(self) -> None:
        """Let the robot stand if velocities have ended."""
        reason = self.driver.expired()
        if reason:
            self._stand(f'{reason} (cmd_vel)')

    def block(self, reason: str) -> None:
        """Follow no velocity that is held since before; let a robot stand that one moved."""
        if self.driver.block(reason):
            self._stand(reason)

    def status(self) -> Status:
        """Return how it is."""
        return self.driver.status(self._node.count_publishers(self._topic))

    def _on_twist(self, message: Twist) -> None:
        linear, angular = message.linear, message.angular
        velocity = Velocity((linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z))
        self.check()
        moved = self.driver.driving
        try:
            word = self.driver.take(velocity)
        except TwistRefusedError as error:
            if moved:
                self._stand(f'Twist refused: {error}')
            return
        if word:
            self._hear(word)
        elif moved and not self.driver.driving:
            self._stand('a Twist of zero came')
        elif self.driver.driving:
            # A zero that stops nothing renews nothing either: not the word that somebody said.
            self._renew()
