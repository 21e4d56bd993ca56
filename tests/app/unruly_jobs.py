"""Jobs that do not listen, for the processes that have to end them; see `test_jobs`."""

import sys
import tempfile


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
    from asperity.laws import registered

    return list(registered())


def place(argument, report):
    """Where the worker keeps temporary files."""
    return tempfile.gettempdir()


# Workers run what is in the rooms of the page only.
sys.modules["asperity.app.api.unruly"] = sys.modules[__name__]
