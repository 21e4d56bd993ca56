"""The browser page: a server on this machine, and a page that loads nothing from elsewhere.

This room solves nothing: it turns a request into a call of another room, and the result into JSON.
A tab of the page is a module in `asperity.app.api` and a module in ``static/tabs``.
"""
