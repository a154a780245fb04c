"""Training of commanded leaky networks: a recipe in, legs out."""
