"""Two more drawings of `w2b robot draw`: what is wired to what, and how servo horns go on."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, degrees, pi, sin
from typing import Any

import numpy as np

from w2b_core.bodies.chips import IMUS, SERVO_BOARD, BoardChip
from w2b_core.bodies.model import Body, Joint
from w2b_core.bodies.wiring import CHANNELS, Wiring
from w2b_sim.own_robot.drawing import ARROW, arrow, as_svg, sheet

#: Pins of the Raspberry Pi's header: what they are -> (number, colour of the wire).
PINS = {'3.3 V': (1, '#c7521b'), 'SDA': (3, '#2255a4'), 'SCL': (5, '#2e8b57'),
        'GND': (6, '#222222')}
_SUPPLY = '#c01010'
_DIALS = 4


def wiring_diagram(body: Body, wiring: Mapping[str, Wiring]) -> bytes:
    """Return the SVG of what is wired to what; `wiring` as `bodies.wiring` returns it."""
    figure, panels = sheet(['W'], (13.0, 8.5))
    plot = panels['W']
    plot.set(xlim=(0, 13), ylim=(0, 8.5))
    plot.set_axis_off()
    _box(plot, (0.3, 4.6, 2.2, 2.9), 'Raspberry Pi', ['its own 5 V supply'])
    _box(plot, (5.2, 1.2, 2.2, 6.75), f'servo board {_chip(SERVO_BOARD)}', [])
    _box(plot, (0.3, 1.9, 2.6, 1.6), 'IMU, x forward, y left, z up',
         [' + '.join(map(_chip, chips)) for chips in IMUS.values()])
    _box(plot, (0.3, 0.2, 1.7, 1.0), 'battery, converter', ['5 to 6 V, 10 A'])
    _box(plot, (2.6, 0.3, 1.2, 0.8), 'switch', ['in reach'])
    for number, (name, (pin, colour)) in enumerate(PINS.items()):
        y = 7.0 - 0.55 * number
        board = {'3.3 V': 'VCC (logic)'}.get(name, name)
        plot.plot([2.5, 5.2], [y, y], color=colour, linewidth=1.6, gid=f'wire:{name}')
        plot.text(2.55, y + 0.06, f'pin {pin}: {name}', fontsize=8)
        plot.text(5.1, y + 0.06, board, fontsize=8, ha='right')
        x = 3.75 + 0.16 * number
        down = 2.05 + 0.28 * number
        plot.plot([x, x, 2.9], [y, down, down], color=colour, linewidth=1.2)
        plot.plot(x, y, 'o', color=colour, markersize=4)
        plot.text(3.0, down + 0.04, {'3.3 V': 'VCC'}.get(name, name), fontsize=7)
    plot.plot([2.0, 2.6], [0.7, 0.7], color=_SUPPLY, linewidth=3)
    plot.plot([3.8, 4.7, 4.7, 5.2], [0.7, 0.7, 1.9, 1.9], color=_SUPPLY, linewidth=3,
              gid='wire:V+')
    plot.text(5.3, 1.9, 'V+ (servos)', fontsize=8, va='center')
    plot.plot([1.1, 1.1, 4.95, 4.95, 5.2], [0.2, 0.05, 0.05, 1.45, 1.45], color=PINS['GND'][1],
              linewidth=2)
    plot.text(5.3, 1.45, 'GND', fontsize=8, va='center')
    joints = {wired.channel: name for name, wired in wiring.items()}
    for channel in range(CHANNELS):
        y = 7.25 - 0.385 * channel
        used = channel in joints
        plot.text(7.3, y, f'{channel}', fontsize=8, ha='right', va='center')
        plot.plot([7.4, 8.2], [y, y], color='black' if used else '#bbbbbb', linewidth=1.1)
        plot.text(8.3, y, joints.get(channel, '(free)'), fontsize=9, va='center',
                  color='black' if used else '#999999',
                  **({'gid': f'output:{channel}'} if used else {}))
    plot.text(10.4, 4.6, 'Each servo:\n  signal: the output\n  +: V+ of the board\n  -: GND',
              fontsize=9, va='center')
    plot.text(6.3, 0.75, 'V+ never from the Pi. All grounds meet at the board. The switch is the '
              'last word in every emergency.', fontsize=9, color=_SUPPLY)
    figure.suptitle(f'{body.name}: wiring, {len(wiring)} servos')
    return as_svg(figure)


def _chip(chip: BoardChip) -> str:
    return f'{chip.name} ' + '/'.join(f'0x{address:02X}' for address in chip.addresses)


def _box(plot: Any, place: tuple[float, float, float, float], title: str,
         lines: list[str]) -> None:
    from matplotlib.patches import Rectangle

    x, y, width, height = place
    plot.add_patch(Rectangle((x, y), width, height, facecolor='#f2f2ee', edgecolor='black'))
    plot.text(x + width / 2, y + height - 0.12, title, fontsize=8.5, ha='center', va='top',
              fontweight='bold')
    for number, line in enumerate(lines):
        plot.text(x + width / 2, y + height - 0.48 - 0.3 * number, line, fontsize=7, ha='center',
                  va='top')


def horns(body: Body, wiring: Mapping[str, Wiring]) -> bytes:
    """Return the SVG of every joint's pulses: at zero, where the horn goes on, and at its ends."""
    rows = -(-len(body.joints) // _DIALS)
    letters = [chr(ord('A') + number) for number in range(rows * _DIALS)]
    lines = [''.join(letters[start:start + _DIALS]) for start in range(0, len(letters), _DIALS)]
    figure, plots = sheet(lines, (12.5, 2.5 * rows + 0.8))
    for letter, joint in zip(letters, body.joints, strict=False):
        _dial(plots[letter], joint, wiring[joint.name])
    for plot in plots.values():
        plot.set_axis_off()
        plot.set_aspect('equal')
    figure.suptitle(
        f'{body.name}: send each servo its pulse of zero, hold the limb in its zero pose, push the '
        'horn on.\nSeen with the joint’s axis towards you: + is counter-clockwise. Nominal pulses; '
        'a calibration finds the real ones', fontsize=10)
    return as_svg(figure)


def _dial(plot: Any, joint: Joint, wired: Wiring) -> None:
    from matplotlib.patches import Circle, Rectangle

    plot.add_patch(Rectangle((-0.35, -0.8), 0.7, 1.1, facecolor='#c9d3e6', edgecolor='black'))
    plot.add_patch(Circle((0, 0), 0.22, facecolor='white', edgecolor='black'))
    low, high = joint.lower_rad, joint.upper_rad
    arc = np.linspace(low, high, 40)
    plot.plot(-np.sin(arc), np.cos(arc), color='#888888', linewidth=1)
    half = max(high / 2, 0.1)
    turn = np.linspace(0.05, half, 20)
    plot.plot(-0.6 * np.sin(turn), 0.6 * np.cos(turn), color=ARROW, linewidth=1.4)
    arrow(plot, np.array([-0.6 * sin(0.9 * half), 0.6 * cos(0.9 * half)]),
          np.array([-0.6 * sin(half), 0.6 * cos(half)]), ARROW)
    for angle, width in ((low, 0.8), (0.0, 4.0), (high, 0.8)):
        pulse = wired.zero_us + wired.direction * wired.us_per_rad * angle
        x, y = -sin(angle), cos(angle)
        plot.plot([0, x], [0, y], color='black', linewidth=width, solid_capstyle='round',
                  alpha=0.8)
        plot.text(1.22 * x, 1.12 * y if angle else 1.1, f'{pulse:.0f} us\n{degrees(angle):+.0f}°',
                  fontsize=7.5, ha='center' if abs(x) < 0.2 else 'left' if x > 0 else 'right',
                  va='bottom' if abs(angle) < pi / 2 else 'top')
    plot.set(xlim=(-1.9, 1.9), ylim=(-0.95, 1.6))
    longer = '+' if wired.direction == 1 else '-'
    plot.set_title(f'{joint.name}, ch {wired.channel}, longer pulse: {longer}', fontsize=8.5)


#: Name of a sheet -> what draws it.
SHEETS = {'wiring': wiring_diagram, 'horns': horns}
