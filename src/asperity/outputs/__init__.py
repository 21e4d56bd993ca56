"""Output files and folders: checked before a computation, and complete or absent after it.

`targets` checks where results go before anything is computed, `written` writes a file or a folder
completely or not at all, and `unfinished` keeps the finished blocks of a long computation, which
goes on from there after an interruption.
"""

from asperity.outputs.targets import (
    free_disk,
    output_file,
    output_files,
    require_disk,
    require_memory,
    require_short,
    size_text,
)
from asperity.outputs.unfinished import (
    Interrupted,
    UnfinishedOutput,
    UnfinishedText,
    differences,
    undisturbed,
)
from asperity.outputs.written import require_folder, written_file, written_folder

__all__ = [
    "Interrupted",
    "UnfinishedOutput",
    "UnfinishedText",
    "differences",
    "free_disk",
    "output_file",
    "output_files",
    "require_disk",
    "require_folder",
    "require_memory",
    "require_short",
    "size_text",
    "undisturbed",
    "written_file",
    "written_folder",
]
