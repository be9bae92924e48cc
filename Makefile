# Two commands matter: `make demo` plays a competition day, `make test` proves that it works.

# Variables a user may set:
EPISODES ?= 50
SERVE    ?= 1
LISTEN   ?= 127.0.0.1:8080
DEMO_DIR ?= demo-data
MINUTES  ?= 60
SHARDS   ?= 10000
WORKERS  ?= 200
SLEEP_S  ?= 10
WHOLE    ?=
ONLY     ?=
ROUNDS   ?= 1
COMMIT   ?= HEAD
JSON     ?=

# Tests wait for much of their time, so there are more at a time than CPUs.
TEST_THREADS ?= $(shell echo $$((3 * $$(nproc))))

CARGO      ?= cargo
# A folder's path may have spaces. So recipes quote each of these, and none is a target, a prerequisite or a word of one of make's functions,
# which take a space for the end of a name.
TARGET_DIR := $(if $(CARGO_TARGET_DIR),$(CARGO_TARGET_DIR),target)
RELEASE    := $(TARGET_DIR)/release
DEMO       := $(TARGET_DIR)/demo

.PHONY: demo test tests-built tests-of-rust tests-of-python tests-of-api tests-of-agents tests-of-scripts test-release costs web wheel pictures test-api test-python test-learning fuzz busy load elsewhere crowd objects soak steady frames test-cgroup2 test-box test-engine lint format fidelity setup setup-test agents dist clean-demo help

help:
	@echo "make demo   play a competition day: EPISODES=$(EPISODES) SERVE=$(SERVE) LISTEN=$(LISTEN)"
	@echo "make agents   bundle striker and baseline: $(TARGET_DIR)/bundles"
	@echo "make dist   pack the program for other Linux machines: $(TARGET_DIR)/dist"
	@echo "make test   run everything that proves that it works"
	@echo "make test-release   build the release program, and check its size, its symbols and the golden hashes"
	@echo "make costs   what building and testing take, from fresh clones: ONLY=$(ONLY) ROUNDS=$(ROUNDS) COMMIT=$(COMMIT) JSON=$(JSON)"
	@echo "make web    the script of the replay pages: web/client/dist"
	@echo "make wheel  the Python package: $(TARGET_DIR)/wheels"
	@echo "make test-api   validate the API's document, try every operation, make two clients of it"
	@echo "make test-python   make it, install it where nothing else is, test it"
	@echo "make test-learning   learn from nothing, and try the libraries that need torch (8 GB)"
	@echo "make test-cgroup2   the sandbox's limits on cgroup v2, in a virtual machine that has nothing else"
	@echo "make test-box   make the images' file systems without an engine, and start what is in them"
	@echo "make test-engine   build the images with Docker, and have a day played in containers; WHOLE=1 compiles there, too"
	@echo "make fuzz   feed the readers what is nearly valid: MINUTES=$(MINUTES)"
	@echo "make busy   play beside hogs, floods and bursts of processes"
	@echo "make load   how much looking on a server bears, and that agents notice nothing of it"
	@echo "make elsewhere   what it costs to play on another machine"
	@echo "make crowd   what one server carries when many machines work for it: SHARDS=$(SHARDS) WORKERS=$(WORKERS) SLEEP_S=$(SLEEP_S)"
	@echo "make objects   what files by JetStream's object store would take, against HTTP, on a link of 200 ms"
	@echo "make soak   upload, play, read, fill the disk and kill the server, all at once: MINUTES=$(MINUTES)"
	@echo "make steady run the tests ten times, and three times on a busy machine"
	@echo "make frames   how much CPU time a frame of a replay takes its script"
	@echo "make pictures   take the pictures of pages in README and docs/ anew"
	@echo "make lint   format check and lints"
	@echo "make fidelity   draw how far the simulator is from the recordings"

setup:
	@docker/setup.sh build

setup-test:
	@docker/setup.sh test

# The bundles of the compiled agents: folders a team could copy. The demo uploads striker; baseline is for test games.
# Built by themselves, they need other features of their dependencies than beside the server: the demo builds all at once.
agents: setup
	$(CARGO) build --release --locked --package striker --package baseline
	built="$(RELEASE)"; $(PACK_AGENTS)

