"""Champions that are primed with words: recipes, and the steps that they are made in."""
