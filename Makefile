# Every target makes the environment it needs. `make help` lists them.
#
#   make TORCH_INDEX=https://... demo    takes torch from another package index (one of CPU builds, say)
#   make PYTHON=python3.12 test          makes the environment with another interpreter
#   make JOBS=8 test                     runs the tests in eight processes

PYTHON ?= python3
JOBS ?= 2
TORCH_INDEX ?=
SECONDS_PER_TEST ?= 600

VENV := .venv
RUN := $(VENV)/bin/python
READY := $(VENV)/.ready
OLDEST_GYMNASIUM := 1.2.2

# An environment is stale when what it was made from changed, or when it was made in another folder (an editable install
# and every script in it hold absolute paths).
ifneq ($(shell cat $(READY) 2>/dev/null),$(CURDIR))
.PHONY: $(READY)
endif

.DEFAULT_GOAL := help
.PHONY: help setup demo test verify gate report report-quick bench lint format types contracts pytest oldest-gymnasium \
	docs figures page build clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-18s%s\n", $$1, $$2 }' $(MAKEFILE_LIST)

$(READY): pyproject.toml constraints.txt Makefile
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "$(PYTHON) is older than 3.11; name a newer one: make PYTHON=python3.12 ..." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' \
		|| { echo "$(PYTHON) cannot make environments; on Debian: apt-get install python3-venv" >&2; exit 1; }
	@if [ "$$(cat $@ 2>/dev/null || echo '$(CURDIR)')" != '$(CURDIR)' ] || ! $(RUN) -c 'import pip' 2>/dev/null; \
		then $(PYTHON) -m venv --clear $(VENV); fi
	@echo 'Installing into $(VENV): torch and the rest, a few minutes ...'
	$(RUN) -m pip install --quiet -c constraints.txt $(if $(TORCH_INDEX),--index-url $(TORCH_INDEX)) torch
	$(RUN) -m pip install --quiet -c constraints.txt -e '.[train,render,viewer,dev]'
	@printf '%s' '$(CURDIR)' > $@

setup: $(READY)  ## make .venv and install everything the other targets need

demo: $(READY)  ## train a lander for at most four minutes; model, curve and picture go to runs/demo
	$(RUN) -m training.demo

test: lint types contracts pytest  ## lint, types, import contracts and the test suite

verify: $(READY) oldest-gymnasium  ## the long verification
	$(RUN) -m benchmarks.gate --quick --show-costs
	$(RUN) -m pytest -m verify -n $(JOBS) --timeout 1200

gate: $(READY)  ## errors, orders, verdicts and costs of the engine against the stored baseline; wants a quiet machine
	$(RUN) -m benchmarks.gate --quick

bench: $(READY)
	$(RUN) -m pip install --quiet -c constraints.txt -e '.[bench]'

report: bench  ## speed against error of every engine into docs/report; under an hour, goes on where it was stopped
	$(RUN) -m benchmarks.report

report-quick: bench  ## the same in minutes, with three step sizes and a third of the curves, into runs/report
	$(RUN) -m benchmarks.report --quick --fresh --out runs/report

lint: $(READY)  ## ruff
	$(RUN) -m ruff check
	$(RUN) -m ruff format --check

format: $(READY)  ## let ruff mend what it can
	$(RUN) -m ruff check --fix
	$(RUN) -m ruff format

types: $(READY)  ## mypy
	$(RUN) -m mypy

contracts: $(READY)  ## import-linter: the arrows between the layers point down
	$(RUN) -c "from importlinter.cli import lint_imports_command as check; check()" --no-cache --no-logo

pytest: $(READY)  ## the test suite alone
	$(VENV)/bin/avalanche-gym compile  # once, or every test process would wait for its own compilation
	$(RUN) -m pytest -n $(JOBS) --timeout $(SECONDS_PER_TEST)

oldest-gymnasium: $(READY)  ## the tests of the environments with the oldest Gymnasium we support
	$(RUN) -m pip install --quiet --upgrade --no-deps --target $(VENV)/oldest gymnasium==$(OLDEST_GYMNASIUM)
	PYTHONPATH=$(VENV)/oldest $(RUN) -m pytest tests/envs -n $(JOBS) --timeout $(SECONDS_PER_TEST)

docs: $(READY)  ## build the documentation into site/
	NO_MKDOCS_2_WARNING=1 $(RUN) -m mkdocs build

figures: $(READY)  ## the pictures of README and documentation, into docs/figures
	$(RUN) -m benchmarks.figures

page:  ## bundle the page of the viewer from its source (npm)
	npm --prefix avalanche_gym/viewer/page ci --no-audit --no-fund
	npm --prefix avalanche_gym/viewer/page run build

build: $(READY)  ## build wheel and sdist into dist/
	$(RUN) -m pip install --quiet build
	$(RUN) -m build

clean:  ## remove .venv, caches (compiled kernels too) and what the build made; runs/ stays
	rm -rf $(VENV) build dist site .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis .coverage htmlcov
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
