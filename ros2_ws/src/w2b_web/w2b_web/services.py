"""What a page asks a body to do: services, each answered in time or said to be silent."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

#: By then a service has answered, or its node hangs.
ANSWER_S = 3.0
#: What is asked for -> service, its type, its request.
CALLS: dict[str, tuple[str, type, Callable[[], Any]]] = {
    'arm': ('hardware/arm', Trigger, Trigger.Request),
    'disarm': ('hardware/disarm', Trigger, Trigger.Request),
    'emergency_stop': ('hardware/emergency_stop', Trigger, Trigger.Request),
    'reset': ('sim/reset', Trigger, Trigger.Request),
    'pause': ('sim/pause', SetBool, lambda: SetBool.Request(data=True)),
    'resume': ('sim/pause', SetBool, lambda: SetBool.Request(data=False))}
Answered = Callable[[bool, str], None]


class Services:
    """
    The services of one robot.

    Parameters
    ----------
    node
        The node that asks.
    namespace
        Of the robot, empty for the root.

    """

    def __init__(self, node: Node, namespace: str) -> None:
        self._node = node
        self._waiting: list[tuple[float, str, Any, Answered]] = []
        self._clients = {name: node.create_client(kind, f'{namespace}/{name}')
                         for name, kind in {service: kind for service, kind, _make in
                                            CALLS.values()}.items()}
        self._clients['sim/set_parameters'] = node.create_client(
            SetParameters, f'{namespace}/sim/set_parameters')
        self._clients['brain/get_parameters'] = node.create_client(
            GetParameters, f'{namespace}/brain/get_parameters')

    def close(self) -> None:
        """Stop asking."""
        for client in self._clients.values():
            self._node.destroy_client(client)

    def ready(self, do: str) -> bool:
        """Return whether somebody offers what is asked for."""
        return bool(self._clients[CALLS[do][0]].service_is_ready())

    def call(self, do: str, answered: Answered) -> None:
        """Ask for one of `CALLS`; `answered` gets whether it was done, and what was said."""
        service, _kind, make = CALLS[do]
        self._ask(service, make(), lambda response: answered(response.success, response.message),
                  answered)

    def set_speed(self, factor: float, answered: Answered) -> None:
        """Ask a simulation for another speed."""
        value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=factor)
        request = SetParameters.Request(
            parameters=[Parameter(name='real_time_factor', value=value)])
        self._ask('sim/set_parameters', request, lambda response: answered(
            response.results[0].successful,
            response.results[0].reason or f'simulated at {factor:g} times real time'), answered)

    def controller(self, found: Callable[[str], None]) -> None:
        """Ask the brain for the name of its controller."""
        self._ask('brain/get_parameters', GetParameters.Request(names=['controller']),
                  lambda response: found(response.values[0].string_value)
                  if response.values else None, lambda _done, _said: None)

    def _ask(self, service: str, request: Any, done: Callable[[Any], None],
             answered: Answered) -> None:
        client = self._clients[service]
        if not client.service_is_ready():
            answered(False, f'nobody offers {service} here')
            return
        entry = (time.monotonic() + ANSWER_S, service, client, answered)
        self._waiting.append(entry)
        future = client.call_async(request)

        def finish(future: Any) -> None:
            if entry in self._waiting:
                self._waiting.remove(entry)
                done(future.result())
        future.add_done_callback(finish)

    def check(self) -> None:
        """Say of services that did not answer in time that they are silent."""
        now_s = time.monotonic()
        for entry in [entry for entry in self._waiting if entry[0] < now_s]:
            self._waiting.remove(entry)
            entry[3](False, f'{entry[1]} did not answer within {ANSWER_S:g} s: its node hangs or '
                     'is gone')
