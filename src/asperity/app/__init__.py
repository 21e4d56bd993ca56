"""The browser page: a server on this machine, and a page that fetches nothing from outside.

Nothing here solves anything: a request becomes a call of the other rooms, and its result becomes
JSON. A tab of the page is one module in `asperity.app.api` and one in ``static/tabs``.
"""
