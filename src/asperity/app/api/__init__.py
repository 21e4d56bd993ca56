"""Endpoints of the page: one module for each tab or panel, and the catalogue that all tabs share.

A module of a tab has ``ENDPOINTS``, a tuple of `asperity.app.endpoints.Answer` and `Job`, and may
have ``preparations()``, see `asperity.app.preparation`.
"""

#: Modules of this package with endpoints, in the order of the tabs.
TABS = ("explore", "motion", "map", "data", "paper")
