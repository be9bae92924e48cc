"""The API's document, /api/v1/openapi.json, is valid OpenAPI 3.1, and its operations have unique names."""

import json

from openapi_spec_validator import OpenAPIV31SpecValidator


def test_document_is_valid_openapi(document):
    content = json.loads(document.read_text())
    assert content["openapi"].startswith("3.1.")
    errors = [
        f"{'/'.join(map(str, error.absolute_path))}: {error.message}"
        for error in OpenAPIV31SpecValidator(content).iter_errors()
    ]
    assert not errors, "\n".join(errors)


def test_operations_have_unique_names(document):
    content = json.loads(document.read_text())
    names = [operation["operationId"] for item in content["paths"].values() for operation in item.values()]
    assert len(names) == len(set(names))
