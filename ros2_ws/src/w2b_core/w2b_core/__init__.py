"""Hearing, networks, senses, bodies and files of a robot that obeys words; no ROS."""

__version__ = '0.1.0'
