"""Push to talk: speech in, one of a few words out; needs pocketsphinx (requirements/listen.txt)."""
