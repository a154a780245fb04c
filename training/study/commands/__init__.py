"""What is done with a study beside running it: export, import, status, pause, resume."""
