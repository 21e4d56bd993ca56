"""Draw the picture of the README again, small: ``python docs/images/make.py``.

It is Figure 11 of the report that ``asperity reproduce`` writes.
"""

from pathlib import Path

from PIL import Image

from asperity.figures.style import style
from asperity_papers.bureau2000.figures import draw
from asperity_papers.bureau2000.harmonics import figure_11
from asperity_papers.bureau2000.machine import Machine

TARGET = Path(__file__).with_name("figure-11.png")


def main() -> None:
    """Write the PNG with a palette of 64 colours: a third of the size, and no visible loss."""
    with style():
        draw(figure_11(Machine())).savefig(TARGET, dpi=150, metadata={"Software": None})
    with Image.open(TARGET) as picture:
        small = picture.convert("RGB").quantize(64, dither=Image.Dither.NONE)
    small.save(TARGET, optimize=True)


if __name__ == "__main__":
    main()
