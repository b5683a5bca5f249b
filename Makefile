# Every target does its own set-up: a machine needs Python 3.11 and make, nothing else.
# BPY picks the Blender module that the tests run in; 5.x needs PYTHON=python3.13.
PYTHON ?= python3.11
BPY ?= 4.5.15
TESTS ?= tests
VENV := .venv$(if $(filter-out 4.5.15,$(BPY)),-$(BPY))
BIN := $(VENV)/bin
READY := $(VENV)/.ready-$(BPY)
PYTEST := $(BIN)/python -m pytest
# One process for each processor, but no crowd of Blenders on a large machine. What measures time runs alone.
SIDE_BY_SIDE := -n auto --maxprocesses 8 --dist worksteal

# make demo MOTION=file.bvh SCALE=0.01 walks as in a motion file; UP=Y|Z names its up axis if it is not found.
MOTION ?=
SCALE ?= 0.01
UP ?=

.PHONY: ready blenders demo scenes assets heroes ground_sheets gallery moving film test slow versions marathon bench validate zoo sheets gui pictures package lint types clean

$(READY): requirements/test.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet bpy==$(BPY) -r requirements/test.txt
	touch $@

ready: $(READY)

demo: $(READY)
	$(BIN)/python -m sample_scenes.demo $(if $(MOTION),--motion "$(MOTION)" --scale $(SCALE)) $(if $(UP),--up $(UP))

# The scenes of docs/figures.md and the smaller of docs/gallery.md with their pictures, from nothing, into build/scenes.
scenes: $(READY)
	$(BIN)/python -m sample_scenes.make_all

# An asset library of what the add-on and its scenes make: materials, debris, weather, characters; in build/assets.
assets: $(READY)
	$(BIN)/python -m sample_scenes.asset_library

# The large pictures of docs/gallery.md.
heroes: $(READY)
	$(BIN)/python -m sample_scenes.make_all heroes --samples 16

# Each ground from 0.3, 2 and 20 m in Cycles, EEVEE and Material Preview, and a print that grows, into build/ground_sheets.
ground_sheets: $(READY)
	$(BIN)/python -m sample_scenes.ground_sheets

# What `make scenes` builds, and then the pictures into docs/images and the small .blend files into sample_scenes.
gallery: scenes
	$(BIN)/python -m sample_scenes.publish

# The moving picture of the README, and the small ones of the preset menu.
moving: $(READY)
	$(BIN)/python -m sample_scenes.moving_picture --output build/moving --samples 8
	cp build/moving/moving_picture.webp docs/images/
	$(BIN)/python -m sample_scenes.preset_pictures

# SoftGround in use: recorded in the window of a real Blender 4.3, and a night of snow.
film: $(READY)
	$(MAKE) blenders BLENDERS=trixie
	$(PYTEST) -m film -rs tests/gui/test_filmed.py -k trixie
	$(BIN)/python -m sample_scenes.in_use --output build/in_use --samples 8
	cp build/in_use/in_use.webp docs/images/

# Processes side by side gain nothing from threads that wait for each other's processors.
test slow marathon: export OPENBLAS_NUM_THREADS := 1
# Tests start a hundred processes, none of which is to compile this project anew.
test slow marathon: export PYTHONDONTWRITEBYTECODE :=

# What measures processor time has the machine to itself; where none of $(TESTS) does, pytest exits with 5.
QUICK := $(shell sed -n "s/^addopts.* -m '\([^']*\)'.*/\1/p" pyproject.toml)
test: $(READY)
	$(PYTEST) $(SIDE_BY_SIDE) -m "$(QUICK) and not alone" $(TESTS)
	$(PYTEST) -m "$(QUICK) and alone" $(TESTS) || [ $$? -eq 5 ]

slow: $(READY)
	$(PYTEST) $(SIDE_BY_SIDE) -m "slow and not alone" $(TESTS)
	$(PYTEST) -m "slow and alone" $(TESTS) || [ $$? -eq 5 ]

# One file baked in each Blender that is here, played in the others.
versions: $(READY)
	$(PYTEST) -m versions -rs tests/blender/test_versions.py

marathon: $(READY)
	$(PYTEST) $(SIDE_BY_SIDE) -m marathon $(TESTS)

bench: $(READY)
	$(PYTEST) -s -m benchmark $(TESTS)

validate: $(READY)
	$(BIN)/python -m tests.validation.validate $(DATA)

# Rigs that strangers made, each baked with default settings and judged by its own skin.
RIGS := ../shared/data/rigs/rigs.json
zoo: $(READY)
	$(BIN)/python ../shared/tools/zoo.py $(RIGS) $(CLIPS)

# For each of them a picture: how high its feet are, when they touch, and where its skin rests.
sheets: $(READY)
	$(BIN)/python -m tests.validation.contact_sheets $(RIGS) build/contact_sheets $(CLIPS)

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache

types: $(READY)
	$(BIN)/mypy

# The extension as users install it, built and checked by Blender's own tool.
package: $(READY)
	$(BIN)/python -m release.package build/softground.zip

# Real Blenders on a virtual screen: 4.3, and the newest that Debian has. Those that cannot be had are left out.
REAL_BLENDER := ../shared/tools/real_blender.sh
BLENDERS ?= trixie sid
blenders:
	for suite in $(BLENDERS); do [ ! -x $(REAL_BLENDER) ] || $(REAL_BLENDER) provision $$suite || true; done

GUI := $(PYTEST) -rs tests/gui -k "$(subst $() , or ,$(strip $(BLENDERS)))"
gui: $(READY) blenders
	$(GUI) -m "gui and alone"
	$(GUI) -m "gui and not alone" $(SIDE_BY_SIDE) --dist loadfile

# The pictures in the docs, as the GUI tests took them in Blender 4.3.
pictures: gui
	cp build/gui/trixie/*/docs/*.png docs/images/

clean:
	rm -rf build .venv .venv-*
