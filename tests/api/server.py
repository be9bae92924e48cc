"""A real `faceoff serve`, and a season with one resource of every kind that a path can name."""

import io
import json
import os
import subprocess
import tarfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import httpx

HOLD = Path(__file__).resolve().parents[2] / "agents" / "hold"

# Two episodes are enough for a dataset. A debug build is slow, so time limits are long.
CONFIG = """
[rates]
token_per_s = 0
team_changes_per_day = 0
[server]
listen = "127.0.0.1:0"
min_free_bytes = 0
[evaluation]
tasks = ["hit"]
episodes_per_task = 2
[workers]
slots = 1
[sandbox]
resident_bytes = 0
[time]
startup_s = 600.0
reset_s = 600.0
step_s = 600.0
bye_s = 600.0
mean_s = 600.0
episode_extra_s = 3600.0
resets_extra_s = 3600.0
"""


def pack_bundle(folder: Path = HOLD) -> bytes:
    """The folder of a bundle as `.tar.gz`."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz") as archive:
        for file in sorted(folder.iterdir()):
            archive.add(file, file.name)
    return buffer.getvalue()


def poll(read, is_done):
    """Calls `read` until its value meets the condition, and returns that value. There is no time limit, since the machine may be slow."""
    while not is_done(value := read()):
        time.sleep(0.1)
    return value


class Server:
    """The server as a child process, with the operator's token."""

    def __init__(self, folder: Path):
        config = folder / "faceoff.toml"
        config.write_text(CONFIG)
        self._log = (folder / "server.log").open("wb")
        data = folder / "data"
        command = [os.environ["FACEOFF_BIN"], "serve", "--config", str(config), "--data-dir", str(data)]
        self._process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=self._log, text=True)
        # The only line on its standard output is its address. It is missing if the server ends before.
        self.url = self._process.stdout.readline().strip()
        if not self.url:
            raise RuntimeError((folder / "server.log").read_text())
        self.api = f"{self.url}/api/v1"
        self.organiser = (data / "admin-token").read_text().strip()

    def request(self, method: str, path: str, token: str | None = None, **options) -> httpx.Response:
        """A request that must succeed."""
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        headers.update(options.pop("headers", {}))
        response = httpx.request(method, self.api + path, headers=headers, timeout=None, **options)
        assert response.is_success, f"{method} {path}: {response.status_code} {response.text}"
        return response

    def create_team(self, name: str) -> tuple[str, str]:
        """Creates a team. Returns its id and token."""
        team = self.request("POST", "/teams", self.organiser, json={"name": name}).json()
        return team["id"], team["token"]

    def stop(self) -> None:
        """Kills the server; its data is not needed any more."""
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()
        self._log.close()


@dataclass
class Season:
    """Tokens by role, and ids of resources."""

    server: Server
    # Values of `{id}` in paths, by the first part of the path.
    ids: dict[str, list[str]] = field(default_factory=dict)
    tokens: dict[str, str | None] = field(default_factory=dict)


def create_season(server: Server) -> Season:
    """A season with submissions, a finished day, and a tournament with a queued game."""
    alpha, alpha_token = server.create_team("Alpha")
    beta, beta_token = server.create_team("Beta")
    organiser = server.organiser

    def upload(token: str) -> dict:
        archive = {"Content-Type": "application/octet-stream"}
        submission = server.request("POST", "/submissions", token, content=pack_bundle(), headers=archive).json()
        path = f"/submissions/{submission['id']}"
        submission = poll(lambda: server.request("GET", path, token).json(), lambda view: view["state"] != "validating")
        assert submission["state"] == "valid", json.dumps(submission, indent=2)
        return submission

    submissions = [upload(alpha_token), upload(beta_token)]
    server.request("POST", "/days", organiser)
    evaluations = poll(
        lambda: server.request("GET", "/evaluations", organiser).json(),
        lambda views: len(views) == 2 and all("finished_at" in view for view in views),
    )
    assert all(view["state"] == "finished" for view in evaluations), json.dumps(evaluations, indent=2)
    # Jobs that are created from now on stay queued, so that no response depends on the progress of the slot.
    server.request("POST", "/queue/pause", organiser, json={"reason": "All operations are tested."})
    server.request("PATCH", "/season", organiser, json={"takes_registrations": True, "divisions": ["Open"]})
    registration = {"team": {"name": "Gamma"}, "contact": "gamma@example.org"}
    registration = server.request("POST", "/registrations", json=registration).json()
    invitation = {"role": "member", "team": alpha, "note": "Ada"}
    invitations = [server.request("POST", "/invitations", organiser, json=invitation).json() for _ in range(2)]
    acceptance = {"code": invitations[0]["code"], "name": "Ada"}
    ada = server.request("POST", "/invitations/accept", json=acceptance).json()
    cup = {"name": "Cup", "teams": ["Alpha", "Beta"], "rules": {"steps": 500}}
    tournament = server.request("POST", "/tournaments", organiser, json=cup).json()
    path = f"/tournaments/{tournament['id']}/friendly-games"
    game = server.request("POST", path, alpha_token, json={"opponent": "Beta"}).json()
    question = server.request("POST", "/questions", alpha_token, json={"text": "When is the final?"}).json()
    spare_token = server.request("POST", "/tokens", organiser, json={"name": "spare"}).json()
    stages = server.request("GET", "/stages").json()
    ids = {
        "teams": [alpha, beta],
        "submissions": [view["id"] for view in submissions],
        "evaluations": [view["id"] for view in evaluations],
        "stages": [view["id"] for view in stages],
        "registrations": [registration["id"]],
        "invitations": [invitations[1]["id"]],
        "tournaments": [tournament["id"]],
        "games": [game["id"]],
        "questions": [question["id"]],
        "tokens": [spare_token["id"]],
        "people": [ada["person"]["id"]],
    }
    tokens = {"visitor": None, "team": ada["secret"], "organiser": organiser}
    return Season(server, ids, tokens)
