"""Questions as frozen records, which Python, the command line, files and the page fill alike.

A record has the fields, their types and the rules between fields; the answer is computed elsewhere.
The JSON schema of a record is that of pydantic: ``Fit.model_json_schema()``.
"""
