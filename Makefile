# Every target does its own set-up: a machine needs Python 3.11 and make, nothing else.
# BPY picks the Blender module that the tests run in; 5.x needs PYTHON=python3.13.
PYTHON ?= python3.11
BPY ?= 4.5.15
TESTS ?= tests
VENV := .venv$(if $(filter-out 4.5.15,$(BPY)),-$(BPY))
SCRIPTS := $(if $(filter Windows_NT,$(OS)),Scripts,bin)
BIN := $(VENV)/$(SCRIPTS)
READY := $(VENV)/.ready-$(BPY)
PYTEST := $(BIN)/python -m pytest

# Without Blender: the core, lint and types. NUMPY is the one that Blender 4.5 has.
NUMPY ?= 1.26.4
CORE := .venv-core/$(SCRIPTS)
CORE_READY := .venv-core/.ready-$(NUMPY)
LINT_READY := .venv-core/.ready-lint

# One process for each processor, but no crowd of Blenders on a large machine. What measures time runs alone.
SIDE_BY_SIDE := -n auto --maxprocesses 8 --dist worksteal

# make demo MOTION=file.bvh SCALE=0.01 walks as in a motion file; UP=Y|Z names its up axis if it is not found.
MOTION ?=
SCALE ?= 0.01
UP ?=

.PHONY: ready blenders demo scenes assets heroes ground_sheets gallery moving film core test slow versions marathon bench validate validate-ground zoo sheets gui pictures package installed lint types architecture strings api clean

