"""Every operation, asked as visitor, team and organiser for what the document says and for what it does not.

No answer is a server's failure, has a status or a body that the document does not tell, or takes what it says is wrong.
Event streams have no end, so they are tried by the tests of the crate. Inputs follow from a fixed seed.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from server import Server, play

HERE = Path(__file__).resolve().parent
# As many inputs as fit into a minute, the same ones each time. For an answer it waits so long that only a dead machine
# takes it.
OPTIONS = (
    "--phases examples,coverage,fuzzing --max-examples 10 --seed 1 --generation-database none --workers 1 "
    "--request-timeout 1800 --continue-on-failure --suppress-health-check all --no-color"
)
# What can end the token that it is asked with.
LOSING = ["end_session", "rotate_token", "revoke_token"]
# Streams of events have no end.
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
def test_every_operation_answers_as_the_document_says(role, tmp_path, document):
    server = Server(tmp_path)
    try:
        season = play(server)
        told = json.loads(document.read_text())
        token = season.tokens[role]
        environment = {
            **os.environ,
            "SCHEMATHESIS_HOOKS": "hooks",
            "PYTHONPATH": str(HERE),
            "API_URL": server.api,
            "API_IDS": json.dumps(season.ids),
            "API_LOSING": json.dumps(LOSING),
            "API_ARCHIVE_TYPES": json.dumps(
                list(told["paths"]["/api/v1/submissions"]["post"]["requestBody"]["content"])
            ),
        }
        if token is not None:
            environment["API_TOKEN"] = token
        # Each case of those that end tokens needs one of its own, which others could have used up.
        of_all = [
            [f"--include-operation-id={name}" for name in LOSING],
            [f"--exclude-operation-id={name}" for name in LOSING + ENDLESS],
        ]
        for which in of_all:
            command = [sys.executable, "-m", "schemathesis.cli", "run", f"{server.api}/openapi.json"]
            command += [*OPTIONS.split(), "--checks", ",".join(CHECKS), *which]
            ran = subprocess.run(command, check=False, cwd=tmp_path, env=environment, capture_output=True, text=True)
            assert ran.returncode == 0, ran.stdout + ran.stderr
            print(ran.stdout)
        if token is not None:
            # None of it was asked with a token that had meanwhile become worth nothing.
            server.ask("GET", "/whoami", token)
    finally:
        server.end()
