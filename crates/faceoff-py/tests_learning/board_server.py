"""A server with one stage that evaluates `defend`, for agents of the tests."""

from __future__ import annotations

import json
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any


class BoardServer:
    """`faceoff serve` as a child process, which `stop` ends."""

    def __init__(self, program: Path, folder: Path, config: str, episodes: int) -> None:
        """`config` has the runtime and time limits. An evaluation has this number of episodes."""
        self.program = program
        self.folder = folder
        path = folder / "server.toml"
        path.write_text(
            f'{config}\n[server]\nlisten = "127.0.0.1:0"\nmin_free_bytes = 0\n'
            f'[evaluation]\ntasks = ["defend"]\nepisodes_per_task = {episodes}\n'
            "[workers]\nslots = 1\n[sandbox]\nresident_bytes = 0\n"
        )
        self._log = (folder / "server.log").open("wb")
        command = [program, "serve", "--config", path, "--data-dir", folder / "data"]
        self._process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=self._log, text=True)
        # Its only line of output is its address, missing if the server ends before.
        assert self._process.stdout is not None
        self.url = self._process.stdout.readline().strip()
        if not self.url:
            raise RuntimeError((folder / "server.log").read_text())
        self.organiser = (folder / "data" / "admin-token").read_text().strip()

    def request(self, method: str, path: str, token: str, content: Any = None) -> Any:
        """The answer to a request that must succeed."""
        headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
        body = None if content is None else json.dumps(content).encode()
        request = urllib.request.Request(f"{self.url}/api/v1{path}", body, headers, method=method)
        with urllib.request.urlopen(request) as response:
            return json.loads(response.read() or "null")

    def score(self, agent: Path) -> dict[str, Any]:
        """Submits an agent's folder as the page says, starts the day's evaluation, and returns the evaluation."""
        self.team = self.request("POST", "/teams", self.organiser, {"name": "Learners"})["token"]
        command = [self.program, "submit", agent, "--server", self.url, "--token", self.team]
        submitted = subprocess.run(command, capture_output=True, text=True)
        assert submitted.returncode == 0, submitted.stderr + submitted.stdout
        self.request("POST", "/days", self.organiser)
        while True:
            # There is no time limit, since the machine may be slow.
            evaluations = self.request("GET", "/evaluations", self.organiser)
            if evaluations and "finished_at" in evaluations[0]:
                break
            time.sleep(0.5)
        [evaluation] = evaluations
        assert evaluation["state"] == "finished", json.dumps(evaluation, indent=2)
        detail: dict[str, Any] = self.request("GET", f"/evaluations/{evaluation['id']}", self.organiser)
        return detail

    def dataset(self, evaluation: dict[str, Any], file: Path) -> Path:
        """Downloads the evaluation's dataset, as its team, to this file."""
        request = urllib.request.Request(self.url + evaluation["dataset"], headers={"Authorization": f"Bearer {self.team}"})
        with urllib.request.urlopen(request) as response:
            file.write_bytes(response.read())
        return file

    def stop(self) -> None:
        """Kills the server; its data is not needed any more."""
        self._process.kill()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()
        self._log.close()
