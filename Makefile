# The two main targets: `make demo` runs a competition day, `make test` runs all tests.

# Variables a user may set.
# demo: EPISODES per task; SERVE=0 ends after the day instead of serving it; LISTEN is the server's address, DEMO_DIR its data folder.
EPISODES ?= 50
SERVE    ?= 1
LISTEN   ?= 127.0.0.1:8080
DEMO_DIR ?= demo-data
# fuzz, soak: duration.
MINUTES  ?= 60
# crowd: least number of SHARDS (groups of episodes), number of WORKERS, and seconds for which a worker sleeps per shard.
SHARDS   ?= 10000
WORKERS  ?= 200
SLEEP_S  ?= 10
# test-engine: 1 also compiles the program in an image.
WHOLE    ?=
# test-languages: 0 leaves out the images.
IMAGES   ?=
# test-first-hour: version of Debian.
SUITE    ?= bookworm
# costs: see its target.
ONLY     ?=
ROUNDS   ?= 1
COMMIT   ?= HEAD
JSON     ?=

# Tests spend much of their time waiting, so more run at once than there are CPUs.
TEST_THREADS ?= $(shell echo $$((3 * $$(nproc))))

CARGO      ?= cargo
# Paths may contain spaces. So recipes quote these variables, and none is a target, a prerequisite or an argument of a make function, which
# split names at spaces.
TARGET_DIR := $(if $(CARGO_TARGET_DIR),$(CARGO_TARGET_DIR),target)
RELEASE    := $(TARGET_DIR)/release
# In a target folder without incremental data, tests are built without it: their build takes a sixth less CPU time. Once a developer's cargo
# has written such data, they are built with it, because cargo compiles the workspace again after each change of this setting.
ifeq ($(origin CARGO_INCREMENTAL)$(shell ls -A "$(TARGET_DIR)/debug/incremental" 2>/dev/null),undefined)
export CARGO_INCREMENTAL := 0
endif
DEMO       := $(TARGET_DIR)/demo

.PHONY: channels demo test tests-built tests-of-rust tests-of-python tests-of-api tests-of-agents tests-of-scripts test-release costs web wheel pictures test-api test-python test-python-versions test-learning fuzz busy load route-costs remote-slot crowd objects soak steady frames test-cgroup2 test-box test-engine test-first-hour test-languages lint format fidelity setup setup-test agents dist clean-demo help

help:
	@echo "make demo   run a competition day: EPISODES=$(EPISODES) SERVE=$(SERVE) LISTEN=$(LISTEN)"
	@echo "make agents   bundle striker and baseline: $(TARGET_DIR)/bundles"
	@echo "make dist   pack the program for other Linux machines: $(TARGET_DIR)/dist"
	@echo "make test   run all tests"
	@echo "make test-release   build the release program and check its size, symbols and golden hashes"
	@echo "make costs   measure the cost of building and testing, from fresh clones: ONLY=$(ONLY) ROUNDS=$(ROUNDS) COMMIT=$(COMMIT) JSON=$(JSON)"
	@echo "make web    build the script of the replay pages: web/client/dist"
	@echo "make wheel  build the Python package: $(TARGET_DIR)/wheels"
	@echo "make test-api   validate the OpenAPI document, call every operation, generate two clients"
	@echo "make test-python   build the Python package, install it in an empty environment, test it"
	@echo "make test-python-versions   test that package with Python 3.13 and 3.14, in the files of newer Debian releases"
	@echo "make test-learning   train the learning examples from scratch, and test the libraries that need torch (8 GB)"
	@echo "make test-cgroup2   test the sandbox's limits on cgroup v2, in a virtual machine without v1"
	@echo "make test-box   build the images' file systems without a container engine, and start the programs in them"
	@echo "make test-first-hour   run the first hour of the guide in a fresh Debian: SUITE=$(SUITE)"
	@echo "make test-languages   play agents in C++, C#, Java, JavaScript, Lua, Python and Rust, as bundles and as images"
	@echo "make test-engine   build the images with Docker, and run a day in containers; WHOLE=1 also compiles there"
	@echo "make fuzz   fuzz the parsers with almost valid input: MINUTES=$(MINUTES)"
	@echo "make channels   print the rates of the channels between agents that remain"
	@echo "make busy   run agents beside other load: CPU, memory, I/O and processes"
	@echo "make load   measure how many page views a server handles, and check that agents are not affected"
	@echo "make route-costs   measure the CPU time of each public page and API route"
	@echo "make remote-slot   measure the overhead of a remote worker, compared with the server's own slot"
	@echo "make crowd   measure the throughput of one server with many workers: SHARDS=$(SHARDS) WORKERS=$(WORKERS) SLEEP_S=$(SLEEP_S)"
	@echo "make objects   compare file transfer by JetStream's object store and by HTTP, on a link of 200 ms"
	@echo "make soak   upload, evaluate, read, fill the disk and kill the server, all at once: MINUTES=$(MINUTES)"
	@echo "make steady run the tests ten times, and three times on a busy host"
	@echo "make frames   measure the CPU time per frame of the replay script"
	@echo "make pictures   take the screenshots of README and docs/ again"
	@echo "make lint   check format and lints"
	@echo "make fidelity   draw the differences between the simulator and the recordings"

