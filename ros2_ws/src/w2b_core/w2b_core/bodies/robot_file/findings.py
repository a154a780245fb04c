"""What is found in a robot's files: errors and warnings of one line, each with what to do next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

#: As much of a value from a file as a line shows.
SHOWN = 60


class Grade(Enum):
    """Whether a robot can be used in spite of a finding."""

    ERROR = 'error'
    WARNING = 'warning'


@dataclass(frozen=True)
class Finding:
    """
    One finding.

    Attributes
    ----------
    where
        The part that it is about, such as `link fl_foot`; empty for the whole file.
    what
        What is so, with the value.
    fix
        What to do about it.
    alike
        What findings of several parts have in common that differ in names only; '' if they are the
        same to the letter.

    """

    grade: Grade
    where: str
    what: str
    fix: str = ''
    alike: str = ''

    def __str__(self) -> str:
        """Return one line without the grade."""
        line = f'{self.where}: {self.what}' if self.where else self.what
        return f'{line}; {self.fix}' if self.fix else line


class RobotFileError(ValueError):
    """
    A robot's file that cannot be used: one line with the file and its first error.

    `findings` has all errors and warnings.
    """

    def __init__(self, path: Path, findings: list[Finding]) -> None:
        errors = [finding for finding in findings if finding.grade is Grade.ERROR]
        more = len(errors) - 1
        rest = f' (and {more} more: `w2b robot check {path}`)' if more > 0 else ''
        super().__init__(f'{path}: {errors[0]}{rest}')
        self.path, self.findings = path, findings


class Findings:
    """All that was found so far in the files of one robot."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._all: list[Finding] = []

    def __iter__(self) -> Iterator[Finding]:
        return iter(self._all)

    def error(self, where: str, what: str, fix: str = '', alike: str = '') -> None:
        """Note an error."""
        self._all.append(Finding(Grade.ERROR, where, what, fix, alike))

    def warn(self, where: str, what: str, fix: str = '', alike: str = '') -> None:
        """Note a warning."""
        self._all.append(Finding(Grade.WARNING, where, what, fix, alike))

    def add(self, finding: Finding) -> None:
        """Note what was found elsewhere, once."""
        if finding not in self._all:
            self._all.append(finding)

    def refuse(self, where: str, what: str, fix: str = '') -> RobotFileError:
        """Note an error, and return what to raise."""
        self.error(where, what, fix)
        return RobotFileError(self.path, self._all)

    def stop_at_errors(self) -> None:
        """Raise RobotFileError if there is an error among them."""
        if any(finding.grade is Grade.ERROR for finding in self._all):
            raise RobotFileError(self.path, self._all)


def shown(value: object) -> str:
    """Return a value from a file on one line, cut short."""
    text = ' '.join(repr(value).split())
    return text if len(text) <= SHOWN else f'{text[:SHOWN]}...'
