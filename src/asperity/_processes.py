"""The environment of the processes that compute next to this one."""

from __future__ import annotations

import os

#: One thread for XLA and for the linear algebra of NumPy: sums over several threads differ in their
#: last bits from sums in one, and more threads than cores slow all of them. The CPU, as in
#: `asperity._jax.configure`: every process that starts on an accelerator takes most of its memory.
ENVIRONMENT = {
    "NPROC": "1",
    **dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
    "JAX_PLATFORMS": os.environ.get("JAX_PLATFORMS") or "cpu",
}
