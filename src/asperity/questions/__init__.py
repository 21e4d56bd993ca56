"""Questions as frozen records, which Python, the command line, files and the page fill alike.

A record has the fields, their types and the rules between fields; other rooms compute the answers.
pydantic makes the JSON schema of a record: ``Fit.model_json_schema()``.
"""
