PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed
RAY_BIN := .venv/ray/bin
RAY_STAMP := .venv/ray/.installed

.PHONY: help demo test package ray stress bench check docs clean

help:
	@echo "make demo    train the pushing policy, evaluate it, film it"
	@echo "make test    run the tests"
	@echo "make package test the built wheel and the settings that rl-baselines3-zoo reads"
	@echo "make ray     run the tests that need Ray, in .venv/ray"
	@echo "make stress  run the tests in their long form, with many more random examples"
	@echo "make bench   measure speed and accuracy, together with MuJoCo"
	@echo "make check   lint, format, types, import rules, documentation"
	@echo "make docs    build the documentation into docs/_build/html"
	@echo "make clean   remove builds and caches (not runs/, not .venv)"

# Installs again only when what is to be installed has changed.
$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet -c constraints.txt -e ".[train,render,view,mesh,dev,docs]"
	@touch $@

.venv: $(STAMP)

demo: $(STAMP)
	$(BIN)/rigid-envs demo

test: $(STAMP)
	$(BIN)/python -m pytest -q -n 2 --dist worksteal -m "not packaging"

package: $(STAMP)
	$(BIN)/python -m pytest -q -m packaging

# RLlib pins another version of gymnasium, so Ray has a virtual environment of its own.
$(RAY_STAMP): pyproject.toml constraints-ray.txt
	$(PYTHON) -m venv .venv/ray
	$(RAY_BIN)/python -m pip install --quiet -c constraints-ray.txt -e ".[ray,tune]" pytest hypothesis
	@touch $@

ray: $(RAY_STAMP)
	RAY_USAGE_STATS_ENABLED=0 $(RAY_BIN)/python -m pytest -q tests/training/cluster

stress: $(STAMP)
	$(BIN)/python -m pytest -q --hypothesis-profile=stress

bench: $(STAMP)
	$(BIN)/python -m pip install --quiet -c constraints.txt -e ".[bench]"
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