setup:
	@docker/setup.sh build

setup-test:
	@docker/setup.sh test

# The bundles of the compiled agents. The demo uploads striker; baseline is for test games. Built alone, they use other features of their
# dependencies than together with the server, so the demo builds all at once.
agents: setup
	$(CARGO) build --release --locked --package striker --package baseline
	built="$(RELEASE)"; $(PACK_AGENTS)

# The program in an archive. It fails if the program needs a newer system than the participants have.
dist: setup
	$(CARGO) build --release --locked --package faceoff
	docker/dist.sh "$(RELEASE)/faceoff" "$(TARGET_DIR)/dist"

# The commands of the guide's first hour, by an ordinary user in a fresh Debian, and `eval` and `doctor` on hosts that lack something. As
# root. The first run makes the Debian (SUITE) from its packages, which takes over a minute.
test-first-hour: setup
	@docker/setup.sh first-hour
	$(CARGO) build --locked --workspace --bins --tests
	python3 tests/first_hour/first_hour.py --program "$(TARGET_DIR)/debug/faceoff" --cache "$(TARGET_DIR)/first-hour" --suite $(SUITE)
	python3 tests/first_hour/hosts.py --program "$(TARGET_DIR)/debug/faceoff" --cache "$(TARGET_DIR)/first-hour" --suite $(SUITE)

# Agents in all languages, as bundles and as container images. As root: the images' Debian is made from its packages.
test-languages: setup
	@docker/setup.sh languages
	$(CARGO) build --locked --workspace --bins --tests
	python3 tests/languages/test_languages.py --program "$(TARGET_DIR)/debug/faceoff" --work "$(TARGET_DIR)/languages" $(if $(filter 0,$(IMAGES)),,--images)

# Builds, checks and packs the release program, after a test of the check (docker/check-program.sh).
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

# Runs targets in parallel, since they often wait: for a registry, for one program, for one of two CPUs. Lines that begin with + print
# their output (cargo's) at once; other output is printed when a target is complete.
PARALLEL_MAKE = $(MAKE) --no-print-directory --output-sync=target --keep-going --jobs

test: setup-test
	$(PARALLEL_MAKE) tests-built tests-of-agents tests-of-scripts
	$(PARALLEL_MAKE) tests-of-rust tests-of-python tests-of-api

# Parts of `make test`, in two rounds: the Rust tests use tools that the tests of agents and pages install.
# The programs are built first, since the end-to-end tests run the real binary and the real agents. With --tests the
# dependencies get the same features as in the test run below, and are built only once. Examples are checked by `make lint`.
tests-built:
	+$(CARGO) build --locked --workspace --bins --tests
	tests/runtimes.sh "$(TARGET_DIR)"
tests-of-rust:
	+if $(CARGO) nextest --version >/dev/null 2>&1; \
	    then $(CARGO) nextest run --locked --workspace --lib --bins --tests --no-fail-fast --test-threads $(TEST_THREADS); \
	    else $(CARGO) test --locked --workspace --no-fail-fast -- --test-threads $(TEST_THREADS); fi
tests-of-python:
	python3 tests/costs/compiled_once.py
	TARGET_DIR="$(TARGET_DIR)" crates/faceoff-py/test.sh test
tests-of-api:
	TARGET_DIR="$(TARGET_DIR)" tests/api/test.sh
tests-of-agents:
	python3 agents/test_agents.py
	web/client/build.sh test
	TARGET_DIR="$(TARGET_DIR)" tests/s3/setup.sh
# Tests of the scripts that check a release and measure builds, on small programs and a small project.
tests-of-scripts:
	python3 docker/test_check_program.py
	python3 tests/costs/test_costs.py
	python3 tests/words/test_words.py
	python3 tests/first_hour/test_guide.py

# Measures HEAD or COMMIT from fresh clones and prints a table; run it on an idle machine. ONLY: some of demo, test, page, store, release,
# crates, lines. ROUNDS: of demo, test and release. JSON=FILE also writes the numbers there. TMPDIR=FOLDER: folder of the clones.
costs: setup-test
	@python3 tests/costs/costs.py --only '$(ONLY)' --rounds $(ROUNDS) --commit '$(COMMIT)' $(if $(JSON),--json '$(JSON)')

# The script of the replay pages, from its sources; the output is committed.
web:
	web/client/build.sh build

# The Python package, for every CPython from 3.11 on: one wheel.
wheel: setup
	TARGET_DIR="$(TARGET_DIR)" crates/faceoff-py/test.sh wheel

# The API with external tools: a validator, a fuzzer and two client generators, against the debug server.
test-api: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	TARGET_DIR="$(TARGET_DIR)" tests/api/test.sh

