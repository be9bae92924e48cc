"""The document is OpenAPI 3.1, and says of each operation what a client must know."""

import json

from openapi_spec_validator import OpenAPIV31SpecValidator


def test_the_document_is_valid_openapi(document):
    told = json.loads(document.read_text())
    assert told["openapi"].startswith("3.1.")
    found = [
        f"{'/'.join(map(str, error.absolute_path))}: {error.message}"
        for error in OpenAPIV31SpecValidator(told).iter_errors()
    ]
    assert not found, "\n".join(found)


def test_operations_have_names_of_their_own(document):
    told = json.loads(document.read_text())
    names = [operation["operationId"] for item in told["paths"].values() for operation in item.values()]
    assert len(names) == len(set(names))
