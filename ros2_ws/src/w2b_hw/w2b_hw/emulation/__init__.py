"""Emulated chips behind an emulated wire: the whole robot without hardware, loaded on request."""
