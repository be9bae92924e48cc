import json
from pathlib import Path

import httpx
import pytest
from server import Server


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """For what changes nothing that another test looks at."""
    running = Server(tmp_path_factory.mktemp("server"))
    yield running
    running.end()


@pytest.fixture(scope="session")
def document(server, tmp_path_factory) -> Path:
    """The document as the server tells it."""
    file = tmp_path_factory.mktemp("document") / "openapi.json"
    file.write_text(json.dumps(httpx.get(f"{server.api}/openapi.json").json()))
    return file
