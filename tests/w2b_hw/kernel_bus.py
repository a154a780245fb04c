"""
A fake /dev/i2c-1 whose ioctls end at emulated chips; runs in the system's Python (python3-gi).

Started as `umockdev-wrapper /usr/bin/python3 kernel_bus.py`. It prints UMOCKDEV_DIR, which makes
the device appear to other processes under the same preloaded library. Lines on standard input:
`fail ERRNO COUNT` spoils transfers, `outputs` prints what the servo chip's pins do.
"""

import json
import struct
import sys
import threading

import gi

gi.require_version('UMockdev', '1.0')
from gi.repository import GLib, UMockdev  # noqa: E402

from w2b_hw.emulation.robot import EmulatedRobot  # noqa: E402
from w2b_hw.transport import Read, Write  # noqa: E402

I2C_RETRIES, I2C_TIMEOUT, I2C_SLAVE = 0x0701, 0x0702, 0x0703
I2C_FUNCS, I2C_RDWR, I2C_SMBUS = 0x0705, 0x0707, 0x0720
READS, BLOCK_DATA = 0x0001, 8
ALL_FUNCTIONS = 0x0EFF0009
MESSAGE = struct.Struct('<HHHxxQ')
SIZES = {2: 1, 3: 2}
DEVICE = """P: /devices/platform/i2c@1/i2c-1/i2c-dev/i2c-1
N: i2c-1
E: DEVNAME=/dev/i2c-1
E: SUBSYSTEM=i2c-dev
E: MAJOR=89
E: MINOR=1
A: dev=89:1
"""


class Bus(UMockdev.IoctlBase):
    """Decodes the structures of linux/i2c-dev.h in the client's memory."""

    def __init__(self, transport):
        super().__init__()
        self.transport = transport
        self.failures = []
        self.timeouts = []
        self.address = 0

    def do_handle_ioctl(self, client):
        request, argument = client.get_request(), client.get_arg()
        try:
            client.complete(self._handle(request, argument), 0)
        except OSError as error:
            client.complete(-1, error.errno)
        return True

    def _handle(self, request, argument):
        if request == I2C_FUNCS:
            argument.resolve(0, 8).update(0, list(struct.pack('<Q', ALL_FUNCTIONS)))
        elif request == I2C_RDWR:
            return self._rdwr(argument.resolve(0, 16))
        elif request == I2C_SMBUS:
            self._smbus(argument.resolve(0, 16))
        elif request in (I2C_RETRIES, I2C_TIMEOUT, I2C_SLAVE):
            value = struct.unpack('<Q', bytes(argument.retrieve()))[0]
            if request == I2C_SLAVE:
                self.address = value
            elif request == I2C_TIMEOUT:
                self.timeouts.append(value)
        else:
            raise OSError(25, f'ioctl 0x{request:04x}')
        return 0

    def _transfer(self, messages):
        if self.failures:
            raise OSError(self.failures.pop(0), 'scripted')
        return self.transport.transfer(messages)

    def _rdwr(self, data):
        count, = struct.unpack_from('<I', bytes(data.retrieve()), 8)
        table = data.resolve(0, MESSAGE.size * count)
        messages, buffers = [], []
        for number in range(count):
            address, flags, length, _ = MESSAGE.unpack_from(bytes(table.retrieve()),
                                                            MESSAGE.size * number)
            buffer = table.resolve(MESSAGE.size * number + 8, length)
            if flags & READS:
                messages.append(Read(address, length))
                buffers.append(buffer)
            else:
                messages.append(Write(address, bytes(buffer.retrieve())))
        for buffer, got in zip(buffers, self._transfer(messages), strict=True):
            buffer.update(0, list(got))
        return count

    def _smbus(self, data):
        reading, command, size = struct.unpack_from('<BBxxI', bytes(data.retrieve()))
        union = data.resolve(8, 34)
        block = size == BLOCK_DATA
        content = bytes(union.retrieve())
        count = content[0] if block else SIZES[size]
        if reading:
            got = self._transfer([Write(self.address, bytes([command])),
                                  Read(self.address, count)])[0]
            union.update(int(block), list(got))
        else:
            self._transfer([Write(self.address,
                                  bytes([command]) + content[block:block + count])])


def main():
    robot = EmulatedRobot()
    testbed = UMockdev.Testbed.new()
    testbed.add_from_string(DEVICE)
    bus = Bus(robot.wire)
    testbed.attach_ioctl('/dev/i2c-1', bus)
    loop = GLib.MainLoop()
    threading.Thread(target=loop.run, daemon=True).start()
    print(testbed.get_root_dir(), flush=True)
    for line in sys.stdin:
        word, *numbers = line.split()
        if word == 'fail':
            bus.failures = [int(numbers[0])] * int(numbers[1])
        print(json.dumps({'pulses_us': robot.pca9685.pulses_us(), 'timeouts': bus.timeouts,
                          'failures': len(bus.failures)}), flush=True)


if __name__ == '__main__':
    main()
