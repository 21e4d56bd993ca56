"""Jobs that do not listen, for the processes that have to end them; see `test_jobs`."""

import tempfile

from asperity.app.api import recordings
from asperity.laws import registered


def spin(argument, report):
    """Compute forever without a report."""
    report(begun=True)
    while True:
        pass


def hoard(argument, report):
    """Take memory until there is none left."""
    kept = []
    while True:
        kept.append(bytearray(64 * 1024**2))


def answer(argument, report):
    """Answer at once."""
    return argument


def laws(argument, report):
    """Names of the laws that the worker knows."""
    return list(registered())


def place(argument, report):
    """Where the worker keeps temporary files."""
    return tempfile.gettempdir()


# Workers run what is in the rooms of the page only.
for job in (spin, hoard, answer, laws, place):
    setattr(recordings, job.__name__, job)
