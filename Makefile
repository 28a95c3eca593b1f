# Everything runs in .venv, which the first target that needs it makes.
#   make demo PYTHON=python3.12        another interpreter (3.11 or 3.12)
#   make venv TORCH='torch==2.13.0'    another torch build: whatever `pip install` takes
# TORCH and PYTHON count when .venv is made: `make clean` first to change them.

PYTHON ?= $(shell for python in python3.11 python3.12 python3; do $$python -c 'import ensurepip, \
	sys; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))' 2>/dev/null \
	&& echo $$python && break; done)
TORCH ?= torch==2.13.0

# .venv has a ROS of its own, from wheels: one that is sourced must not be mixed into it.
unexport AMENT_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH RMW_IMPLEMENTATION ROS_DISTRO
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE
# Hundreds of processes start in the tests: each would compile all modules once more.
unexport PYTHONDONTWRITEBYTECODE

BIN := .venv/bin
PIP := $(BIN)/python -m pip --quiet
# Live tests mostly wait, hence more workers than two cores; one thread each, so that they share.
TEST := OMP_NUM_THREADS=1 $(BIN)/python -m pytest -p no:cacheprovider -n 4 --dist loadfile \
	--no-loadscope-reorder --max-worker-restart 0
SPHINX := $(BIN)/python -m sphinx -q -W --keep-going
SOURCES := setup.py setup.cfg package.xml pyproject.toml constraints.txt $(shell find \
	active_recon msg_tools resource scripts launch config rviz security \
	-type f -not -path '*/__pycache__/*' 2>/dev/null)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help venv demo golden test test-full test-jazzy test-lowest doc html bench soak policies weights ready read-doc compiled chromium lint clean

help:  ## this list
	@echo 'make TARGET, where TARGET is one of'
	@awk -F ':.*  ## ' '/^[a-z-]+:.*  ## / { printf "  %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

venv: .venv/installed  ## .venv with the package and all that it needs

demo: .venv/installed  ## the loop over ROS 2 on a real model; ARGS='--views 3' and so on
	@$(BIN)/active-recon demo $(ARGS)

golden: .venv/installed  ## the golden run anew, once weights or loop have changed
	@rm -rf build/golden
	@$(BIN)/active-recon demo --views 4 --precision f32 --output-dir build/golden
	@rm -rf bags/golden/run && mkdir -p bags/golden/run
	@mv build/golden/*/*.mcap build/golden/*/metadata.yaml bags/golden/run/

test: ready  ## style, types, documentation, every test but the long ones; ARGS go to pytest
	@echo '== testing; the long tests run with `make test-full`'
	@$(TEST) -m 'not slow' $(ARGS)

test-full: ready .venv/full  ## every test, high counts and soak too
	@echo '== testing everything'
	@$(TEST) $(ARGS)

# Whatever is made next has the versions of constraints.txt again.
test-jazzy: ready  ## `make test` with numpy 1.26 and OpenCV 4, for which Jazzy is built
test-lowest: ready  ## `make test` with the lowest versions that setup.py accepts; Python 3.11
test-jazzy test-lowest: test-%:
	@echo '== installing the versions of constraints-$*.txt'
	@rm .venv/installed
	@$(PIP) install --no-compile --no-deps -r constraints-$*.txt
	@$(TEST) -m 'not slow' $(ARGS)

# What the tests begin with; two at a time, since each keeps one core busy.
ready:
	@$(MAKE) --no-print-directory -j2 lint read-doc compiled chromium .venv/colcon/installed

# What the tests import is compiled once, and not by each of their workers at the same time. They
# tell what is wrong with it.
compiled: .venv/installed
	@$(BIN)/python -m pytest -p no:cacheprovider --collect-only >/dev/null 2>&1 || true

# The pages are tested in Debian's Chromium, which only root can install.
chromium:
	@missing="$$(command -v chromium >/dev/null || echo chromium) $$(command -v chromedriver \
		>/dev/null || echo chromium-driver)"; test "$$missing" = ' ' && exit 0; \
	if test "$$(id -u)" != 0 || ! command -v apt-get >/dev/null; then \
		echo "expected Chromium and its driver for the tests of the pages: install $$missing"; \
		exit 1; fi; \
	echo "== installing $$missing"; \
	apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install -y \
		--no-install-recommends $$missing >/dev/null

doc: html  ## the documentation, built and opened; ARGS=--no-open only builds
	@$(if $(filter --no-open,$(ARGS)),echo build/doc/index.html,$(BIN)/python -m webbrowser \
		'file://$(CURDIR)/build/doc/index.html')

# Every warning comes without pages being written, too.
read-doc: .venv/installed
	@echo '== checking the documentation'
	@$(SPHINX) -b dummy -d build/doc-check/.doctrees doc build/doc-check

html: .venv/installed
	@echo '== building the documentation'
	@$(SPHINX) -b html -d build/doc/.doctrees doc build/doc

bench: .venv/installed  ## the figures of doc/benchmarks.md, measured here
	@echo '== measuring'
	@$(BIN)/python -m benchmarks --keep $(ARGS)

soak: .venv/installed  ## an hour of the loop, for docs/soak.md; ARGS='--minutes 5' for less
	@echo '== soaking'
	@$(BIN)/python -m benchmarks.soak $(ARGS)

weights: .venv/installed  ## the small network's weights from scratch, resumable; see weights.mk
	@$(MAKE) --no-print-directory -f weights.mk $(ARGS)

policies: .venv/installed  ## security/policies.xml anew, from the live graph
	@$(BIN)/python security/generate.py

lint: .venv/installed  ## ruff and mypy
	@echo '== checking the style and the types'
	@$(BIN)/ruff check
	@$(BIN)/mypy --num-workers 2

clean:  ## forget .venv and what was built
	@echo '== removing .venv and what was built'
	@rm -rf .venv build install log *.egg-info

# Modules are compiled when they are first used: compiling all of them takes half a minute. The
# pip that comes with Python takes 20 s longer to find what belongs together.
# torch goes first, by itself: what needs torch would otherwise choose the build.
.venv/torch:
	@test -n '$(PYTHON)' || { echo 'expected Python 3.11 or 3.12 with venv on the PATH, found' \
		"none: install one, or name it by PYTHON=..."; exit 1; }
	@echo '== making .venv with $(PYTHON) (a few minutes, once)'
	@$(PYTHON) -m venv --clear .venv
	@$(PIP) install --no-compile -c constraints.txt --upgrade pip
	@echo '== installing $(TORCH)'
	@$(PIP) install --no-compile -c constraints.txt $(TORCH) setuptools
	@touch $@

# A copy is installed, since an editable install leaves out lib/active_recon/ and the ament index;
# it is made anew whenever a source has changed. build/ would keep modules that are gone.
.venv/installed: .venv/torch $(SOURCES)
	@echo '== installing active_recon and what it needs'
	@rm -rf build
	@$(PIP) install --no-compile --no-build-isolation -c constraints.txt '.[doc,lint,test]'
	@rm -rf build active_recon.egg-info
	@touch $@

# The long tests have a store's server besides.
.venv/full: .venv/installed
	@echo '== installing what the long tests need'
	@$(PIP) install --no-compile --no-build-isolation -c constraints.txt '.[test-full]'
	@rm -rf build active_recon.egg-info
	@touch $@

# colcon needs an older setuptools than ours: both stand in a folder that only colcon sees.
.venv/colcon/installed: constraints-colcon.txt | .venv/torch
	@echo '== installing colcon'
	@rm -rf .venv/colcon
	@$(PIP) install --no-compile --no-deps --target .venv/colcon -r $<
	@touch $@
