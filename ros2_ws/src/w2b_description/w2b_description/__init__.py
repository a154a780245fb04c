"""What the robot is and where its parts are: robot_description and tf."""