# The program in an archive; it refuses what only a newer system than the participants' could start.
dist: setup
	$(CARGO) build --release --locked --package faceoff
	docker/dist.sh "$(RELEASE)/faceoff" "$(TARGET_DIR)/dist"

# The release program is built, checked and packed; first its check (docker/check-program.sh) is tested itself.
test-release:
	python3 docker/test_check_program.py
	$(MAKE) --no-print-directory dist

define PACK_AGENTS
for agent in striker baseline; do \
    mkdir -p "$(TARGET_DIR)/bundles/$$agent" && \
    cp "agents/$$agent/agent.toml" "$$built/$$agent" "$(TARGET_DIR)/bundles/$$agent/" || exit 1; \
done
endef

demo: setup
	$(CARGO) build --profile demo --locked --package faceoff --package striker --package baseline
	built="$(DEMO)"; $(PACK_AGENTS)
	"$(DEMO)/faceoff" demo --episodes $(EPISODES) --listen $(LISTEN) --data-dir "$(DEMO_DIR)" \
	    --bundle agents/hold --bundle "$(TARGET_DIR)/bundles/striker" --bundle agents/reckless \
	    $(if $(filter 0,$(SERVE)),--no-serve)

# Side by side what waits for much of its time: for a registry, for one program, for one of two CPUs. What Cargo says is told as it comes
# (the + below), all else when it is complete.
SIDE_BY_SIDE = $(MAKE) --no-print-directory --output-sync=target --keep-going --jobs

test: setup-test
	$(SIDE_BY_SIDE) tests-built tests-of-agents tests-of-scripts
	$(SIDE_BY_SIDE) tests-of-rust tests-of-python tests-of-api

# Parts of `make test`, in two rounds: Rust's tests use what those of the agents and pages install.
# The programs first: the end-to-end tests run the real binary and the real agents. With --tests the
# dependencies get the same features as in the run below, and are not built twice.
tests-built:
	+$(CARGO) build --locked --workspace --bins --tests
	tests/runtimes.sh "$(TARGET_DIR)"
tests-of-rust:
	+if $(CARGO) nextest --version >/dev/null 2>&1; \
	    then $(CARGO) nextest run --locked --workspace --no-fail-fast --test-threads $(TEST_THREADS); \
	    else $(CARGO) test --locked --workspace --no-fail-fast -- --test-threads $(TEST_THREADS); fi
tests-of-python:
	TARGET_DIR="$(TARGET_DIR)" crates/faceoff-py/test.sh test
tests-of-api:
	TARGET_DIR="$(TARGET_DIR)" tests/api/test.sh
tests-of-agents:
	python3 agents/test_agents.py
	web/client/build.sh test
	TARGET_DIR="$(TARGET_DIR)" tests/s3/setup.sh
# The scripts that check a release and measure builds, on small programs and a small project.
tests-of-scripts:
	python3 docker/test_check_program.py
	python3 tests/costs/test_costs.py

# Measures HEAD or COMMIT from fresh clones and prints a table; nothing else should run. ONLY: of demo, test, page, store, release,
# crates, lines. ROUNDS: of demo, test and release. JSON=FILE: the numbers there, too. TMPDIR=FOLDER: clones are made there.
costs: setup-test
	@python3 tests/costs/costs.py --only '$(ONLY)' --rounds $(ROUNDS) --commit '$(COMMIT)' $(if $(JSON),--json '$(JSON)')

# The script of the replay pages, from its sources; what it makes is committed.
web:
	web/client/build.sh build

# The Python package, for every CPython from 3.11 on: one wheel.
wheel: setup
	TARGET_DIR="$(TARGET_DIR)" crates/faceoff-py/test.sh wheel

# The API as strangers' tools see it: a validator, a fuzzer and two generators of clients, against the debug server.
test-api: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	TARGET_DIR="$(TARGET_DIR)" tests/api/test.sh

