"""The store of a sweep: a Zarr hierarchy that any reader opens, written chunk by chunk."""

from asperity.sweep.store.lock import StoreLock
from asperity.sweep.store.store import SweepStore

__all__ = ["StoreLock", "SweepStore"]
