"""
Hearing by projection: a word or a sentence in, a behaviour or a refusal out; numpy only.

`Ear.understand(text, vocabulary)` answers `Understood` or `Refused`; `to_json` and `from_json` are
the ear's part of a controller file; `teach` adds a word. Serial priming, the paper's way of
hearing, is in `w2b_core.network`.
"""

from w2b_core.hearing.answers import Refused, Role, Understood, WordHeard
from w2b_core.hearing.ear import Ear
from w2b_core.hearing.ear_json import from_json, to_json
from w2b_core.hearing.errors import EarError
from w2b_core.hearing.metric import Metric
from w2b_core.hearing.teach import Change, Taught, teach

__all__ = ['Change', 'Ear', 'EarError', 'Metric', 'Refused', 'Role', 'Taught', 'Understood',
           'WordHeard', 'from_json', 'teach', 'to_json']
