"""Compares a slot (a place for one running job) of a remote worker with one of the server's own, over the loopback interface.

    python3 tests/load/remote_slot.py target/release/faceoff [ROUNDS]

Each round has three seasons with one team, the agent hold and nine shards of 50 episodes. The shards are evaluated by the server's
own slot, by a remote worker that gets them over a nats-server on this machine, or by such a worker while the server checks no
episodes. The order of the seasons alternates, so that other load affects them alike. Two times are measured from the log of the
slot: from the start of the first shard to the commit of the last one, and the gap between two shards, from the end of the last
episode to the start of the next shard. The difference in the server's CPU time with and without checks is the cost of checking.
Prints the times of each round, the median ratio, the median gaps and the CPU time. The duration of the same episodes varies by more
than the difference that is measured, so the ratio needs many rounds; the gaps need few. Nothing is asserted, since the times depend
on the machine.
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
class ShardTimes:
    """The times at which each shard of a season was started, evaluated and committed, in seconds."""

    started: list[float]
    played: list[float]
    committed: list[float]

    def total(self) -> float:
        return self.committed[-1] - self.started[0]

    def durations(self) -> list[float]:
        return [end - begin for begin, end in zip(self.started, self.played)]

    def gaps(self) -> list[float]:
        return [begin - end for end, begin in zip(self.played, self.started[1:])]


class Season:
    """A server, with a remote worker if it has a NATS URL."""

    def __init__(self, program: Path, folder: Path, nats: str | None, checks: bool = True):
        folder.mkdir()
        self.folder, self.processes = folder, []
        config = folder / "faceoff.toml"
        text = CONFIG if checks else CONFIG + "checked_episodes = 0\n"
        config.write_text(text + (f'play = false\n[nats]\nurl = "{nats}"\nname = "{folder.name}"\n' if nats else ""))
        self.log = folder / ("worker.log" if nats else "server.log")
        serve = [program, "serve", "--config", config, "--data-dir", folder / "data", "--log-format", "json"]
        self.server = self.start(serve, folder / "server.log")
        self.url = self.server.stdout.readline().strip()
        self.admin = (folder / "data/admin-token").read_text().strip()
        if nats:
            worker = folder / "worker.toml"
            worker.write_text(f'[workers]\nslots = 1\n[nats]\nurl = "{nats}"\nname = "{folder.name}"\n')
            command = [program, "worker", "--name", "one", "--config", worker, "--scratch-dir", folder / "scratch"]
            self.start([*command, "--log-format", "json"], self.log)

    def start(self, command: list, log: Path) -> subprocess.Popen:
        environment = os.environ | {"RUST_LOG": "info,faceoff_worker::executor=debug"}
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log.open("w"), text=True, env=environment)
        self.processes.append(process)
        return process

    def request(self, method: str, path: str, token: str, body=None, media="application/json"):
        body = json.dumps(body).encode() if media == "application/json" and body is not None else body
        request = urllib.request.Request(self.url + path, body, method=method)
        request.add_header("Authorization", f"Bearer {token}")
        request.add_header("Content-Type", media)
        with urllib.request.urlopen(request) as response:
            return json.load(response)

    def wait_until(self, path: str, token: str, done):
        while not done(view := self.request("GET", path, token)):
            time.sleep(0.5)
        return view

    def evaluate(self) -> "ShardTimes":
        team = self.request("POST", "/api/v1/teams", self.admin, {"name": "Alpha"})
        hold = Path(__file__).parents[2] / "agents/hold"
        archive = Path(shutil.make_archive(str(self.folder / "hold"), "gztar", hold)).read_bytes()
        path = "/api/v1/submissions?file_name=hold.tar.gz"
        submission = self.request("POST", path, team["token"], archive, "application/octet-stream")
        path = f"/api/v1/submissions/{submission['id']}"
        found = self.wait_until(path, team["token"], lambda one: one["state"] != "validating")
        assert found["state"] == "valid", found
        day = self.request("POST", "/api/v1/days", self.admin, {})
        path = f"/api/v1/evaluations/{day['created'][0]['id']}"
        ended = self.wait_until(path, self.admin, lambda one: one["state"] not in ("queued", "running", "finalising"))
        assert ended["state"] == "finished", ended
        times = {"started": [], "played": [], "committed": []}
        for line in self.log.read_text().splitlines():
            entry = json.loads(line)
            fields = entry["fields"]
            if fields["message"] == "played" or " episodes " in fields.get("description", ""):
                time_s = datetime.fromisoformat(entry["timestamp"].replace("Z", "+00:00")).timestamp()
                times.get(fields["message"], []).append(time_s)
        assert all(len(shard_times) == SHARDS for shard_times in times.values()), times
        return ShardTimes(**times)

    def cpu_s(self) -> float:
        """CPU time of the server and its ended child processes, in seconds."""
        fields = Path(f"/proc/{self.server.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")

    def stop(self):
        for process in reversed(self.processes):
            process.terminate()
            process.wait()


def main() -> None:
    program, rounds = Path(sys.argv[1]).resolve(), int((sys.argv[2:] or ["5"])[0])
    with tempfile.TemporaryDirectory(prefix="faceoff-remote-") as name:
        folder = Path(name)
        command = [shutil.which("nats-server", path="/usr/sbin:/usr/bin"), "-js", "-a", "127.0.0.1", "-p", "-1"]
        command += ["-sd", folder / "nats", "--ports_file_dir", folder, "-l", folder / "nats.log"]
        nats = subprocess.Popen(command)
        try:
            ports = folder / f"nats-server_{nats.pid}.ports"
            while not ports.exists():
                time.sleep(0.05)
            url = json.loads(ports.read_text())["nats"][0]
            ratios, checking, durations = [], [], []
            gaps = {"own": [], "remote": []}
            kinds = ["own", "remote", "unchecked"]
            for number in range(rounds):
                shard_times, cpu = {}, {}
                for kind in kinds if number % 2 == 0 else reversed(kinds):
                    season = Season(program, folder / f"{kind}-{number}", url if kind != "own" else None, kind != "unchecked")
                    try:
                        shard_times[kind], cpu[kind] = season.evaluate(), season.cpu_s()
                    finally:
                        season.stop()
                times = {kind: season_times.total() for kind, season_times in shard_times.items()}
                for kind, all_gaps in gaps.items():
                    all_gaps += shard_times[kind].gaps()
                    durations += shard_times[kind].durations()
                ratios.append(times["remote"] / times["own"])
                checking.append((cpu["remote"] - cpu["unchecked"]) / SHARDS)
                print(
                    f"own slot {times['own']:.2f} s, remote slot {times['remote']:.2f} s, ratio {ratios[-1]:.4f}, "
                    f"unchecked {times['unchecked']:.2f} s, checking takes {1000 * checking[-1]:.0f} ms of the server's CPU time per shard",
                    flush=True,
                )
            print(f"median of {rounds} ratios: {statistics.median(ratios):.4f}")
            own, remote, shard = (1000 * statistics.median(values) for values in (gaps["own"], gaps["remote"], durations))
            print(
                f"medians: a shard takes {shard:.0f} ms; the gap between two is {own:.1f} ms in an own slot, {remote:.1f} ms in a "
                f"remote slot: {100 * (remote - own) / (shard + own):.2f} % more time per shard"
            )
            print(f"median CPU time of the server for checking: {1000 * statistics.median(checking):.0f} ms per shard")
        finally:
            nats.terminate()
            nats.wait()


if __name__ == "__main__":
    main()
