"""The demo: words move the simulated robot over real ROS 2; a table, a plot and a GIF."""
