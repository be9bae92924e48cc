"""openapi-typescript and openapi-fetch make a client that type-checks, uploads, follows and downloads."""

import json
import os
import shutil
import subprocess
from pathlib import Path

from server import packed

HERE = Path(__file__).resolve().parent
# Where the packages are installed: sources and what is made of them go beside these.
FOLDER = Path(os.environ["API_TYPESCRIPT"])


def run(*command: object) -> str:
    ran = subprocess.run([str(part) for part in command], check=False, cwd=FOLDER, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


def test_a_generated_client_uploads_follows_and_downloads(server, document, tmp_path):
    for name in ["follow.ts", "tsconfig.json"]:
        shutil.copy(HERE / "typescript" / name, FOLDER / name)
    programs = FOLDER / "node_modules" / ".bin"
    run(programs / "openapi-typescript", document, "--output", FOLDER / "api.d.ts")
    run(programs / "tsc", "--noEmit")
    run(programs / "tsc")

    _, token = server.create_team("TypeScript")
    sent, downloaded = tmp_path / "hold.tar.gz", tmp_path / "downloaded"
    sent.write_bytes(packed())
    seen = json.loads(run("node", "out/follow.js", server.url, token, sent, downloaded))
    assert seen["state"] == "valid", seen
    assert seen["file_name"] == "hold.tar.gz"
    assert downloaded.read_bytes() == sent.read_bytes()
