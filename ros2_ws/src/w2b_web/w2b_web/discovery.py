"""Which robots there are, from the topics of the ROS graph."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

#: A robot has one of these: a body, a brain, or somebody who publishes joints.
SIGNS = {'body_status': 'diagnostic_msgs/msg/DiagnosticStatus',
         'command_answer': 'diagnostic_msgs/msg/DiagnosticStatus',
         'joint_states': 'sensor_msgs/msg/JointState'}
MOST_ROBOTS = 16


def robots_of(topics: Iterable[tuple[str, Sequence[str]]], own: str) -> list[str]:
    """
    Return the namespaces of robots, the page's own first even if nobody is there.

    Parameters
    ----------
    topics
        Names and types, as `Node.get_topic_names_and_types` has them.
    own
        The page's namespace, empty for the root.

    """
    found = set()
    for topic, kinds in topics:
        namespace, _, name = topic.rpartition('/')
        if name in SIGNS and SIGNS[name] in kinds:
            found.add(namespace)
    return [own, *sorted(found - {own})][:MOST_ROBOTS]
