"""Measures how many visitors a server can serve, and checks that agents are not slowed down by them.

    python3 tests/load/load.py target/release/faceoff target/release/striker

Creates a season in a temporary folder: teams with the agent striker, a day of real evaluations, a board. Then, with warm
caches and the load generators (wrk, hey) on the same CPUs:

- idle: as many requests as 32 connections can send, for the board's page and its JSON;
- during evaluations: 500 requests per second over ten connections, half of them for pages;
- during evaluations: as many requests as 256 connections can send, which exceeds the server's limit.

Prints rates, latencies, the size of each response, and the episodes with penalty points for slow answers. The only assertion is
that there are none of those, since the rates depend on the machine.
"""

import csv
import io
import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

TEAMS = 20
EPISODES = 50  # of each task
OFFERED_PER_S = 500  # requests during evaluations
CONNECTIONS = 10  # more connections at the same rate would send bursts

CONFIG = f"""
[server]
listen = "127.0.0.1:0"
[season]
name = "Load"
[evaluation]
episodes_per_task = {EPISODES}
[workers]
slots = 1
"""


class Season:
    """A server with a season of its own."""

    def __init__(self, program: Path, folder: Path, settings: str = CONFIG):
        self.data = folder / "data"
        config = folder / "faceoff.toml"
        config.write_text(settings)
        self.process = subprocess.Popen(
            [program, "serve", "--config", config, "--data-dir", self.data],
            stdout=subprocess.PIPE,
            stderr=(folder / "log").open("w"),
            text=True,
        )
        self.url = self.process.stdout.readline().strip()
        self.admin = (self.data / "admin-token").read_text().strip()

    def request(self, method: str, path: str, token: str, body=None, media="application/json"):
        if media == "application/json" and body is not None:
            body = json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, body, method=method)
        request.add_header("Authorization", f"Bearer {token}")
        request.add_header("Content-Type", media)
        while True:
            try:
                with urllib.request.urlopen(request) as response:
                    return json.load(response)
            except urllib.error.HTTPError as error:
                # Retry, as any client of a busy server should.
                if error.code != 503:
                    raise
                time.sleep(float(error.headers["Retry-After"]))

    def wait_until(self, path: str, token: str, done):
        while not done(view := self.request("GET", path, token)):
            time.sleep(0.2)
        return view

    def stop(self):
        self.process.terminate()
        self.process.wait()


def pack_bundle(striker: Path, folder: Path) -> bytes:
    """The bundle of the agent, as a team uploads it."""
    bundle = folder / "striker"
    bundle.mkdir()
    shutil.copy(Path(__file__).parents[2] / "agents/striker/agent.toml", bundle)
    shutil.copy(striker, bundle / "striker")
    archive = shutil.make_archive(str(folder / "striker"), "gztar", bundle)
    return Path(archive).read_bytes()


def is_over(evaluation: dict) -> bool:
    return evaluation["state"] not in ("queued", "running", "finalising")


def is_released(evaluation: dict) -> bool:
    return evaluation.get("released_at") is not None


def slow_answers(evaluations: list[dict]) -> int:
    """Episodes with penalty points for slow answers."""
    tasks = [task for one in evaluations for task in one["result"]["tasks"].values()]
    return sum(task["violations"]["computation_time"] for task in tasks)


def wrk(url: str, connections: int, seconds: int) -> dict:
    """Runs the load generator wrk: as many requests as the connections can send. Returns rates and latencies."""
    command = ["wrk", "--latency", "-t1", f"-c{connections}", f"-d{seconds}s", url]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    refused = re.search(r"Non-2xx or 3xx responses: (\d+)", output)
    total = int(re.search(r"(\d+) requests in", output)[1])
    errors = re.search(r"Socket errors: (.*)", output)
    assert total > (int(refused[1]) if refused else 0), output
    return {
        "per_s": float(re.search(r"Requests/sec:\s+([\d.]+)", output)[1]),
        "p99": re.search(r"99%\s+(\S+)", output)[1],
        "answered": total - int(refused[1] if refused else 0),
        "refused": int(refused[1]) if refused else 0,
        "errors": errors[1] if errors else "none",
    }


def percentile(times_ms: list[float], share: float) -> float:
    """The smallest time that at least this share of all times does not exceed."""
    return round(sorted(times_ms)[math.ceil(share * len(times_ms)) - 1], 1)