# The evaluator in Python is compared with the binary's, and the examples play in the sandbox.
test-python: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	tests/runtimes.sh "$(TARGET_DIR)"
	TARGET_DIR="$(TARGET_DIR)" crates/faceoff-py/test.sh test

# What takes long and gigabytes: the examples learned anew, Stable-Baselines3 and LeRobot themselves.
test-learning: agents
	$(CARGO) build --release --locked --package faceoff
	TARGET_DIR="$(TARGET_DIR)" crates/faceoff-py/test.sh learning

# Most hosts have the one version of the interface or the other: here this one, whatever the host has. As root.
test-cgroup2: setup
	@docker/setup.sh cgroup2
	$(CARGO) build --locked --workspace --bins --tests
	TARGET_DIR="$(TARGET_DIR)" docker/cgroup2.sh

# The steps of docker/Dockerfile, and the configurations of Compose and Kubernetes. As root.
test-box: setup
	@docker/setup.sh box
	$(CARGO) build --locked --workspace --bins --tests
	TARGET_DIR="$(TARGET_DIR)" docker/test-box.sh

# The same by a real engine, a Docker of its own. As root. WHOLE=1: the program is compiled in an image, too, which takes long.
test-engine: setup
	@docker/setup.sh engine
	$(CARGO) build --locked --workspace --bins --tests
	WHOLE=$(WHOLE) TARGET_DIR="$(TARGET_DIR)" docker/test-engine.sh

# The fuzz targets, all at once for so many minutes; FUZZ_SEED=N for other inputs than last time.
fuzz: setup-test
	FUZZ_MINUTES=$(MINUTES) $(CARGO) test --release --locked --package faceoff-runner --test it fuzz:: \
	    -- --nocapture --test-threads 4

# What other load costs agents: nothing. Alone, for it takes all of the machine that it can get.
busy: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	$(CARGO) test --locked --workspace --test e2e busy_host -- --include-ignored --test-threads 1

# Visitors by the hundred, beside evaluations, on the machine's own CPUs; nothing else should run.
load:
	@docker/setup.sh load
	$(CARGO) build --release --locked --package faceoff --package striker --package baseline
	python3 tests/load/load.py "$(RELEASE)/faceoff" "$(RELEASE)/striker"

# A slot of a worker against one of the server's own; nothing else should run.
elsewhere: setup-test
	$(CARGO) build --release --locked --package faceoff
	python3 tests/load/remote_slot.py "$(RELEASE)/faceoff"

# Many workers that sleep in place of playing, for one server; nothing else should run. TMPDIR=FOLDER: on that disk.
crowd: setup-test
	$(CARGO) build --release --locked --package faceoff --package faceoff-tests --bin faceoff --example crowd
	SHARDS=$(SHARDS) WORKERS=$(WORKERS) SLEEP_S=$(SLEEP_S) RECORDING_BYTES=$(RECORDING_BYTES) "$(RELEASE)/examples/crowd"

# The same files by JetStream's object store and by HTTP, without a delay and with 200 ms there and back; some five minutes.
objects: setup-test
	$(CARGO) build --release --locked --package faceoff-tests --example objects
	"$(RELEASE)/examples/objects"

# All disturbances at once; SOAK_SEED=N for other moments than last time.
soak: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	SOAK_MINUTES=$(MINUTES) $(CARGO) test --locked --workspace --test e2e soak:: -- --include-ignored --nocapture

# No verdict may depend on how busy the machine is.
steady:
	@docker/setup.sh steady
	@tests/steady.sh

# The pictures and numbers of docs/simulator.md.
fidelity:
	$(CARGO) run --locked -p faceoff-sim --example fidelity -- docs/images/fidelity

# The pictures of pages in the README and docs/, from a day that is played for them.
pictures: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	$(CARGO) test --locked --workspace --test e2e pictures:: -- --include-ignored

# Of the replay's script: so many milliseconds are the machine's, which is why no other test asks.
frames: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	$(CARGO) test --locked --workspace --test e2e replay::frames_need_little_script_time -- --include-ignored --nocapture

lint:
	$(CARGO) fmt --all --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings
	$(CARGO) build --locked --workspace --benches --examples

format:
	$(CARGO) fmt --all
