"""Hearing words that were never trained: lexicon, learned metric, ears and how they are judged."""
