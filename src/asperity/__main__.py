"""``python -m asperity`` is the command ``asperity``."""

from asperity.cli.main import main

if __name__ == "__main__":
    main(prog_name="asperity")
