"""Every operation as visitor, team and organiser, with valid and invalid input.

Fails on server errors, on statuses and bodies that are not documented, and on invalid input that is accepted. Event streams
have no end, so the crate's own tests cover them. Inputs are generated from a fixed seed.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from server import Server, create_season

HERE = Path(__file__).resolve().parent
# As many inputs as fit into a minute, the same ones each time. The time limit is so long that no working machine reaches it.
OPTIONS = (
    "--phases examples,coverage,fuzzing --max-examples 10 --seed 1 --generation-database none --workers 1 "
    "--request-timeout 1800 --continue-on-failure --suppress-health-check all --no-color"
)
# Operations that can end the token of the request.
TOKEN_ENDING = ["end_session", "rotate_token", "revoke_token"]
# Event streams have no end.
ENDLESS = ["watch_game", "follow_events"]
CHECKS = [
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "negative_data_rejection",
    "unsupported_method",
    "ignored_auth",
]


@pytest.mark.parametrize("role", ["visitor", "team", "organiser"])
def test_operations_conform_to_the_document(role, tmp_path, document):
    server = Server(tmp_path)
    try:
        season = create_season(server)
        content = json.loads(document.read_text())
        token = season.tokens[role]
        environment = {
            **os.environ,
            "SCHEMATHESIS_HOOKS": "hooks",
            "PYTHONPATH": str(HERE),
            "API_URL": server.api,
            "API_IDS": json.dumps(season.ids),
            "API_TOKEN_ENDING": json.dumps(TOKEN_ENDING),
            "API_ARCHIVE_TYPES": json.dumps(
                list(content["paths"]["/api/v1/submissions"]["post"]["requestBody"]["content"])
            ),
        }
        if token is not None:
            environment["API_TOKEN"] = token
        # Each case of an operation that ends tokens needs a new token, so these run separately.
        selections = [
            [f"--include-operation-id={name}" for name in TOKEN_ENDING],
            [f"--exclude-operation-id={name}" for name in TOKEN_ENDING + ENDLESS],
        ]
        for selection in selections:
            command = [sys.executable, "-m", "schemathesis.cli", "run", f"{server.api}/openapi.json"]
            command += [*OPTIONS.split(), "--checks", ",".join(CHECKS), *selection]
            ran = subprocess.run(command, check=False, cwd=tmp_path, env=environment, capture_output=True, text=True)
            assert ran.returncode == 0, ran.stdout + ran.stderr
            print(ran.stdout)
        if token is not None:
            # The token must still be valid, so all requests were authenticated.
            server.request("GET", "/whoami", token)
    finally:
        server.stop()
