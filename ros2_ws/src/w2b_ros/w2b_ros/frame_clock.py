"""The clock that sensor frames are stamped with: the node's own, or that of a simulation."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.node import Node

from w2b_ros.ros_messages import NS_PER_S, to_stamp

#: Stamps that differ by more from the node's clock are of another one: a simulation's.
OTHER_CLOCK_S = 60.0


class FrameClock:
    """
    Reads the clock of the frames, so that all stamps of a node agree with them.

    Parameters
    ----------
    node
        The node that receives the frames; with `use_sim_time` its clock is theirs anyway.

    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._simulated_ns: int | None = None

    def frame(self, stamp_ns: int) -> None:
        """Take note of a frame's stamp, when it arrives."""
        own_ns = self._node.get_clock().now().nanoseconds
        other = abs(own_ns - stamp_ns) > OTHER_CLOCK_S * NS_PER_S
        self._simulated_ns = stamp_ns if other else None

    def now(self) -> Time:
        """Return the last frame's stamp if frames are on another clock, else the node's time."""
        if self._simulated_ns is not None:
            return to_stamp(self._simulated_ns)
        return self._node.get_clock().now().to_msg()
