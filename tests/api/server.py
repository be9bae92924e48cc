"""A real `faceoff serve`, and a season on it with one of everything that a path can name."""

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

# Two episodes are a dataset. A debug build is slow, so no agent is held to its time.
CONFIG = """
[rates]
token_per_s = 0
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


def packed(folder: Path = HOLD) -> bytes:
    """A bundle's folder as `.tar.gz`."""
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w:gz") as archive:
        for file in sorted(folder.iterdir()):
            archive.add(file, file.name)
    return made.getvalue()


def poll(look, is_reached):
    """Looks until what must come has come; whatever is waited for ends by itself, however slow the machine."""
    while not is_reached(seen := look()):
        time.sleep(0.1)
    return seen


class Server:
    """The server as a child process, and who it knows."""

    def __init__(self, folder: Path):
        config = folder / "faceoff.toml"
        config.write_text(CONFIG)
        self._log = (folder / "server.log").open("wb")
        data = folder / "data"
        command = [os.environ["FACEOFF_BIN"], "serve", "--config", str(config), "--data-dir", str(data)]
        self._process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=self._log, text=True)
        # The only line on its standard output is its address; none comes if it ends before.
        self.url = self._process.stdout.readline().strip()
        if not self.url:
            raise RuntimeError((folder / "server.log").read_text())
        self.api = f"{self.url}/api/v1"
        self.organiser = (data / "admin-token").read_text().strip()

    def ask(self, method: str, path: str, token: str | None = None, **request) -> httpx.Response:
        """A request that is as it should be."""
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        headers.update(request.pop("headers", {}))
        answer = httpx.request(method, self.api + path, headers=headers, timeout=None, **request)
        assert answer.is_success, f"{method} {path}: {answer.status_code} {answer.text}"
        return answer

    def create_team(self, name: str) -> tuple[str, str]:
        """A team's id and token."""
        made = self.ask("POST", "/teams", self.organiser, json={"name": name}).json()
        return made["id"], made["token"]

    def end(self) -> None:
        """Kills it: what it holds is thrown away."""
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()
        self._log.close()


@dataclass
class Season:
    """Who may ask, and what there is to ask for."""

    server: Server
    # What `{id}` may be, by the resource that the path begins with.
    ids: dict[str, list[str]] = field(default_factory=dict)
    tokens: dict[str, str | None] = field(default_factory=dict)


def play(server: Server) -> Season:
    """A season in which a team has uploaded, a day was played, and a tournament has a game in the queue."""
    alpha, alpha_token = server.create_team("Alpha")
    beta, beta_token = server.create_team("Beta")
    organiser = server.organiser

    def upload(token: str) -> dict:
        archive = {"Content-Type": "application/octet-stream"}
        sent = server.ask("POST", "/submissions", token, content=packed(), headers=archive).json()
        path = f"/submissions/{sent['id']}"
        seen = poll(lambda: server.ask("GET", path, token).json(), lambda seen: seen["state"] != "validating")
        assert seen["state"] == "valid", json.dumps(seen, indent=2)
        return seen

    submissions = [upload(alpha_token), upload(beta_token)]
    server.ask("POST", "/days", organiser)
    evaluations = poll(
        lambda: server.ask("GET", "/evaluations", organiser).json(),
        lambda seen: len(seen) == 2 and all("finished_at" in one for one in seen),
    )
    assert all(one["state"] == "finished" for one in evaluations), json.dumps(evaluations, indent=2)
    # What is ordered from now on stays as it is, so that no answer depends on how far the slot has come.
    server.ask("POST", "/queue/pause", organiser, json={"reason": "Everything is tried."})
    server.ask("PATCH", "/season", organiser, json={"takes_registrations": True, "divisions": ["Open"]})
    registered = {"team": {"name": "Gamma"}, "contact": "gamma@example.org"}
    registration = server.ask("POST", "/registrations", json=registered).json()
    invited = {"role": "member", "team": alpha, "note": "Ada"}
    invitations = [server.ask("POST", "/invitations", organiser, json=invited).json() for _ in range(2)]
    joins = {"code": invitations[0]["code"], "name": "Ada"}
    ada = server.ask("POST", "/invitations/accept", json=joins).json()
    cup = {"name": "Cup", "teams": ["Alpha", "Beta"], "rules": {"steps": 500}}
    tournament = server.ask("POST", "/tournaments", organiser, json=cup).json()
    path = f"/tournaments/{tournament['id']}/friendly-games"
    game = server.ask("POST", path, alpha_token, json={"opponent": "Beta"}).json()
    question = server.ask("POST", "/questions", alpha_token, json={"text": "When is the final?"}).json()
    own = server.ask("POST", "/tokens", organiser, json={"name": "spare"}).json()
    stages = server.ask("GET", "/stages").json()
    found = {
        "teams": [alpha, beta],
        "submissions": [one["id"] for one in submissions],
        "evaluations": [one["id"] for one in evaluations],
        "stages": [one["id"] for one in stages],
        "registrations": [registration["id"]],
        "invitations": [invitations[1]["id"]],
        "tournaments": [tournament["id"]],
        "games": [game["id"]],
        "questions": [question["id"]],
        "tokens": [own["id"]],
        "people": [ada["person"]["id"]],
    }
    tokens = {"visitor": None, "team": ada["secret"], "organiser": organiser}
    return Season(server, found, tokens)
