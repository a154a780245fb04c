"""The mind of a robot that obeys words: hearing, network, senses, bodies and files; no ROS."""

__version__ = '0.1.0'