def hey(url: str, connections: int, seconds: int, per_s: int | None = None) -> dict:
    """Runs the load generator hey over `connections` connections. It sends `per_s` requests per second in
    total, or without it as many as possible. Returns rates and latencies."""
    command = ["hey", "-z", f"{seconds}s", "-c", str(connections), "-o", "csv"]
    if per_s is not None:
        command += ["-q", str(per_s / connections)]
    output = subprocess.run([*command, url], capture_output=True, text=True, check=True).stdout
    times_ms: dict[str, list[float]] = {}
    for answer in csv.DictReader(io.StringIO(output)):
        times_ms.setdefault(answer["status-code"], []).append(1e3 * float(answer["response-time"]))
    assert "200" in times_ms, output[:1000]
    # A connection sends its next request after the response, so slow responses lower the rate.
    return {"per_s": round(sum(map(len, times_ms.values())) / seconds, 1)} | {
        status: {"answers": len(times), "p50_ms": percentile(times, 0.5), "p99_ms": percentile(times, 0.99)}
        for status, times in sorted(times_ms.items())
    }


def payload_bytes(url: str) -> int:
    with urllib.request.urlopen(url) as answer:
        return len(answer.read())


def main() -> None:
    program, striker = (Path(word).resolve() for word in sys.argv[1:3])
    with tempfile.TemporaryDirectory(prefix="faceoff-load-") as name:
        folder = Path(name)
        season = Season(program, folder)
        try:
            run(season, pack_bundle(striker, folder))
        finally:
            season.stop()


def run(season: Season, archive: bytes) -> None:
    admin = season.admin
    teams = []
    for number in range(TEAMS):
        team = season.request("POST", "/api/v1/teams", admin, {"name": f"Team {number + 1}"})
        path = "/api/v1/submissions?file_name=striker.tar.gz"
        submission = season.request("POST", path, team["token"], archive, "application/octet-stream")
        teams.append((team, submission["id"]))
    for team, submission in teams:
        path = f"/api/v1/submissions/{submission}"
        found = season.wait_until(path, team["token"], lambda one: one["state"] != "validating")
        assert found["state"] == "valid", found
    day = season.request("POST", "/api/v1/days", admin, {})
    created = [one["id"] for one in day["created"]]

    def results(ids: list[str]) -> list[dict]:
        """The results once the day is released: violations are hidden before."""
        ended = [season.wait_until(f"/api/v1/evaluations/{one}", admin, is_over) for one in ids]
        assert all(one["state"] == "finished" for one in ended), ended
        return [season.wait_until(f"/api/v1/evaluations/{one}", admin, is_released) for one in ids]

    quiet = results(created)
    board, data = season.url + "/", season.url + "/api/v1/board"
    print(f"{TEAMS} teams on the board; page {payload_bytes(board)} bytes, JSON {payload_bytes(data)} bytes")
    print(f"without visitors: {slow_answers(quiet)} episodes with slow answers")

    print("idle, 32 connections:")
    for name, url in (("page", board), ("JSON", data)):
        wrk(url, 32, 2)
        print(f"  {name}: {wrk(url, 32, 10)}")

    stage = day["stage"] if "stage" in day else season.request("GET", "/api/v1/stages", admin)[0]["id"]

    def measure(name: str, load) -> None:
        """Repeats the load until further evaluations have finished."""
        ids = []
        for team, _ in teams[:10]:
            path = f"/api/v1/stages/{stage}/days/{day['day']}/extra-evaluation"
            body = {"team": team["id"], "reason": name, "confirm": team["name"]}
            ids.append(season.request("POST", path, admin, body)["id"])
        with ThreadPoolExecutor() as pool:
            ended = pool.submit(results, ids)
            rounds = []
            while not ended.done():
                rounds.append(load())
            found = slow_answers(ended.result())
        print(f"{name}: {found} episodes of {len(ids) * 3 * EPISODES} with slow answers")
        for one in rounds:
            print(f"  {one}")
        assert rounds, "the evaluations ended before the load started"
        assert found == 0, "visitors slowed agents down"

    def fixed_rate_load() -> list[dict]:
        with ThreadPoolExecutor() as pool:
            half = OFFERED_PER_S // 2
            parts = [pool.submit(hey, url, CONNECTIONS // 2, 10, half) for url in (board, data)]
            return [part.result() for part in parts]

    measure(f"{OFFERED_PER_S} requests per second during evaluations", fixed_rate_load)
    measure("256 connections during evaluations", lambda: hey(board, 256, 10))


if __name__ == "__main__":
    main()
