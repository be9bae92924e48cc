"""Measures what each public page and API route costs the server, and how long other visitors wait meanwhile.

    python3 tests/load/route_costs.py target/release/faceoff target/release/striker

Creates a season in a temporary folder: 20 teams with the agent striker, a day of real evaluations, a tournament of four teams with
a round of games. Then it requests every public route one after the other, as a visitor, over one connection, and prints a table:

- `first`: CPU time of the server for the first request after a change of the season, in ms;
- `next`: mean CPU time of further requests, each with a query that no request had before, so that no cached page answers it, unless the
  route refuses unknown queries;
- `bytes`: size of the response;
- `others`: 99th percentile of the time in which the server answers `/livez` meanwhile, over another connection, in ms.

CPU times come from /proc, in steps of 10 ms, so the routes are requested until they took some hundred milliseconds.
"""

import http.client
import json
import re
import sys
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

from load import Season, is_over, pack_bundle, percentile

CONFIG = """
[server]
listen = "127.0.0.1:0"
[season]
name = "Costs"
[evaluation]
episodes_per_task = 10
[workers]
slots = 1
[rates]
address_per_s = 1000000
address_burst = 1000000
"""
TEAMS = 20
CUP_TEAMS = 4
MEASURED_CPU_S = 0.3
MAX_REQUESTS = 500
TICKS_PER_S = 100
UUID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
# Streams do not end, and downloads of files are not computed.
NOT_MEASURED = ("/stream", "/live", "/recording", "/dataset", "/archive")


def create_season(season: Season, archive: bytes) -> dict[str, str]:
    """Runs a day and a tournament. Returns an id of each kind of resource."""
    admin = season.admin
    teams = []
    for number in range(TEAMS):
        team = season.request("POST", "/api/v1/teams", admin, {"name": f"Team {number + 1}"})
        path = "/api/v1/submissions?file_name=striker.tar.gz"
        submission = season.request("POST", path, team["token"], archive, "application/octet-stream")
        teams.append((team, submission["id"]))
    for team, submission in teams:
        path = f"/api/v1/submissions/{submission}"
        season.wait_until(path, team["token"], lambda one: one["state"] != "validating")
    day = season.request("POST", "/api/v1/days", admin, {})
    for one in day["created"]:
        season.wait_until(f"/api/v1/evaluations/{one['id']}", admin, is_over)
    names = [team["name"] for team, _ in teams[:CUP_TEAMS]]
    cup = season.request("POST", "/api/v1/tournaments", admin, {"name": "Cup", "teams": names, "rules": {"steps": 1500}})
    path = f"/api/v1/tournaments/{cup['id']}"
    season.request("POST", f"{path}/rounds", admin, {})
    season.wait_until(path, admin, lambda one: one["phase"] not in ("open", "round"))
    games = season.request("GET", f"{path}/games", admin)
    games = games["games"] if isinstance(games, dict) else games
    return {
        "teams": teams[0][0]["id"],
        "submissions": teams[0][1],
        "evaluations": day["created"][0]["id"],
        "stages": season.request("GET", "/api/v1/stages", admin)[0]["id"],
        "tournaments": cup["id"],
        "games": games[0]["id"],
        "day": day["day"],
    }


class Visitor:
    """A connection without a token."""

    def __init__(self, season: Season):
        self.connection = http.client.HTTPConnection(urlsplit(season.url).netloc)

    def get(self, path: str) -> tuple[int, str, bytes]:
        media = "application/json" if path.startswith("/api/") else "text/html"
        self.connection.request("GET", path, headers={"Accept": media})
        response = self.connection.getresponse()
        return response.status, response.headers.get("Content-Type", ""), response.read()


