"""Whether a robot makes sense: its legs, its weight, and how it stands."""

from __future__ import annotations

from itertools import product

import numpy as np

from w2b_core.bodies.model import Body, Link
from w2b_core.bodies.points import spheres
from w2b_core.bodies.robot_file.findings import Findings
from w2b_core.bodies.robot_file.posed import Posed
from w2b_core.bodies.robot_file.settings import FEET, FORWARD, Settings
from w2b_core.bodies.robot_file.stance import Stance
from w2b_core.bodies.robot_file.urdf_reader import Urdf
from w2b_core.bodies.turning import from_rpy

#: Feet that differ by more in height are told, by more of the height of the base refused.
LEVEL_M, LEVEL_SHARE = 0.002, 0.15
#: Small robots weigh so much; what is outside is told.
LIGHT_KG, HEAVY_KG = 0.08, 15.0
#: A moving part of less is no servo and no printed leg.
FEATHER_KG = 0.003
#: Real descriptions have 200 to 2200 kg for a cubic metre of all their shapes.
DENSE_KG_M3 = 4000.0
#: What a scale says is at most so many times what the description says.
SCALED_BY = 3.0
#: Part of a servo's torque that a stance may ask for.
HOLDING_SHARE = 0.6


def legs(posed: Posed, settings: Settings, urdf: Urdf, found: Findings) -> None:
    """Check servo data, four feet on four chains of two or three joints each (RobotFileError)."""
    if settings.servo is None:
        joint = next((one for one in urdf.joints if one.name in posed.stand_rad), None)
        what = (f'effort {joint.effort_nm:g} and velocity {joint.speed_rad_s:g} are never trusted'
                if joint else 'what the servos can do is not said')
        found.error(f'joint {joint.name}' if joint else 'servo', what,
                    'give servo.torque_nm and servo.speed_rad_s, from the data sheet at your '
                    'voltage')
    missing = [name for name in FEET if name not in settings.feet]
    if missing:
        raise found.refuse('feet', f'expected {", ".join(FEET)}, got no {", ".join(missing)}',
                           'four-legged robots can be trained; name the link of each foot')
    chains: dict[str, list[int]] = {}
    for name, foot in settings.feet.items():
        if foot.link not in posed.owner:
            raise found.refuse(f'feet.{name}', f'{foot.link!r} is no link of the robot',
                               f'the links are {", ".join(list(urdf.links)[:16])}')
        chains[name] = parts_of_leg(posed, foot.link)
    for name, chain in chains.items():
        if not 2 <= len(chain) <= 3:
            found.error(f'feet.{name}', f'{settings.feet[name].link} hangs on {len(chain)} moving '
                        'joints: expected 2 or 3', 'name the last link of the leg, lock other '
                        'joints (locked: [...])')
    used = [number for chain in chains.values() for number in chain]
    for number in sorted({one for one in used if used.count(one) > 1}):
        joint = posed.parts[number].joint
        found.error(f'joint {joint.name if joint else "?"}', 'moves more than one leg',
                    'lock it: locked: [...]')
    for number, part in enumerate(posed.parts[1:], 1):
        if number not in used and part.joint is not None:
            found.error(f'joint {part.joint.name}', 'is on no leg: a head, a tail, an arm?',
                        f'lock it: locked: [{part.joint.name}]')
    if len({len(chain) for chain in chains.values()}) > 1:
        found.error('feet', 'legs of ' + ', '.join(f'{len(chain)} ({name})' for name, chain
                                                    in chains.items())
                    + ' joints: expected four alike', 'name the last link of each leg')
    if settings.wiring and (without := sorted(set(posed.stand_rad) - set(settings.wiring))):
        found.error('servos', f'no channel for {", ".join(without)}',
                    'give each joint its channel, or delete servos')
    _directions(posed, settings, found)
    found.stop_at_errors()


def parts_of_leg(posed: Posed, link: str) -> list[int]:
    """Return the parts from the base's child to a link's own."""
    numbers = []
    number = posed.owner[link]
    while (joint := posed.parts[number].joint) is not None:
        numbers.append(number)
        number = posed.owner[joint.parent]
    return numbers[::-1]


def _directions(posed: Posed, settings: Settings, found: Findings) -> None:
    """Check that feet that are called front lie in front, and left ones to the left."""
    places = {name: posed.places[foot.link].at_m for name, foot in settings.feet.items()}
    if _wrong(places, 0) == '':
        return
    for forward in FORWARD:
        turn = from_rpy((0, 0, (FORWARD[forward] - FORWARD[settings.forward]) * np.pi / 2))
        if not _wrong({name: turn @ at for name, at in places.items()}, 0):
            said = _wrong(places, FORWARD[settings.forward])
            found.error('feet', f'names say front, but {said}', f'set forward: {forward}')
            return
    found.error('feet', 'their names do not fit where they lie: '
                + ', '.join(f'{name} at {at[0]:+.3f} {at[1]:+.3f} m' for name, at
                            in places.items()),
                'correct the names: with forward towards +x, left is at +y')


