"""Hearing: from words to what a network is driven by, or a refusal with its reason."""
