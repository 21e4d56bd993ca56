"""Public names of a package: those that it imports as themselves, at once or when first used.

Names that are imported when first used are listed once, in the stub ``__init__.pyi`` of the
package, which type checkers and editors read too.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType


def lazy_names(
    package: str, file: str
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """The ``__getattr__``, the ``__dir__`` and the ``__all__`` of a package.

    Parameters
    ----------
    package, file : str
        Its ``__name__`` and ``__file__``. Next to the file is the stub, which imports each public
        name as itself, or assigns it.
    """
    stub = ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8"))
    homes: dict[str, tuple[str, str]] = {}
    public: list[str] = []
    for node in stub.body:
        if isinstance(node, ast.ImportFrom):
            homes |= {alias.name: (node.module or package, alias.name) for alias in node.names}
            public += [alias.asname for alias in node.names if alias.asname]
        elif isinstance(node, ast.Assign):  # a name of its own: ``map = response_map``
            public.append(ast.unparse(node.targets[0]))
            homes[public[-1]] = homes[ast.unparse(node.value)]

    def get(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        module, there = homes[name]
        if module == package:
            return import_module(f"{package}.{there}")
        return getattr(import_module(module), there)

    return get, lambda: sorted(public), public


def public_names(names: Mapping[str, object]) -> list[str]:
    """The ``__all__`` of a package that imports its public names, and nothing else, as themselves.

    Parameters
    ----------
    names : mapping of str to object
        Its ``globals()``.
    """
    private = {n for n, v in names.items() if isinstance(v, ModuleType) or v is public_names}
    return sorted(n for n in names if not n.startswith("_") and n not in private)