$(READY): $(wildcard requirements/*.txt)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet bpy==$(BPY) -r requirements/test.txt
	touch $@

$(CORE_READY): requirements/core.txt
	$(PYTHON) -m venv .venv-core
	$(CORE)/python -m pip install --quiet numpy==$(NUMPY) -r requirements/core.txt
	touch $@

$(LINT_READY): $(CORE_READY) requirements/lint.txt
	$(CORE)/python -m pip install --quiet -r requirements/lint.txt
	touch $@

ready: $(READY)

demo: $(READY)
	$(BIN)/python -m sample_scenes.demo $(if $(MOTION),--motion "$(MOTION)" --scale $(SCALE)) $(if $(UP),--up $(UP))

# The scenes of docs/figures.md with their pictures, from nothing, into build/scenes.
scenes: $(READY)
	$(BIN)/python -m sample_scenes.make_all

# An asset library of what the add-on and its scenes make: materials, debris, weather, characters; in build/assets.
assets: $(READY)
	$(BIN)/python -m sample_scenes.asset_library

# The large pictures of docs/gallery.md.
heroes: $(READY)
	$(BIN)/python -m gallery.make_all --samples 16

# Each ground from 0.3, 2 and 20 m in Cycles, EEVEE and Material Preview, and a print that grows, into build/ground_sheets.
ground_sheets: $(READY)
	$(BIN)/python -m gallery.ground_sheets

# What `make scenes` builds, the smaller pictures beside it, and then all into docs/images, small .blend files into sample_scenes.
gallery: scenes
	$(BIN)/python -m gallery.relief
	$(BIN)/python -m gallery.publish

# The moving picture of the README, and the small ones of the preset menu.
moving: $(READY)
	$(BIN)/python -m gallery.moving_picture --output build/moving --samples 8
	cp build/moving/moving_picture.webp docs/images/
	$(BIN)/python -m gallery.preset_pictures

# SoftGround in use: recorded in the window of a real Blender 4.3, and a night of snow.
film: $(READY)
	$(MAKE) blenders BLENDERS=trixie
	$(PYTEST) -m film -rs tests/gui/test_filmed.py -k trixie
	$(BIN)/python -m gallery.in_use --output build/in_use --samples 8
	cp build/in_use/in_use.webp docs/images/

# Processes side by side gain nothing from threads that wait for each other's processors.
core test slow marathon: export OPENBLAS_NUM_THREADS := 1
# Tests start a hundred processes, none of which is to compile this project anew.
core test slow marathon: export PYTHONDONTWRITEBYTECODE :=

core: $(CORE_READY)
	$(CORE)/python -m pytest $(SIDE_BY_SIDE) -m "$(QUICK) and not alone" tests/core

# What measures processor time has the machine to itself; where none of $(TESTS) does, pytest exits with 5.
QUICK := $(shell sed -n "s/^addopts.* -m '\([^']*\)'.*/\1/p" pyproject.toml)
test: $(READY)
	$(PYTEST) $(SIDE_BY_SIDE) -m "$(QUICK) and not alone" $(TESTS)
	$(PYTEST) -m "$(QUICK) and alone" $(TESTS) || [ $$? -eq 5 ]

slow: $(READY)
	$(PYTEST) $(SIDE_BY_SIDE) -m "slow and not marathon and not alone" $(TESTS)
	$(PYTEST) -m "slow and not marathon and alone" $(TESTS) || [ $$? -eq 5 ]

# One file baked in each Blender that is here, played in the others.
versions: $(READY)
	$(PYTEST) -m versions -rs tests/blender/sessions/test_versions.py

marathon: $(READY)
	$(PYTEST) $(SIDE_BY_SIDE) -m marathon $(TESTS)

bench: $(READY)
	$(PYTEST) -m benchmark $(TESTS)

validate: $(READY)
	$(BIN)/python -m tests.validation.validate $(DATA)

# The ground law against boots, skis, plates and wheels on real ground; exits with 1 beyond its limits.
validate-ground: $(READY)
	$(BIN)/python -m tests.validation.validate_ground $(DATA)

# Rigs that strangers made, each baked with default settings and judged by its own skin.
RIGS := ../shared/data/rigs/rigs.json
zoo: $(READY)
	$(BIN)/python ../shared/tools/zoo.py $(RIGS) $(CLIPS)

# For each of them a picture: how high its feet are, when they touch, and where its skin rests.
sheets: $(READY)
	$(BIN)/python -m tests.validation.contact_sheets $(RIGS) build/contact_sheets $(CLIPS)

lint: $(LINT_READY)
	$(CORE)/ruff check .
	$(CORE)/ruff format --check .
	$(CORE)/lint-imports --no-cache

types: $(LINT_READY)
	$(CORE)/mypy

# The picture of docs/development.md, drawn from the import contracts.
architecture:
	$(PYTHON) -m release.architecture docs/images/architecture.svg

# What catalogues of the interface's languages lack or need no more.
strings: $(READY)
	$(BIN)/python -m release.strings

# The reference of the library in build/api, from its docstrings; its examples run.
api: $(READY)
	$(BIN)/python -m sphinx -q -W -b html docs/api build/api
	$(BIN)/python -m sphinx -q -W -b doctest docs/api build/api-examples

# The extension as users install it, built and checked by Blender's own tool.
package: $(READY)
	$(BIN)/python -m release.package build/softground.zip

# The same, installed in the Blender module of BPY, bakes.
installed: $(READY)
	$(PYTEST) tests/release/test_package.py

# Real Blenders on a virtual screen: 4.3, and the newest that Debian has. Those that cannot be had are left out.
REAL_BLENDER := ../shared/tools/real_blender.sh
BLENDERS ?= trixie sid
blenders:
	for suite in $(BLENDERS); do [ ! -x $(REAL_BLENDER) ] || $(REAL_BLENDER) provision $$suite || true; done

GUI := $(PYTEST) -rs tests/gui -k "$(subst $() , or ,$(strip $(BLENDERS)))"
gui: $(READY) blenders
	$(GUI) -m "gui and alone"
	$(GUI) -m "gui and not alone" $(SIDE_BY_SIDE) --dist loadfile --no-loadscope-reorder

# The pictures in the docs, as the GUI tests took them in Blender 4.3.
pictures: export PICTURES_OF_DOCS := 1
pictures: gui
	cp build/gui/trixie/*/docs/*.png docs/images/

clean:
	rm -rf build .venv .venv-*
