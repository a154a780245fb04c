"""The robot: servos and IMU over I2C, calibration, safety and ROS 2 node."""

__version__ = '0.1.0'
