"""Plays an agent of each language for 20 episodes in the sandbox, with the runtimes of docker/runtimes/debian.toml, and compares the results
with those of agents/hold: all of them hold the pose in which an episode starts, so the episodes are the same.

  test_languages.py --program FACEOFF --work FOLDER [--images] [--prepared]

--images    also plays them as container images with the same packages, made by mmdebstrap (as root)
--prepared  compiles nothing and installs nothing: an earlier run has filled the work folder

Agents have a folder of their own at /tmp. So for a work folder below it, the user's cache is used instead.
"""
import argparse
import hashlib
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent.parent
EPISODES = 20
# Commands that compile an agent in its folder.
COMPILERS = {
    "cpp": ["g++", "-std=c++20", "-O2", "-static-libstdc++", "-static-libgcc", "-o", "agent", "agent.cpp"],
    "java": ["javac", "--release", "17", "Agent.java"],
    "csharp": ["mcs", "-out:agent.exe", "Agent.cs"],
}
# .NET as a Python package: a runtime of version 3.1, without a compiler.
DOTNET = "dotnetcore2==3.1.23"
# Lines that agents print to their logs.
LOG = {
    "cpp": "hold in C++",
    "csharp": "hold in C#",
    # 510 to 519 million: a quarter of the agent's memory, 2 GiB, less one survivor space.
    "dotnet": "hold in C#",
    "java": "heap: at most 51",
    "lua": "hold in Lua",
    "node": "interfaces: lo memory: 2147483648",
    "python": "messages work",
    "rust": "",
}
PACKAGES = "lua5.4,lua-cjson,mono-runtime,libmono-corlib4.5-cil,libmono-system-core4.0-cil,openjdk-17-jre-headless,nodejs,python3-numpy"


def prepare(program, work):
    """Copies and compiles the agents, and installs the libraries of the Python one."""
    shutil.rmtree(work / "agents", ignore_errors=True)
    shutil.copytree(REPOSITORY / "agents/languages", work / "agents", ignore=shutil.ignore_patterns("README.md"))
    shutil.copytree(REPOSITORY / "tests/languages/python", work / "agents/python")
    rust = work / "agents/rust"
    rust.mkdir()
    shutil.copy(REPOSITORY / "agents/baseline/agent.toml", rust)
    shutil.copy(program.parent / "baseline", rust)
    for language, command in COMPILERS.items():
        subprocess.run(command, cwd=work / "agents" / language, check=True)
    requirements = REPOSITORY / "tests/languages/requirements.txt"
    installed = work / "python/requirements.txt"
    if not installed.exists() or installed.read_text() != requirements.read_text():
        shutil.rmtree(work / "python", ignore_errors=True)
        subprocess.run(["/usr/bin/python3", "-m", "venv", work / "python"], check=True)
        subprocess.run([work / "python/bin/pip", "install", "--quiet", "--requirement", requirements], check=True)
        shutil.copy(requirements, installed)
    # The same program as for Mono.
    dotnet = shutil.copytree(work / "agents/csharp", work / "agents/dotnet")
    (dotnet / "agent.exe").rename(dotnet / "agent.dll")
    shutil.copy(REPOSITORY / "tests/languages/dotnet/agent.toml", dotnet)
    shutil.copy(REPOSITORY / "tests/languages/dotnet/agent.runtimeconfig.json", dotnet)
    if not (work / "dotnet").exists():
        shutil.rmtree(work / "wheel", ignore_errors=True)
        pip = [work / "python/bin/pip", "install", "--quiet", "--no-deps", "--target", work / "wheel", DOTNET]
        subprocess.run(pip, check=True)
        (work / "wheel/dotnetcore2/bin/dotnet").chmod(0o755)
        (work / "wheel/dotnetcore2/bin").rename(work / "dotnet")
    recipes = (REPOSITORY / "docker/runtimes/debian.toml").read_text()
    if Path("/usr/share/nodejs").exists():
        recipes = recipes.replace('"/usr/bin/node",', '"/usr/bin/node", "/usr/share/nodejs",')
    (work / "faceoff.toml").write_text(
        f'{recipes}\n[runtimes.libraries]\nfolder = "{work / "python"}"\n'
        f'[runtimes.dotnet]\nread_only_paths = ["/lib", "/lib64", "/usr/lib", "/usr/lib64", "/etc/ld.so.cache", "{work / "dotnet"}"]\n'
        f'path = "{work / "dotnet"}"\n'
    )


