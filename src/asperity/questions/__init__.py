"""Questions as frozen records, which Python, the command line, files and the page fill alike.

A record knows its fields, their types and what must agree within it, and nothing of how the
question is answered. Its JSON schema is that of pydantic: ``Fit.model_json_schema()``.
"""
