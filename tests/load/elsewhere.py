"""What it costs to play on another machine: one slot elsewhere against one of the server's own, on the loopback.

    python3 tests/load/elsewhere.py target/release/faceoff [ROUNDS]

In turns, so that what else the machine does falls on both alike: a season of its own, one team with the agent hold, nine shards of
50 episodes, played by the server's own slot or by one of a worker, who gets them by a nats-server on this machine. Measured are, by the log
of whoever plays, the time from the first shard's beginning to the last one's commit, and of it what lies between two shards: from the end of
one's last episode to the beginning of the next one, while the slot does not play. A third season is like the second, but nothing of its
recordings is simulated again: what its server takes less is what checking costs. Prints each round's times, the median of
their ratios, what lies between two shards in either, and the server's CPU time. How fast the same episodes are played twice differs on most
machines by more than what is asked here, so the ratio needs many rounds; what lies between needs few. Nothing is asserted: how fast a
machine is, is the machine's.
"""

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

SHARDS = 9  # three of each task
CONFIG = """
[server]
listen = "127.0.0.1:0"
[evaluation]
episodes_per_task = 150
episodes_per_shard = 50
[workers]
slots = 1
"""


@dataclass
class Played:
    """When each shard of a season was begun, played to its end and committed, in seconds."""

    begun: list[float]
    played: list[float]
    committed: list[float]

    def took(self) -> float:
        return self.committed[-1] - self.begun[0]

    def plays(self) -> list[float]:
        return [end - begin for begin, end in zip(self.begun, self.played)]

    def between(self) -> list[float]:
        return [begin - end for end, begin in zip(self.played, self.begun[1:])]


class Season:
    """A server, and a worker beside it if others are to play."""

    def __init__(self, program: Path, folder: Path, nats: str | None, checks: bool = True):
        folder.mkdir()
        self.folder, self.processes = folder, []
        config = folder / "faceoff.toml"
        own = CONFIG if checks else CONFIG + "checked_episodes = 0\n"
        config.write_text(own + (f'play = false\n[nats]\nurl = "{nats}"\nname = "{folder.name}"\n' if nats else ""))
        self.log = folder / ("worker.log" if nats else "server.log")
        serve = [program, "serve", "--config", config, "--data-dir", folder / "data", "--log-format", "json"]
        self.server = self.start(serve, folder / "server.log")
        self.url = self.server.stdout.readline().strip()
        self.admin = (folder / "data/admin-token").read_text().strip()
        if nats:
            worker = folder / "worker.toml"
            worker.write_text(f'[workers]\nslots = 1\n[nats]\nurl = "{nats}"\nname = "{folder.name}"\n')
            words = [program, "worker", "--name", "one", "--config", worker, "--scratch-dir", folder / "scratch"]
            self.start([*words, "--log-format", "json"], self.log)

    def start(self, words: list, log: Path) -> subprocess.Popen:
        told = os.environ | {"RUST_LOG": "info,faceoff_worker::executor=debug"}
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=log.open("w"), text=True, env=told)
        self.processes.append(process)
        return process

    def ask(self, method: str, path: str, token: str, body=None, media="application/json"):
        body = json.dumps(body).encode() if media == "application/json" and body is not None else body
        request = urllib.request.Request(self.url + path, body, method=method)
        request.add_header("Authorization", f"Bearer {token}")
        request.add_header("Content-Type", media)
        with urllib.request.urlopen(request) as answer:
            return json.load(answer)

    def until(self, path: str, token: str, done):
        while not done(answer := self.ask("GET", path, token)):
            time.sleep(0.5)
        return answer

    def play(self) -> "Played":
        team = self.ask("POST", "/api/v1/teams", self.admin, {"name": "Alpha"})
        hold = Path(__file__).parents[2] / "agents/hold"
        archive = Path(shutil.make_archive(str(self.folder / "hold"), "gztar", hold)).read_bytes()
        path = "/api/v1/submissions?file_name=hold.tar.gz"
        made = self.ask("POST", path, team["token"], archive, "application/octet-stream")
        path = f"/api/v1/submissions/{made['id']}"
        found = self.until(path, team["token"], lambda one: one["state"] != "validating")
        assert found["state"] == "valid", found
        day = self.ask("POST", "/api/v1/days", self.admin, {})
        path = f"/api/v1/evaluations/{day['created'][0]['id']}"
        ended = self.until(path, self.admin, lambda one: one["state"] not in ("queued", "running", "finalising"))
        assert ended["state"] == "finished", ended
        times = {"begun": [], "played": [], "committed": []}
        for line in self.log.read_text().splitlines():
            entry = json.loads(line)
            fields = entry["fields"]
            if fields["message"] == "played" or " episodes " in fields.get("work", ""):
                at = datetime.fromisoformat(entry["timestamp"].replace("Z", "+00:00")).timestamp()
                times.get(fields["message"], []).append(at)
        assert all(len(of) == SHARDS for of in times.values()), times
        return Played(**times)

    def cpu_s(self) -> float:
        """CPU time of the server and of what it has waited for, in seconds."""
        fields = Path(f"/proc/{self.server.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")

    def end(self):
        for process in reversed(self.processes):
            process.terminate()
            process.wait()