def _wrong(places: dict[str, np.ndarray], quarter_turns: int) -> str:
    """Return where in the URDF's axes a foot lies that is not where its name says; '' if none."""
    middle = np.mean(list(places.values()), axis=0)
    back = from_rpy((0, 0, -quarter_turns * np.pi / 2))
    for end, side in product(('front', 'back'), ('left', 'right')):
        at = places[f'{end}_{side}'] - middle
        if at[0] * (1 if end == 'front' else -1) <= 0 or at[1] * (
                1 if side == 'left' else -1) <= 0:
            x, y, _z = back @ at
            axis = ('+x' if x > 0 else '-x') if abs(x) > abs(y) else ('+y' if y > 0 else '-y')
            return f'{end}_{side} lies towards {axis}'
    return ''


def weights(total_kg: float, volume_m3: float, settings: Settings, parts_kg: dict[str, float],
            found: Findings) -> None:
    """Judge the masses of the whole robot, of its parts, and for the volume of its shapes."""
    if settings.weigh_kg is not None:
        ratio = settings.weigh_kg / total_kg
        if not 1 / SCALED_BY <= ratio <= SCALED_BY:
            found.warn('weigh_kg', f'{settings.weigh_kg:g} kg, the description says {total_kg:.3g}'
                       f' kg: all masses are scaled by {ratio:.2f}', 'are its masses right?')
    elif not LIGHT_KG <= total_kg <= HEAVY_KG:
        found.warn('', f'the robot weighs {total_kg:.3g} kg as described',
                   'weigh it and give weigh_kg')
    elif total_kg > DENSE_KG_M3 * volume_m3:
        found.warn('', f'the robot weighs {total_kg:.3g} kg as described, '
                   f'{total_kg / volume_m3:.0f} kg for a cubic metre of its shapes: others have '
                   '200 to 2200',
                   'weigh it and give weigh_kg')
    light = [name for name, mass_kg in parts_kg.items() if mass_kg < FEATHER_KG]
    if light:
        found.warn(f'link {light[0]}', f'weighs {1000 * parts_kg[light[0]]:.1f} g'
                   + (f' (and {len(light) - 1} more so light)' if len(light) > 1 else ''),
                   'weigh a leg: give masses_kg')


def stance(stand: Stance, settings: Settings, body: Body, found: Findings) -> None:
    """Judge heights of the feet, the support polygon and the torque that the stance needs."""
    bottoms = {name: float(foot.bottom_m[2]) for name, foot in stand.feet.items()}
    gap_m = max(bottoms.values()) - min(bottoms.values())
    if gap_m > LEVEL_M:
        text = f'differ by {1000 * gap_m:.0f} mm in height'
        fix = f'let {max(bottoms, key=lambda name: bottoms[name])} stand lower'
        if gap_m > LEVEL_SHARE * body.height_m:
            found.error('feet', text, fix)
        else:
            found.warn('feet', text, fix)
    if not body.height_m > 0:
        found.error('feet', 'are above the centre of mass of the base', 'check stand and forward')
        return
    lowest = min(bottoms.values())
    for link in body.links:
        low = float(min(place[2] - radius for place, radius in _points(link, stand)))
        if low < lowest - LEVEL_M and link.name not in {
                foot.link for foot in stand.feet.values()}:
            found.error(f'link {link.name}', f'reaches {1000 * (lowest - low):.0f} mm below the '
                        'feet', 'check stand, and the shapes')
    if stand.margin_m <= 0:
        found.error('', f'centre of mass outside the support polygon by '
                    f'{-1000 * stand.margin_m:.0f} mm: it falls over',
                    'move the feet under it (stand), or correct the masses')
    servo = settings.servo
    assert servo is not None
    joint = max(stand.torque_nm, key=lambda name: stand.torque_nm[name])
    needed = stand.torque_nm[joint]
    if needed > servo.torque_nm:
        found.error(f'joint {joint}', f'holding this stance needs {needed:.2f} N m, the servo has '
                    f'{servo.torque_nm:g}', 'stand with straighter legs, or use stronger servos')
    elif needed > HOLDING_SHARE * servo.torque_nm:
        found.warn(f'joint {joint}', f"holding this stance needs {needed:.2f} N m of the servo's "
                   f'{servo.torque_nm:g}: it runs hot', 'stand with straighter legs')


def _points(link: Link, stand: Stance) -> list[tuple[np.ndarray, float]]:
    origin = stand.origins_m[link.name] + np.asarray(link.centre_m)
    return [(origin + place, radius) for place, radius in spheres(link)]
