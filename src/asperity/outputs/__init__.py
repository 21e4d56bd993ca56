"""Output files and folders: checked before a computation, and complete or absent after it.

`targets` checks output paths before anything is computed, `atomic` writes a file or a folder
completely or not at all, and `resumable` keeps the finished blocks of a long computation, so that
it can continue after an interruption.
"""

from asperity._lazy import public_names
from asperity.outputs.atomic import (
    require_folder as require_folder,
    write_table as write_table,
    written_file as written_file,
    written_folder as written_folder,
)
from asperity.outputs.resumable import (
    Interrupted as Interrupted,
    UnfinishedOutput as UnfinishedOutput,
    UnfinishedText as UnfinishedText,
    differences as differences,
    undisturbed as undisturbed,
)
from asperity.outputs.targets import (
    free_disk as free_disk,
    output_file as output_file,
    output_files as output_files,
    require_disk as require_disk,
    require_memory as require_memory,
    require_netcdf as require_netcdf,
    require_short as require_short,
    size_text as size_text,
)

__all__ = public_names(globals())
