"""`python -m w2b_core.vocabulary`: the `vocabulary` command."""

import sys

from w2b_core.vocabulary.command import main

sys.exit(main())
