"""`python -m w2b_controller.vocabulary`: the `vocabulary` command."""

import sys

from w2b_controller.vocabulary.command import main

sys.exit(main())
