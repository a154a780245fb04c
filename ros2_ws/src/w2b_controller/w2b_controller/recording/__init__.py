"""Recordings of a robot as MCAP files: written without the `ros2` tool, read without ROS."""
