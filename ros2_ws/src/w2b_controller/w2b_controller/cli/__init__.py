"""The command `w2b`: operate a robot without the `ros2` tool."""
