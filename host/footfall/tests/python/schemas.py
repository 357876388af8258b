"""Checks objects against their schemas: schemas.py SCHEMA OBJECT [SCHEMA OBJECT ...].

A schema lets unknown fields pass, as those of a later version; here each field of an object must be
described. And a schema must not let everything pass: without any one of its fields that are
required, or with another type in its place, an object must not.
"""

import copy
import json
import sys

from jsonschema import Draft202012Validator


def no_constant(name):
    raise ValueError(f"{name} is no JSON")


def read(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file, parse_constant=no_constant)


def close(node):
    """No object has other fields than those that the schema names."""
    if isinstance(node, dict):
        if "properties" in node and "additionalProperties" not in node:
            node["additionalProperties"] = False
        for value in node.values():
            close(value)
    elif isinstance(node, list):
        for value in node:
            close(value)


def check(schema_path, object_path):
    schema, found = read(schema_path), read(object_path)
    Draft202012Validator.check_schema(schema)
    closed = copy.deepcopy(schema)
    close(closed)
    errors = sorted(Draft202012Validator(closed).iter_errors(found), key=lambda error: error.json_path)
    for error in errors:
        print(f"{object_path}: {error.json_path}: {error.message}")
    assert not errors
    valid = Draft202012Validator(schema).is_valid
    if "schema" in schema.get("properties", {}):
        assert found["schema"] == schema["$id"]
    elif schema["type"] == "array":
        assert found and not valid({}) and not valid([{}])
        for field in found[0]:
            assert not valid([{name: value for name, value in found[0].items() if name != field}])
    else:
        assert found and not valid([]) and not any(valid({name: []}) for name in found)
    for field in schema.get("required", []):
        without = {name: value for name, value in found.items() if name != field}
        assert not valid(without), f"{object_path} without {field}"
        other = dict(found, **{field: {"no": "such"} if not isinstance(found[field], dict) else 1})
        assert not valid(other), f"{object_path} with another {field}"


pairs = sys.argv[1:]
for schema_path, object_path in zip(pairs[::2], pairs[1::2]):
    check(schema_path, object_path)
print(f"{len(pairs) // 2} objects are as their schemas say")
