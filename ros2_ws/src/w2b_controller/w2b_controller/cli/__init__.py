"""The command `w2b`: what a person does with a robot, without the `ros2` tool."""
