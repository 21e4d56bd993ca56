"""Writers of recordings in the formats of laboratories."""

from asperity.recording.writers.write import check_path, write

__all__ = ["check_path", "write"]
