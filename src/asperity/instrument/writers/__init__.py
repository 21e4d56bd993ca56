"""Writers of recordings in the formats of laboratories."""

from asperity.instrument.writers.write import check_path, write

__all__ = ["check_path", "write"]
