"""Files that are read as a whole, and end."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

#: Bytes of a file of texts: a table or a plan with a million rows of several numbers has less.
LARGEST = 128 * 2**20


def file_content(path: Path) -> bytes:
    """The bytes of a file.

    Raises
    ------
    OSError
        If it cannot be read, is a device, or is larger than any text that this package is given.
    """
    with path.open("rb") as stream:
        if stat.S_ISCHR(os.fstat(stream.fileno()).st_mode):
            raise OSError(errno.EINVAL, "it is a device")
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise OSError(errno.EFBIG, f"it has more than {LARGEST:,} bytes")
    return content