# Compares the Python evaluator with the binary, and runs the examples in the sandbox.
test-python: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	tests/runtimes.sh "$(TARGET_DIR)"
	TARGET_DIR="$(TARGET_DIR)" crates/faceoff-py/test.sh test

# Debian's next release changes from day to day, so this is no part of `make test`. As root.
test-python-versions: test-python
	@docker/setup.sh python-versions
	TARGET_DIR="$(TARGET_DIR)" tests/python-versions.sh

# Takes long and gigabytes: trains the examples again, with Stable-Baselines3 and LeRobot.
test-learning: agents
	$(CARGO) build --release --locked --package faceoff
	TARGET_DIR="$(TARGET_DIR)" crates/faceoff-py/test.sh learning

# Tests cgroup v2 on any host, also on one with v1. As root.
test-cgroup2: setup
	@docker/setup.sh cgroup2
	$(CARGO) build --locked --workspace --bins --tests
	TARGET_DIR="$(TARGET_DIR)" docker/cgroup2.sh

# Runs the steps of docker/Dockerfile, and checks the configurations of Compose and Kubernetes. As root.
test-box: setup
	@docker/setup.sh box
	$(CARGO) build --locked --workspace --bins --tests
	TARGET_DIR="$(TARGET_DIR)" docker/test-box.sh

# The same with a separate Docker engine. As root. WHOLE=1 also compiles the program in an image, which takes long.
test-engine: setup
	@docker/setup.sh engine
	$(CARGO) build --locked --workspace --bins --tests
	WHOLE=$(WHOLE) TARGET_DIR="$(TARGET_DIR)" docker/test-engine.sh

# All fuzz targets at once for MINUTES; FUZZ_SEED=N gives other inputs.
fuzz: setup-test
	FUZZ_MINUTES=$(MINUTES) $(CARGO) test --release --locked --package faceoff-runner --test it fuzz:: \
	    -- --nocapture --test-threads 4

# Checks that other load does not affect agents. Run it alone: it uses all CPUs.
busy: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	$(CARGO) test --locked --workspace --test e2e busy_host -- --include-ignored --test-threads 1

# Prints the rates of the channels between agents that remain (docs/security.md). Run it alone.
channels: setup-test
	$(CARGO) test --locked --workspace --test it rates_of_remaining_channels -- --ignored --nocapture

# Hundreds of visitors beside evaluations, on the same CPUs; run it on an idle machine.
load:
	@docker/setup.sh load
	$(CARGO) build --release --locked --package faceoff --package striker --package baseline
	python3 tests/load/load.py "$(RELEASE)/faceoff" "$(RELEASE)/striker"

# What each public page and API route costs; run it on an idle machine.
route-costs: setup-test
	$(CARGO) build --release --locked --package faceoff --package striker --package baseline
	python3 tests/load/route_costs.py "$(RELEASE)/faceoff" "$(RELEASE)/striker"

# Compares a slot of a remote worker with a slot of the server; run it on an idle machine.
remote-slot: setup-test
	$(CARGO) build --release --locked --package faceoff
	python3 tests/load/remote_slot.py "$(RELEASE)/faceoff"

# Many workers that sleep instead of running agents, for one server; run it on an idle machine. TMPDIR=FOLDER selects the disk.
crowd: setup-test
	$(CARGO) build --release --locked --package faceoff --package faceoff-tests --bin faceoff --example crowd
	SHARDS=$(SHARDS) WORKERS=$(WORKERS) SLEEP_S=$(SLEEP_S) RECORDING_BYTES=$(RECORDING_BYTES) "$(RELEASE)/examples/crowd"

# Transfers files by JetStream's object store and by HTTP, without delay and with a round trip of 200 ms; about five minutes.
objects: setup-test
	$(CARGO) build --release --locked --package faceoff-tests --example objects
	"$(RELEASE)/examples/objects"

# All disturbances at once; SOAK_SEED=N gives other times.
soak: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	SOAK_MINUTES=$(MINUTES) $(CARGO) test --locked --workspace --test e2e soak:: -- --include-ignored --nocapture

# Checks that no test result depends on the load of the machine.
steady:
	@docker/setup.sh steady
	@tests/steady.sh

# The figures and numbers of docs/simulator.md.
fidelity:
	$(CARGO) run --locked -p faceoff-sim --example fidelity -- docs/images/fidelity

# The screenshots in README and docs/, from an evaluation day that is run for them.
pictures: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	$(CARGO) test --locked --workspace --test e2e pictures:: -- --include-ignored

# CPU time of the replay script. It depends on the machine, so no other test checks it.
frames: setup-test
	$(CARGO) build --locked --workspace --bins --tests
	$(CARGO) test --locked --workspace --test e2e frame_costs:: -- --include-ignored --nocapture

lint:
	python3 tests/words/words.py
	$(CARGO) fmt --all --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings

format:
	$(CARGO) fmt --all
