"""Fixtures of the API's tests: a running server, and its OpenAPI document."""

import json
from pathlib import Path

import httpx
import pytest
from server import Server


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """A server that tests share: they do not change what other tests check."""
    running = Server(tmp_path_factory.mktemp("server"))
    yield running
    running.stop()


@pytest.fixture(scope="session")
def document(server, tmp_path_factory) -> Path:
    """The OpenAPI document that the server returns."""
    file = tmp_path_factory.mktemp("document") / "openapi.json"
    file.write_text(json.dumps(httpx.get(f"{server.api}/openapi.json").json()))
    return file
