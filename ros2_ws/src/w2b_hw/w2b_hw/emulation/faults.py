"""A transport that injects faults into transfers, as a bad wire does."""

from __future__ import annotations

import errno
from collections import deque
from collections.abc import Callable, Sequence

from w2b_hw.i2c import Message, Read, Transport, Write

#: Spoils one transfer: gets the transport and the messages, returns what the Reads got.
Fault = Callable[[Transport, Sequence[Message]], list[bytes]]


def no_acknowledge(transport: Transport, messages: Sequence[Message]) -> list[bytes]:
    """No chip acknowledges the address (errno 121)."""
    raise OSError(errno.EREMOTEIO, 'injected: no acknowledge')


def bus_held(transport: Transport, messages: Sequence[Message]) -> list[bytes]:
    """SDA is held low until the kernel gives up (errno 110)."""
    raise OSError(errno.ETIMEDOUT, 'injected: the bus is held')


def cut_after(bytes_sent: int) -> Fault:
    """Return the fault that ends the last message, a write, after so many bytes (errno 121)."""
    def cut(transport: Transport, messages: Sequence[Message]) -> list[bytes]:
        last = messages[-1]
        if isinstance(last, Write):
            transport.transfer([*messages[:-1], Write(last.address, last.data[:bytes_sent])])
        raise OSError(errno.EREMOTEIO, f'injected: no acknowledge after {bytes_sent} bytes')
    return cut


def flipped_bit(bit: int) -> Fault:
    """Return the fault that flips one bit of what the first Read gets."""
    def flip(transport: Transport, messages: Sequence[Message]) -> list[bytes]:
        got = [bytearray(data) for data in transport.transfer(messages)]
        if got and bit // 8 < len(got[0]):
            got[0][bit // 8] ^= 1 << bit % 8
        return [bytes(data) for data in got]
    return flip


class FaultyTransport:
    """
    Passes transfers on, except those that a fault was planned for.

    Parameters
    ----------
    transport
        The wire behind.
    address
        Only transfers with this chip are spoiled and counted; None for all.

    """

    def __init__(self, transport: Transport, address: int | None = None) -> None:
        self._transport = transport
        self._address = address
        self._planned: deque[tuple[Fault, Callable[[Sequence[Message]], bool]]] = deque()
        self._always: Fault | None = None
        self._before: dict[int, Callable[[], None]] = {}
        self._count = 0

    def once(self, fault: Fault, times: int = 1,
             when: Callable[[Sequence[Message]], bool] = lambda messages: True) -> None:
        """Spoil the next `times` transfers for which `when` holds."""
        self._planned.extend([(fault, when)] * times)

    def always(self, fault: Fault | None) -> None:
        """Spoil every transfer from now on; None ends that."""
        self._always = fault

    def clear(self) -> None:
        """Spoil nothing any more."""
        self._planned.clear()
        self._before.clear()
        self._always = None

    @property
    def planned(self) -> int:
        """Number of planned faults that have not struck yet."""
        return len(self._planned)

    def before_transfer(self, number: int, action: Callable[[], None]) -> None:
        """Do something before a transfer: `number` 0 is the next one, 1 the one after it."""
        self._before[self._count + number] = action

    def transfer(self, messages: Sequence[Message]) -> list[bytes]:
        """Send the messages, spoiled if that is planned."""
        if self._address not in (None, messages[0].address):
            return self._transport.transfer(messages)
        action = self._before.pop(self._count, None)
        self._count += 1
        if action is not None:
            action()
        if self._always is not None:
            return self._always(self._transport, messages)
        if self._planned and self._planned[0][1](messages):
            return self._planned.popleft()[0](self._transport, messages)
        return self._transport.transfer(messages)

    def close(self) -> None:
        """Release the wire behind."""
        self._transport.close()


def is_burst(messages: Sequence[Message]) -> bool:
    """Say whether this transfer is the write of a pose."""
    return isinstance(messages[0], Write) and len(messages[0].data) > 4


def is_read_of(register: int) -> Callable[[Sequence[Message]], bool]:
    """Return the test for a read from this register on."""
    def test(messages: Sequence[Message]) -> bool:
        return (len(messages) == 2 and isinstance(messages[1], Read)
                and isinstance(messages[0], Write) and messages[0].data[0] == register)
    return test
