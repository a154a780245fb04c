"""Convert a robot's report to ROS messages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from builtin_interfaces.msg import Time
from sensor_msgs.msg import BatteryState, Imu, JointState, MagneticField

from w2b_core.status import Level, Status
from w2b_hw.imu.orientation import NO_HEADING_VARIANCE
from w2b_hw.imu.part import Part, Sample
from w2b_hw.robot import Report
from w2b_hw.safety import State

#: REP-145: element 0 of a covariance is -1 for what is not reported.
NOT_REPORTED = -1.0


def joint_states(report: Report, stamp: Time) -> JointState:
    """Return what was really commanded; the park pose while the servos are off."""
    message = JointState(name=list(report.joints), position=list(report.position_rad),
                         velocity=list(report.velocity_rad_s))
    message.header.stamp = stamp
    return message


def pulses(report: Report, stamp: Time) -> JointState:
    """Return the pulses at the servos as a named vector: `position` in seconds, 0 for off."""
    message = JointState(name=list(report.joints), position=[us * 1e-6 for us in report.pulses_us])
    message.header.stamp = stamp
    return message


def imu_raw(sample: Sample, part: type[Part], frame_id: str, stamp: Time) -> Imu:
    """Return what the IMU measured; it reports no orientation."""
    message = Imu()
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    message.orientation_covariance[0] = NOT_REPORTED
    rate, force = message.angular_velocity, message.linear_acceleration
    rate.x, rate.y, rate.z = sample.angular_velocity_rad_s
    force.x, force.y, force.z = sample.acceleration_m_s2
    message.angular_velocity_covariance = _diagonal([part.angular_velocity_variance] * 3)
    message.linear_acceleration_covariance = _diagonal([part.acceleration_variance] * 3)
    return message


def imu_data(raw: Imu, report: Report) -> Imu:
    """Return the raw message with the orientation, which is not reported while it is not known."""
    if report.orientation is None:
        return raw
    message = Imu(header=raw.header, angular_velocity=raw.angular_velocity,
                  angular_velocity_covariance=raw.angular_velocity_covariance,
                  linear_acceleration=raw.linear_acceleration,
                  linear_acceleration_covariance=raw.linear_acceleration_covariance)
    turn = message.orientation
    turn.x, turn.y, turn.z, turn.w = report.orientation
    message.orientation_covariance = _diagonal(
        [report.tilt_variance, report.tilt_variance, report.yaw_variance])
    return message


def magnetic_field(field_t: Sequence[float], part: type[Part], frame_id: str, stamp: Time
                   ) -> MagneticField:
    """Return the magnetic field; a covariance of zeros is an unknown one (REP-145)."""
    message = MagneticField()
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    field = message.magnetic_field
    field.x, field.y, field.z = field_t
    message.magnetic_field_covariance = _diagonal([part.field_variance] * 3)
    return message


def battery(report: Report, stamp: Time) -> BatteryState:
    """Return the supply: only whether it is too low is known; numbers are not (NaN)."""
    unknown = float('nan')
    health = {None: BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN,
              False: BatteryState.POWER_SUPPLY_HEALTH_GOOD,
              True: BatteryState.POWER_SUPPLY_HEALTH_UNSPEC_FAILURE}[report.undervoltage]
    message = BatteryState(voltage=unknown, temperature=unknown, current=unknown, charge=unknown,
                           capacity=unknown, design_capacity=unknown, percentage=unknown,
                           power_supply_health=health, present=True)
    message.header.stamp = stamp
    return message


def statuses(report: Report, *, imu: str, wants_heading: bool, targets: Mapping[str, str],
             refusal: str, frames: Mapping[str, str]) -> list[Status]:
    """Return the state of each part, named `hardware: part` (REP-107)."""
    levels = {State.FAULT: Level.ERROR, State.HOLD: Level.WARN, State.PARK: Level.WARN}
    off = report.off_confirmed or any(report.pulses_us)
    supply = {None: (Level.OK, 'no undervoltage sensor on this machine'),
              False: (Level.OK, 'supply in order'),
              True: (Level.ERROR, 'undervoltage')}[report.undervoltage]
    return [
        Status(levels.get(report.state, Level.OK) if off else Level.ERROR, 'hardware: safety',
               f'{report.state.value}: {report.reason}',
               {'state': report.state.value, 'off_confirmed': str(report.off_confirmed),
                'duty_used_s': f'{report.duty_used_s:.0f}'}),
        Status(Level.ERROR if report.bus_error else Level.OK, 'hardware: servos',
               report.bus_error or 'servo chip in order', {'retries': str(report.retried)}),
        _imu_status(report, imu, wants_heading),
        Status(supply[0], 'hardware: power', supply[1]),
        Status(Level.WARN if refusal else Level.OK, 'hardware: targets',
               refusal or 'no target was refused lately', targets),
        Status(Level.OK, 'hardware: frames', 'frames on time', frames),
    ]


def _imu_status(report: Report, imu: str, wants_heading: bool) -> Status:
    name = 'hardware: imu'
    if report.imu_error:
        return Status(Level.ERROR, name, report.imu_error)
    if report.sample is None:
        return Status(Level.OK, name, f'{imu} in order')
    if report.orientation is None:
        return Status(Level.OK, name, f'{imu} in order; its orientation is not known yet')
    known = report.yaw_variance < NO_HEADING_VARIANCE
    if wants_heading and not known:
        return Status(Level.WARN, name, f'{imu} in order; heading unknown: no magnetic field comes')
    return Status(Level.OK, name, f'{imu} in order; '
                  f'{"heading by the magnetic field" if known else "no heading"}')


def _diagonal(variances: Sequence[float]) -> list[float]:
    x, y, z = variances
    return [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z]
