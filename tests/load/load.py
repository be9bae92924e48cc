"""How much looking on a server bears, and what agents notice of it: nothing.

    python3 tests/load/load.py target/release/faceoff target/release/striker

Makes a season of its own in a temporary folder: teams with the agent striker, a day of real evaluations, a board. Then, with
the answers warm and the generators (wrk, hey) on the same CPUs:

- idle: as many requests as 32 connections can make, for the board's page and its JSON;
- while evaluations run: 500 requests per second offered over ten connections, half of them pages;
- while evaluations run: as many as 256 connections can make, which is more than there is room for.

Prints rates, latencies, the payload of each answer, and the penalty points for slow answers of each part. Nothing is asserted but
that agents noticed nothing: how fast a machine is, is the machine's.
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
OFFERED_PER_S = 500
CONNECTIONS = 10  # more that are paced alike ask in bursts, which is another question

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
    """A server of this test alone."""

    def __init__(self, program: Path, folder: Path):
        self.data = folder / "data"
        config = folder / "faceoff.toml"
        config.write_text(CONFIG)
        self.process = subprocess.Popen(
            [program, "serve", "--config", config, "--data-dir", self.data],
            stdout=subprocess.PIPE,
            stderr=(folder / "log").open("w"),
            text=True,
        )
        self.url = self.process.stdout.readline().strip()
        self.admin = (self.data / "admin-token").read_text().strip()

    def ask(self, method: str, path: str, token: str, body=None, media="application/json"):
        if media == "application/json" and body is not None:
            body = json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, body, method=method)
        request.add_header("Authorization", f"Bearer {token}")
        request.add_header("Content-Type", media)
        while True:
            try:
                with urllib.request.urlopen(request) as answer:
                    return json.load(answer)
            except urllib.error.HTTPError as error:
                # As any client of a busy server does.
                if error.code != 503:
                    raise
                time.sleep(float(error.headers["Retry-After"]))

    def until(self, path: str, token: str, done):
        while not done(answer := self.ask("GET", path, token)):
            time.sleep(0.2)
        return answer

    def end(self):
        self.process.terminate()
        self.process.wait()


def packed(striker: Path, folder: Path) -> bytes:
    """The agent as a team uploads it."""
    bundle = folder / "striker"
    bundle.mkdir()
    shutil.copy(Path(__file__).parents[2] / "agents/striker/agent.toml", bundle)
    shutil.copy(striker, bundle / "striker")
    archive = shutil.make_archive(str(folder / "striker"), "gztar", bundle)
    return Path(archive).read_bytes()


def over(evaluation: dict) -> bool:
    return evaluation["state"] not in ("queued", "running", "finalising")


def released(evaluation: dict) -> bool:
    return evaluation.get("released_at") is not None


def slow_answers(evaluations: list[dict]) -> int:
    """Episodes with penalty points for slow answers."""
    tasks = [task for one in evaluations for task in one["result"]["tasks"].values()]
    return sum(task["violations"]["computation_time"] for task in tasks)


def wrk(url: str, connections: int, seconds: int) -> dict:
    words = ["wrk", "--latency", "-t1", f"-c{connections}", f"-d{seconds}s", url]
    told = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    refused = re.search(r"Non-2xx or 3xx responses: (\d+)", told)
    total = int(re.search(r"(\d+) requests in", told)[1])
    errors = re.search(r"Socket errors: (.*)", told)
    assert total > (int(refused[1]) if refused else 0), told
    return {
        "per_s": float(re.search(r"Requests/sec:\s+([\d.]+)", told)[1]),
        "p99": re.search(r"99%\s+(\S+)", told)[1],
        "answered": total - int(refused[1] if refused else 0),
        "refused": int(refused[1]) if refused else 0,
        "errors": errors[1] if errors else "none",
    }


def percentile(times_ms: list[float], share: float) -> float:
    """The nearest rank."""
    return round(sorted(times_ms)[math.ceil(share * len(times_ms)) - 1], 1)


def hey(url: str, connections: int, seconds: int, per_s: int | None = None) -> dict:
    """What came of asking over so many connections, as often as each may or, without a rate, can."""
    words = ["hey", "-z", f"{seconds}s", "-c", str(connections), "-o", "csv"]
    if per_s is not None:
        words += ["-q", str(per_s / connections)]
    told = subprocess.run([*words, url], capture_output=True, text=True, check=True).stdout
    times_ms: dict[str, list[float]] = {}
    for answer in csv.DictReader(io.StringIO(told)):
        times_ms.setdefault(answer["status-code"], []).append(1e3 * float(answer["response-time"]))
    assert "200" in times_ms, told[:1000]
    # A connection asks again when it has its answer: slow ones show as a rate below the one that was to be.
    return {"per_s": round(sum(map(len, times_ms.values())) / seconds, 1)} | {
        status: {"answers": len(times), "p50_ms": percentile(times, 0.5), "p99_ms": percentile(times, 0.99)}
        for status, times in sorted(times_ms.items())
    }


def payload(url: str) -> int:
    with urllib.request.urlopen(url) as answer:
        return len(answer.read())


def main() -> None:
    program, striker = (Path(word).resolve() for word in sys.argv[1:3])
    with tempfile.TemporaryDirectory(prefix="faceoff-load-") as name:
        folder = Path(name)
        season = Season(program, folder)
        try:
            run(season, packed(striker, folder))
        finally:
            season.end()


def run(season: Season, archive: bytes) -> None:
    admin = season.admin
    teams = []
    for number in range(TEAMS):
        team = season.ask("POST", "/api/v1/teams", admin, {"name": f"Team {number + 1}"})
        path = "/api/v1/submissions?file_name=striker.tar.gz"
        made = season.ask("POST", path, team["token"], archive, "application/octet-stream")
        teams.append((team, made["id"]))
    for team, submission in teams:
        path = f"/api/v1/submissions/{submission}"
        found = season.until(path, team["token"], lambda one: one["state"] != "validating")
        assert found["state"] == "valid", found
    day = season.ask("POST", "/api/v1/days", admin, {})
    created = [one["id"] for one in day["created"]]

    def results(ids: list[str]) -> list[dict]:
        """Once all are over: what they broke is told with the release of the day."""
        ended = [season.until(f"/api/v1/evaluations/{one}", admin, over) for one in ids]
        assert all(one["state"] == "finished" for one in ended), ended
        return [season.until(f"/api/v1/evaluations/{one}", admin, released) for one in ids]

    quiet = results(created)
    board, data = season.url + "/", season.url + "/api/v1/board"
    print(f"{TEAMS} teams on the board; page {payload(board)} bytes, JSON {payload(data)} bytes")
    print(f"nobody looks on: {slow_answers(quiet)} episodes with slow answers")

    print("idle, 32 connections:")
    for what, url in (("page", board), ("JSON", data)):
        wrk(url, 32, 2)
        print(f"  {what}: {wrk(url, 32, 10)}")

    stage = day["stage"] if "stage" in day else season.ask("GET", "/api/v1/stages", admin)[0]["id"]

    def beside(what: str, load) -> None:
        """Runs the load until more evaluations have been played through."""
        ids = []
        for team, _ in teams[:10]:
            path = f"/api/v1/stages/{stage}/days/{day['day']}/extra-turn"
            body = {"team": team["id"], "reason": what, "confirm": team["name"]}
            ids.append(season.ask("POST", path, admin, body)["id"])
        with ThreadPoolExecutor() as pool:
            ended = pool.submit(results, ids)
            rounds = []
            while not ended.done():
                rounds.append(load())
            found = slow_answers(ended.result())
        print(f"{what}: {found} episodes of {len(ids) * 3 * EPISODES} with slow answers")
        for one in rounds:
            print(f"  {one}")
        assert rounds, "the evaluations ended before anybody looked"
        assert found == 0, "agents noticed that people look on"

    def offered() -> list[dict]:
        with ThreadPoolExecutor() as pool:
            half = OFFERED_PER_S // 2
            parts = [pool.submit(hey, url, CONNECTIONS // 2, 10, half) for url in (board, data)]
            return [part.result() for part in parts]

    beside(f"{OFFERED_PER_S} requests per second while evaluations run", offered)
    beside("256 connections while evaluations run", lambda: hey(board, 256, 10))


if __name__ == "__main__":
    main()