def evaluate(program, work, agent):
    """The results of the agent, without computation times, and its log."""
    command = [program, "eval", agent, "--task", "defend", "--episodes", str(EPISODES), "--json"]
    command += ["--config", work / "faceoff.toml", "--out", work / "results"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=work)
    if done.returncode:
        raise AssertionError(done.stderr + done.stdout)
    answer = json.loads(done.stdout)
    task = answer["result"]["tasks"]["defend"]
    assert task["episodes"] == EPISODES and answer["faults"] == [], answer
    # What depends on the machine is not compared.
    violations = {kind: count for kind, count in task["violations"].items() if kind != "computation_time"}
    task = {"successes": task["successes"], "steps": task["steps"], "violations": violations}
    with zipfile.ZipFile(work / "results/dataset.zip") as dataset:
        return task, dataset.read("agent.log").decode()


def base_image(work):
    """The files of a Debian with the packages, as the layer of an image."""
    layer = work / "image-base.tar"
    if not layer.exists():
        part = work / "image-base.part.tar"
        subprocess.run(["mmdebstrap", "--variant=minbase", f"--include={PACKAGES}", "bookworm", part], check=True)
        part.rename(layer)
    return layer


def save_image(base, agent, path):
    """Writes an archive as `docker save` does: Debian, and the agent's folder above it."""
    own = io.BytesIO()
    with tarfile.open(fileobj=own, mode="w") as layer:
        layer.add(agent, "agent")
    layers = [hashlib.file_digest(base.open("rb"), "sha256").hexdigest(), hashlib.sha256(own.getvalue()).hexdigest()]
    config = {
        "architecture": "amd64", "os": "linux", "config": {"Env": ["PATH=/usr/local/bin:/usr/bin:/bin"]},
        "rootfs": {"type": "layers", "diff_ids": [f"sha256:{layer}" for layer in layers]},
    }
    manifest = [{"Config": "config.json", "RepoTags": ["agent:latest"], "Layers": ["base.tar", "agent.tar"]}]
    # Unpacked it has more than an upload may have.
    with tarfile.open(path, "w:gz", compresslevel=1) as image:
        image.add(base, "base.tar")
        texts = (("config.json", json.dumps(config).encode()), ("manifest.json", json.dumps(manifest).encode()))
        for name, content in (("agent.tar", own.getvalue()), *texts):
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            image.addfile(entry, io.BytesIO(content))


def image_of(work, language):
    agent = work / "images" / language
    shutil.rmtree(agent, ignore_errors=True)
    source = REPOSITORY / "agents/hold" if language == "python" else work / "agents" / language
    shutil.copytree(source, agent)
    description = (agent / "agent.toml").read_text()
    lines = ['runtime = "image"' if line.startswith("runtime") else line for line in description.splitlines()]
    (agent / "agent.toml").write_text("\n".join(lines) + "\n")
    path = work / "images" / f"{language}.tar.gz"
    save_image(base_image(work), agent, path)
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--images", action="store_true")
    parser.add_argument("--prepared", action="store_true")
    arguments = parser.parse_args()
    program, work = arguments.program.resolve(), arguments.work.resolve()
    if work.is_relative_to("/tmp"):
        work = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "faceoff/languages")
    work.mkdir(parents=True, exist_ok=True)
    if not arguments.prepared:
        prepare(program, work)
    expected, _ = evaluate(program, work, REPOSITORY / "agents/hold")
    passed, failed = 0, 0
    for kind in ("bundle", "image") if arguments.images else ("bundle",):
        for language, line in LOG.items():
            if (kind, language) == ("image", "dotnet"):
                # Debian has no package for the image.
                continue
            try:
                agent = work / "agents" / language if kind == "bundle" else image_of(work, language)
                task, log = evaluate(program, work, agent)
                # The agent in Rust plays; the others hold.
                assert language == "rust" or task == expected, (task, expected)
                assert kind == "image" or line in log, log
                passed += 1
                print(f"{kind} {language}: {EPISODES} episodes", flush=True)
            except AssertionError as error:
                failed += 1
                print(f"{kind} {language}: {error}", file=sys.stderr, flush=True)
    print(f"{passed} passed, {failed} failed")
    sys.exit(failed != 0)


if __name__ == "__main__":
    main()
