"""The brain of a robot that obeys words: vocabulary, network, controller file and ROS 2 node."""

__version__ = '0.1.0'