def main() -> None:
    program, rounds = Path(sys.argv[1]).resolve(), int((sys.argv[2:] or ["5"])[0])
    with tempfile.TemporaryDirectory(prefix="faceoff-elsewhere-") as name:
        folder = Path(name)
        words = [shutil.which("nats-server", path="/usr/sbin:/usr/bin"), "-js", "-a", "127.0.0.1", "-p", "-1"]
        words += ["-sd", folder / "nats", "--ports_file_dir", folder, "-l", folder / "nats.log"]
        nats = subprocess.Popen(words)
        try:
            told = folder / f"nats-server_{nats.pid}.ports"
            while not told.exists():
                time.sleep(0.05)
            url = json.loads(told.read_text())["nats"][0]
            ratios, checking, plays = [], [], []
            between = {"own": [], "elsewhere": []}
            kinds = ["own", "elsewhere", "unchecked"]
            for number in range(rounds):
                played, cpu = {}, {}
                for who in kinds if number % 2 == 0 else reversed(kinds):
                    season = Season(program, folder / f"{who}-{number}", url if who != "own" else None, who != "unchecked")
                    try:
                        played[who], cpu[who] = season.play(), season.cpu_s()
                    finally:
                        season.end()
                times = {who: of.took() for who, of in played.items()}
                for who, of_all in between.items():
                    of_all += played[who].between()
                    plays += played[who].plays()
                ratios.append(times["elsewhere"] / times["own"])
                checking.append((cpu["elsewhere"] - cpu["unchecked"]) / SHARDS)
                print(
                    f"own slot {times['own']:.2f} s, elsewhere {times['elsewhere']:.2f} s, ratio {ratios[-1]:.4f}, "
                    f"unchecked {times['unchecked']:.2f} s, checking takes {1000 * checking[-1]:.0f} ms of the server's CPU for a shard",
                    flush=True,
                )
            print(f"median of {rounds} ratios: {statistics.median(ratios):.4f}")
            own, elsewhere, shard = (1000 * statistics.median(of) for of in (between["own"], between["elsewhere"], plays))
            print(
                f"medians: a shard is played in {shard:.0f} ms; between two lie {own:.1f} ms of an own slot, {elsewhere:.1f} ms of one "
                f"elsewhere: {100 * (elsewhere - own) / (shard + own):.2f} % of an own slot's time for a shard more"
            )
            print(f"median of what checking takes of the server's CPU: {1000 * statistics.median(checking):.0f} ms for a shard")
        finally:
            nats.terminate()
            nats.wait()


if __name__ == "__main__":
    main()
