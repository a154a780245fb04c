"""What the nodes really publish, hear and offer is what the SROS2 policy lets them."""

import pytest

pytest.importorskip('lxml')
from rclpy.node import Node

from tests.deploy.policy import allowed
from w2b_ros.ros_messages import LATCHED


def graph(node, name):
    """Return (kind, direction) -> names of what a node of the graph has."""
    return {
        ('topics', 'publish'): {one for one, _ in node.get_publisher_names_and_types_by_node(
            name, '/')},
        ('topics', 'subscribe'): {one for one, _ in node.get_subscriber_names_and_types_by_node(
            name, '/')},
        ('services', 'reply'): {one for one, _ in node.get_service_names_and_types_by_node(
            name, '/')},
        ('services', 'request'): {one for one, _ in node.get_client_names_and_types_by_node(
            name, '/')}}


def wait_for(system, name, *needed):
    def there():
        if name not in system.node.get_node_names():
            return None
        found = graph(system.node, name)
        names = set().union(*found.values())
        return found if all(one in names for one in needed) else None
    return system.wait(there, f'the node {name} with {needed}')


def check(rules, found):
    for rule, names in found.items():
        if '/*' in rules[rule]:
            continue
        assert names <= rules[rule], rule


def test_every_node_gets_along_with_its_permissions(system):
    rules = allowed()
    system.start('hardware', transport='emulated')
    system.start('brain', controller='physical_twin')
    system.start('description')
    system.wait_for_status('brain: frames', 0, 'sensor frames flow')
    system.wait_for_status('description: robot_description', 0)
    for name, needed in (
            ('brain', ('/joint_trajectory', '/command', '/cmd_vel', '/brain/get_state')),
            ('hardware', ('/joint_states', '/body_status', '/hardware/arm', '/hardware/get_state')),
            ('description', ('/robot_description', '/body_status'))):
        check(rules[f'/w2b/{name}'], wait_for(system, name, *needed))


def test_the_simulation_gets_along_with_its_permissions(system):
    system.start('sim')
    check(allowed()['/w2b/sim'], wait_for(system, 'sim', '/odom', '/body_status', '/contacts',
                                          '/joint_trajectory', '/sim/reset', '/sim/pause'))


def test_a_program_that_commands_without_leave_would_be_denied(system):
    """The comparison sees what is not allowed."""
    from std_msgs.msg import String
    stranger = Node('brain', context=system.node.context)
    try:
        stranger.create_publisher(String, 'command', LATCHED)
        found = wait_for(system, 'brain', '/command')
        with pytest.raises(AssertionError, match='publish'):
            check(allowed()['/w2b/brain'], found)
    finally:
        stranger.destroy_node()
