"""The client that openapi-python-client generates can upload, poll and download."""

import importlib
import io
import subprocess
import sys
from pathlib import Path

import pytest
from server import pack_bundle, poll

HERE = Path(__file__).resolve().parent


@pytest.fixture
def client_package(document, tmp_path, monkeypatch):
    """The generated package, importable."""
    command = [
        sys.executable,
        "-m",
        "openapi_python_client",
        "generate",
        "--path",
        document,
        "--config",
        HERE / "python-client.yml",
        "--meta",
        "none",
        "--output-path",
        tmp_path / "faceoff_client",
    ]
    generated = subprocess.run(command, check=False, capture_output=True, text=True)
    assert generated.returncode == 0, generated.stdout + generated.stderr
    monkeypatch.syspath_prepend(tmp_path)
    return importlib.import_module("faceoff_client")


def test_generated_client_uploads_polls_and_downloads(server, client_package):
    team = importlib.import_module("faceoff_client.api.team")
    api = {
        name: importlib.import_module(f"{team.__name__}.{name}")
        for name in ["create_submission", "submission", "download_bundle"]
    }
    types = importlib.import_module("faceoff_client.types")
    _, token = server.create_team("Python")
    client = client_package.AuthenticatedClient(base_url=server.url, token=token)

    archive = pack_bundle()
    body = types.File(payload=io.BytesIO(archive))
    sent = api["create_submission"].sync_detailed(client=client, body=body, file_name="hold.tar.gz")
    assert sent.status_code == 201, sent.content
    assert sent.headers["Location"] == f"/api/v1/submissions/{sent.parsed.id}"
    assert (sent.parsed.file_name, sent.parsed.bytes_) == ("hold.tar.gz", len(archive))

    validated = poll(
        lambda: api["submission"].sync(id=sent.parsed.id, client=client),
        lambda submission: submission.state.value != "validating",
    )
    assert validated.state.value == "valid", validated
    downloaded = api["download_bundle"].sync(id=sent.parsed.id, client=client)
    assert downloaded.payload.read() == archive


def test_generated_client_reads_problems(server, client_package):
    api = importlib.import_module("faceoff_client.api.team.list_submissions")
    client = client_package.AuthenticatedClient(base_url=server.url, token="fo_team_unknown")
    refused = api.sync_detailed(client=client)
    assert refused.status_code == 401
    assert refused.parsed.type_ == "/problems#unauthenticated"
