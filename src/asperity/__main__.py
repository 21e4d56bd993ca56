"""``python -m asperity`` is the command ``asperity``."""

from asperity.cli.main import run

if __name__ == "__main__":
    run()
