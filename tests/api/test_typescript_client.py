"""The client of openapi-typescript and openapi-fetch type-checks, and can upload, poll and download."""

import json
import os
import shutil
import subprocess
from pathlib import Path

from server import pack_bundle

HERE = Path(__file__).resolve().parent
# The folder with the installed packages: sources and compiled files go there, too.
FOLDER = Path(os.environ["API_TYPESCRIPT"])


def run(*command: object) -> str:
    result = subprocess.run([str(part) for part in command], check=False, cwd=FOLDER, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def test_generated_client_uploads_polls_and_downloads(server, document, tmp_path):
    for name in ["follow.ts", "tsconfig.json"]:
        shutil.copy(HERE / "typescript" / name, FOLDER / name)
    programs = FOLDER / "node_modules" / ".bin"
    run(programs / "openapi-typescript", document, "--output", FOLDER / "api.d.ts")
    run(programs / "tsc", "--noEmit")
    run(programs / "tsc")

    _, token = server.create_team("TypeScript")
    sent, downloaded = tmp_path / "hold.tar.gz", tmp_path / "downloaded"
    sent.write_bytes(pack_bundle())
    submission = json.loads(run("node", "out/follow.js", server.url, token, sent, downloaded))
    assert submission["state"] == "valid", submission
    assert submission["file_name"] == "hold.tar.gz"
    assert downloaded.read_bytes() == sent.read_bytes()
