"""Fields of questions: numbers are no texts and no switches, and switches are no numbers."""

import importlib
import pkgutil

import pytest
from pydantic import PydanticUserError, TypeAdapter, ValidationError

import asperity.app.api
import asperity.questions
from asperity.app.endpoints import Question
from asperity.errors import InputError
from asperity.questions.record import Record

PACKAGES = (asperity.questions, asperity.app.api)
for package in PACKAGES:
    for module in pkgutil.iter_modules(package.__path__, package.__name__ + "."):
        importlib.import_module(module.name)


def records(base):
    """All kinds of a record."""
    return {base, *(kind for part in base.__subclasses__() for kind in records(part))}


#: JSON types of a field, and values that it must refuse.
REFUSED = {"integer": (True, "3", 2.5), "number": (True,), "boolean": (1, "true")}


def plain_types():
    """Fields that are a number or a switch, with the JSON type."""
    places = tuple(package.__name__ for package in PACKAGES)
    every = records(Record) | records(Question)
    for record in sorted((r for r in every if r.__module__.startswith(places)), key=str):
        for name, field in record.model_fields.items():
            try:
                adapter = TypeAdapter(field.rebuild_annotation())
                schema = adapter.json_schema()
            except PydanticUserError:
                continue
            kinds = [part.get("type") for part in schema.get("anyOf", [schema])]
            kinds = [kind for kind in kinds if kind != "null"]
            if len(kinds) == 1 and kinds[0] in list(REFUSED):
                yield pytest.param(adapter, kinds[0], id=f"{record.__name__}.{name}")


@pytest.mark.parametrize(("adapter", "kind"), list(plain_types()))
def test_a_field_takes_its_own_type_only(adapter, kind):
    for value in REFUSED[kind]:
        with pytest.raises((ValidationError, InputError)):
            adapter.validate_python(value)


@pytest.mark.parametrize("record", sorted(records(Question), key=str))
def test_limits_are_keywords_of_json_schema(record):
    assert not {"ge", "gt", "le", "lt"} & set(keys_of(record.model_json_schema()))


def keys_of(schema):
    """All keys of a schema, of its parts too."""
    if isinstance(schema, dict):
        yield from schema
        schema = list(schema.values())
    for part in schema if isinstance(schema, list) else ():
        yield from keys_of(part)
