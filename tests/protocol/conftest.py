"""A short protocol whose run takes several blocks."""

from pathlib import Path

import pytest

from asperity.protocol import load_protocol

SHORT = """
title = "a short run"
law = "elasto-plastic"
material = "bureau2000"
steps = [
  "slide for 0.2 s",
  "modulate 24 % at 120 Hz for 0.4 s, rising in 0.1 s",
  "step load to 9 N",
  "slide for 0.4 s",
]

[parameters]
K = "0.5 N/um"

[start]
velocity = "10 um/s"

[solver]
sampling = "2 kHz"
"""


@pytest.fixture(scope="session")
def short_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("protocol") / "short.toml"
    path.write_text(SHORT, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def short(short_file):
    return load_protocol(short_file)
