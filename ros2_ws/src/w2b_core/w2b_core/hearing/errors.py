"""What can be wrong with an ear; each message is one line."""


class EarError(ValueError):
    """An ear, its metric or what it shall learn is damaged, or does not fit the vocabulary."""
