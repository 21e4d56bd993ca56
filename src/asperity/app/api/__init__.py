"""What the page asks for: one module a tab or a panel, and the catalogue that all tabs share.

Such a module has ``ENDPOINTS``, a tuple of `asperity.app.endpoints.Answer` and `Job`, and may have
``preparations()``, see `asperity.app.jobs.threads`.
"""

#: Modules of this package with endpoints, in the order of the tabs.
TABS = ("explore", "motion", "map", "data", "paper")
