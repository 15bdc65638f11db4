SHELL := /bin/bash
.SHELLFLAGS := -o pipefail -c

PYTHON ?= python3
BIN := .venv/bin
# what the demo needs; what the tests need as well; what builds and checks the documentation
DEMO := .venv/.demo
TESTS := .venv/.tests
STAMP := .venv/.installed
OLD_BIN := .venv/oldest/bin
OLD_STAMP := .venv/oldest/.installed
RAY_BIN := .venv/ray/bin
RAY_STAMP := .venv/ray/.installed
TWINS_BIN := .venv/twins/bin
TWINS_STAMP := .venv/twins/.installed

.PHONY: help demo test package wheel oldest ray twins stress bench check docs clean

help:
	@echo "make demo    train the pushing policy, evaluate it, film it"
	@echo "make test    run the tests"
	@echo "make package test the built wheel and the settings that rl-baselines3-zoo reads"
	@echo "make wheel   build a wheel with compiled kernels for this kind of machine into dist/"
	@echo "make oldest  test the oldest versions that are supported, in .venv/oldest"
	@echo "make ray     run the tests that need Ray, in .venv/ray"
	@echo "make twins   test twins beside their originals, in .venv/twins"
	@echo "make stress  run the tests in their long form, with many more random examples; PART=2/8 runs a part"
	@echo "make bench   measure speed and accuracy, together with MuJoCo"
	@echo "make check   lint, format, types, import rules, documentation"
	@echo "make docs    build the documentation into docs/_build/html"
	@echo "make clean   remove builds and caches (not runs/, not .venv)"

# Installs again only when what is to be installed has changed. Of pip's report it shows a line for
# each package that is new.
PIP = install -c constraints.txt --progress-bar off
PIP_DEV = $(PIP) -c constraints-dev.txt
SHOW = | awk '/^Collecting/ {print "  " ++n " " $$2} /^Installing collected/ {print "  unpacking"} {fflush()}'

.venv/.created:
	$(PYTHON) -m venv .venv
	@touch $@

$(DEMO): pyproject.toml constraints.txt | .venv/.created
	@echo "installing what training needs into .venv, about 60 packages: a minute"
	@$(BIN)/python -m pip $(PIP) -e ".[train]" $(SHOW)
	@touch $@

$(TESTS): constraints-dev.txt $(DEMO)
	@echo "installing what the tests need into .venv, about 60 packages more: half a minute"
	@$(BIN)/python -m pip $(PIP_DEV) -e ".[train,render,view,mesh,dev]" $(SHOW)
	@touch $@

$(STAMP): $(TESTS)
	@echo "installing what the documentation needs into .venv"
	@$(BIN)/python -m pip $(PIP_DEV) -e ".[train,render,view,mesh,dev,docs]" $(SHOW)
	@touch $@

.venv: $(STAMP)

demo: $(DEMO)
	$(BIN)/rigid-envs demo

test: $(TESTS)
	$(BIN)/python -m pytest -q -n 2 --dist worksteal -m "not packaging"

package: $(TESTS)
	$(BIN)/python -m pytest -q -n 2 --dist loadfile -m packaging

# With kernels for every level of processors that this one has.
wheel: $(TESTS)
	rm -rf physics/prebuilt
	for level in x86-64-v3 x86-64-v4; do \
		$(BIN)/rigid-envs compile --level $$level --into physics/prebuilt || exit 1; done
	$(BIN)/python -m build --wheel --no-isolation
	rm -rf physics/prebuilt build

# RLlib pins another version of gymnasium, so Ray has a virtual environment of its own.
$(RAY_STAMP): pyproject.toml constraints-ray.txt
	$(PYTHON) -m venv .venv/ray
	$(RAY_BIN)/python -m pip install --quiet -c constraints-ray.txt -e ".[ray,tune]" pytest hypothesis
	@touch $@

ray: $(RAY_STAMP)
	RAY_USAGE_STATS_ENABLED=0 $(RAY_BIN)/python -m pytest -q tests/training/cluster

# The oldest numba, NumPy, Gymnasium and threadpoolctl that pyproject.toml allows.
$(OLD_STAMP): pyproject.toml constraints-oldest.txt Makefile
	$(PYTHON) -m venv .venv/oldest
	$(OLD_BIN)/python -m pip install --quiet -c constraints-oldest.txt -e . pytest pytest-xdist hypothesis scipy
	@touch $@

oldest: $(OLD_STAMP)
	$(OLD_BIN)/python -m pytest -q -n 2 --dist loadfile tests/physics/compiler tests/physics/step/test_kernel_choice.py

# Gymnasium-Robotics and panda-gym, which need an older MuJoCo, in a virtual environment of their own.
$(TWINS_STAMP): constraints-twins.txt
	$(PYTHON) -m venv .venv/twins
	$(TWINS_BIN)/python -m pip install --quiet -r constraints-twins.txt
	@touch $@

twins: $(TWINS_STAMP) $(TESTS)
	TWINS_PYTHON=$(TWINS_BIN)/python $(BIN)/python -m pytest -q tests/originals

stress: $(TESTS)
	$(BIN)/python -m pytest -q --hypothesis-profile=stress $(if $(PART),--part $(PART))

bench: $(TESTS)
	$(BIN)/python -m pip install --quiet -c constraints.txt -c constraints-dev.txt -e ".[bench]"
	$(BIN)/python -m benchmarks

check: $(STAMP) docs
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(STAMP)
	$(BIN)/sphinx-build -W --keep-going -q docs docs/_build/html

clean:
	rm -rf build dist *.egg-info docs/_build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -not -path "./.venv/*" -prune -exec rm -rf {} +
