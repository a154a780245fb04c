"""
`w2b relax`: all servos off, now. It needs the bus and nothing else.

No ROS, no calibration, no numpy, no driver: what can fail is left out. systemd runs it whenever
the hardware node ends, however it ended; `python -m w2b_hw.relax` does the same.
"""

from __future__ import annotations

import argparse
import sys
import time

from w2b_hw import command_line
from w2b_hw.transport import DEFAULT_DEVICE, Transport, open_transport, write_register

# Registers of the PCA9685 (NXP data sheet Rev. 4, table 4).
MODE1, MODE2, LED0_ON_L, ALL_LED_OFF_H, PRE_SCALE = 0x00, 0x01, 0x06, 0xFD, 0xFE
MODE2_ON_STOP = 0x04  # totem pole, outputs change on STOP
ALL_FULL_OFF = 0x10
DEFAULT_ADDRESS = 0x40


def all_channels_off(transport: Transport, address: int = DEFAULT_ADDRESS) -> None:
    """
    Turn all 16 channels off.

    Two writes of one register each, so that it works on a sleeping chip and without
    auto-increment; the first makes outputs change on STOP, so that the second acts by itself.

    Raises
    ------
    OSError
        If the chip does not acknowledge.

    """
    write_register(transport, address, MODE2, MODE2_ON_STOP)
    write_register(transport, address, ALL_LED_OFF_H, ALL_FULL_OFF)


def relax_until(transport_name: str, address: int, deadline_s: float) -> OSError | None:
    """
    Try to turn all channels off until it works or time is up; return the last error or None.

    The bus is opened anew for each try: the device itself may have gone and come back.
    """
    ends = time.monotonic() + deadline_s
    while True:
        try:
            transport = open_transport(transport_name)
            try:
                all_channels_off(transport, address)
                return None
            finally:
                transport.close()
        except OSError as error:
            if time.monotonic() >= ends:
                return error
            time.sleep(0.005)


@command_line.command
def main() -> None:
    """Relax all servos; exit code 1 if the chip could not be reached."""
    parser = argparse.ArgumentParser(description='Turn all servos off. Needs only the I2C bus.')
    parser.add_argument('--transport', default=DEFAULT_DEVICE,
                        help='bus device, or emulated:SOCKET (default: %(default)s)')
    parser.add_argument('--address', type=lambda text: int(text, 0), default=DEFAULT_ADDRESS,
                        help='of the PCA9685 (default: 0x40)')
    parser.add_argument('--seconds', type=float, default=0.8,
                        help='how long to try (default: %(default)s)')
    arguments = parser.parse_args(command_line.own())
    error = relax_until(arguments.transport, arguments.address, arguments.seconds)
    if error is not None:
        sys.exit(f'relax: the PCA9685 at 0x{arguments.address:02x} on {arguments.transport} '
                 f'could not be reached ({error}). CUT THE SERVO SUPPLY.')
    print(f'relax: all channels of the PCA9685 at 0x{arguments.address:02x} are off')


if __name__ == '__main__':
    main()
