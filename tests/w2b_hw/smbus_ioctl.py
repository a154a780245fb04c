"""The ioctls of smbus2, answered by emulated chips: its own code runs to the kernel's door."""

import ctypes
import errno

from smbus2 import smbus2 as module

from w2b_hw.transport import Read, Write


class IoctlDoor:
    """Stands for `fcntl.ioctl` on one bus; decodes the structures of linux/i2c-dev.h."""

    def __init__(self, transport):
        self.transport = transport
        self.address = None

    def __call__(self, descriptor, request, argument=0):
        if request == module.I2C_SLAVE:
            self.address = argument
        elif request == module.I2C_FUNCS:
            argument.value = module.I2cFunc.I2C | module.I2cFunc.SMBUS_EMUL
        elif request == module.I2C_RDWR:
            self._rdwr(argument)
        elif request == module.I2C_SMBUS:
            self._smbus(argument)
        else:
            raise OSError(errno.ENOTTY, hex(request))
        return 0

    def _rdwr(self, data):
        messages = [data.msgs[n] for n in range(data.nmsgs)]
        got = iter(self.transport.transfer([
            Read(m.addr, m.len) if m.flags & module.I2C_M_RD
            else Write(m.addr, ctypes.string_at(m.buf, m.len)) for m in messages]))
        for message in messages:
            if message.flags & module.I2C_M_RD:
                ctypes.memmove(message.buf, next(got), message.len)

    def _smbus(self, data):
        sizes = {module.I2C_SMBUS_BYTE_DATA: 1, module.I2C_SMBUS_WORD_DATA: 2}
        union = data.data.contents
        block = data.size == module.I2C_SMBUS_I2C_BLOCK_DATA
        count = union.block[0] if block else sizes[data.size]
        if data.read_write == module.I2C_SMBUS_READ:
            got = self.transport.transfer([Write(self.address, bytes([data.command])),
                                           Read(self.address, count)])[0]
            ctypes.memmove(ctypes.addressof(union) + block, got, count)
        else:
            payload = ctypes.string_at(ctypes.addressof(union) + block, count)
            self.transport.transfer([Write(self.address, bytes([data.command]) + payload)])
