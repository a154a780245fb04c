"""The page: see the robot in a browser, say words to it, stop it."""