def api_paths(visitor: Visitor, ids: dict[str, str]) -> dict[str, str]:
    """The public routes of the API, by pattern, each with a path that exists."""
    document = json.loads(visitor.get("/api/v1/openapi.json")[2])
    paths = {"/api/v1/openapi.json": "/api/v1/openapi.json"}
    for pattern, item in document["paths"].items():
        operation = item.get("get")
        if operation is None or {} not in operation.get("security", [{}]):
            continue
        resource = pattern.split("/")[3]
        path = pattern.replace("{id}", ids.get(resource, "")).replace("{task}", "hit").replace("{day}", ids["day"])
        for name, value in (("side", "1"), ("chunk", "0"), ("episode", "0"), ("other", ids.get(resource, ""))):
            path = path.replace(f"{{{name}}}", value)
        paths[pattern] = path
    return paths


def page_paths(visitor: Visitor) -> dict[str, str]:
    """The pages that visitors reach by links, by pattern, each with one path."""
    paths, waiting = {"/": "/", "/docs/search": "/docs/search?q=puck+velocity"}, ["/"]
    while waiting:
        _, _, body = visitor.get(waiting.pop())
        for link in re.findall(r'(?:href|src)="(/[^"]*)"', body.decode(errors="replace")):
            path = link.split("#")[0].replace("&amp;", "&")
            pattern = re.sub(r"\d+(?=$|/)", "{n}", UUID.sub("{id}", path.split("?")[0]))
            pattern = re.sub(r"/schemas/\w+", "/schemas/{name}", pattern)
            if path.startswith(("/api/", "/static/")) or "/images/" in path or pattern in paths:
                continue
            paths[pattern] = path
            waiting.append(path)
    return paths


def cpu_s(season: Season) -> float:
    fields = Path(f"/proc/{season.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def measure(season: Season, visitor: Visitor, path: str) -> tuple[int, float, float, int, float]:
    """Status, CPU milliseconds of the first and of further requests, bytes, and the wait of others in milliseconds."""
    season.request("POST", "/api/v1/announcements", season.admin, {"title": "A change", "text": "Nothing cached is valid."})
    before = cpu_s(season)
    status, _, body = visitor.get(path)
    first = cpu_s(season) - before
    waits, done = [], threading.Event()

    def watch() -> None:
        other = Visitor(season)
        while not done.is_set():
            started = time.monotonic()
            other.get("/livez")
            waits.append(1e3 * (time.monotonic() - started))
            time.sleep(0.005)

    watcher = threading.Thread(target=watch)
    idle = cpu_s(season)
    watcher.start()
    count = 0
    separator = "&" if "?" in path else "?"
    ignores_queries = visitor.get(f"{path}{separator}n=")[0] == status
    while count < MAX_REQUESTS and cpu_s(season) - idle < MEASURED_CPU_S:
        answer = visitor.get(f"{path}{separator}n={count}" if ignores_queries else path)
        assert answer[0] == status, (path, answer[0])
        count += 1
    spent = cpu_s(season) - idle
    done.set()
    watcher.join()
    return status, 1e3 * first, 1e3 * spent / count, len(body), percentile(waits, 0.99)


def main() -> None:
    program, striker = (Path(word).resolve() for word in sys.argv[1:3])
    with tempfile.TemporaryDirectory(prefix="faceoff-costs-") as name:
        folder = Path(name)
        season = Season(program, folder, CONFIG)
        try:
            ids = create_season(season, pack_bundle(striker, folder))
            visitor = Visitor(season)
            routes = api_paths(visitor, ids) | page_paths(visitor)
            rows, skipped = [], []
            for pattern, path in routes.items():
                if any(word in pattern for word in NOT_MEASURED):
                    skipped.append(pattern)
                    continue
                rows.append((pattern, *measure(season, visitor, path)))
        finally:
            season.stop()
    rows.sort(key=lambda row: -row[3])
    print("| route | status | first, ms | next, ms | bytes | others, ms |\n|---|---|---|---|---|---|")
    for pattern, status, first, mean, size, others in rows:
        print(f"| `{pattern}` | {status} | {first:.0f} | {mean:.2f} | {size:,} | {others} |")
    print("not measured:", ", ".join(skipped))


if __name__ == "__main__":
    main()
