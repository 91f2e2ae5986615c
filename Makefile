# fingerslip: `make study` recomputes the paper's Table 2, `make test` runs the tests. `make help` lists the rest.
# Everything runs in .venv, made from requirements.lock; uv makes it where it is installed, venv and pip elsewhere.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
SUPPORTED := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))

# What other processors compute with: kernels of OpenBLAS and MKL; NumPy and Numba without the newest instructions.
PROCESSORS := OPENBLAS_CORETYPE=Haswell OPENBLAS_CORETYPE=Sandybridge,MKL_CBWR=COMPATIBLE OPENBLAS_CORETYPE=SkylakeX
UNUSED := X86_V4 AVX512_ICL AVX512_SPR
MARKS ?= not slow
# Modules are compiled once and not by every process, also where the environment asks for nothing to be written.
export PYTHONDONTWRITEBYTECODE :=

# The oldest libraries that pyproject.toml allows, on the oldest Python; what newer ones call outdated is no mistake there.
OLDEST := .venv-oldest
EXTRAS := pardiso,vision,export,neural,detect,sensitivity,fit,cluster,web,gym,dev
OUTDATED := -W ignore::DeprecationWarning -W ignore::PendingDeprecationWarning -W ignore::FutureWarning

.PHONY: help study test test-all test-processors test-oldest lint format docs bench validate reference lock libraries clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 17

study: $(READY)  ## recompute Table 2 of Wang et al. 2014 and write its report
	$(BIN)/fingerslip run studies/wang2014_table2.yaml

test: $(READY)  ## run the fast tests
	$(BIN)/pytest -n 2 --dist worksteal

test-all: $(READY)  ## run all tests, the slow ones too
	$(BIN)/pytest -n 2 --dist worksteal -m ""

test-processors: $(READY)  ## run the tests as other processors do (MARKS= for the slow ones, too)
	@for settings in $(PROCESSORS); do \
		settings=$$(echo "$$settings" | tr , ' '); echo "== $$settings"; \
		env NPY_DISABLE_CPU_FEATURES="$(UNUSED)" NUMBA_CACHE_DIR=$(CURDIR)/.numba/generic NUMBA_CPU_NAME=generic $$settings \
			$(BIN)/pytest -q -n 2 --dist worksteal -m "$(MARKS)" || exit 1; \
	done

test-oldest:  ## run the tests on the oldest libraries that are allowed (needs uv; MARKS= for the slow ones, too)
	uv venv --quiet --clear --python 3.11 $(OLDEST)
	uv pip install --quiet --python $(OLDEST)/bin/python --resolution lowest-direct -e ".[$(EXTRAS)]"
	env NUMBA_CACHE_DIR=$(CURDIR)/.numba/oldest $(OLDEST)/bin/pytest -n 2 --dist worksteal -m "$(MARKS)" $(OUTDATED)

lint: $(READY)  ## check style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(READY)  ## format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(READY)  ## build the documentation into docs/_build/html
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html

bench: $(READY)  ## measure all figures of speed
	$(BIN)/python tests/benchmarks/bench.py

validate: $(READY)  ## compare with the published numbers
	$(BIN)/fingerslip validate

reference: $(READY)  ## make again what the documentation takes from runs (half an hour)
	$(BIN)/python docs/figures/make_reference.py

lock:  ## renew requirements.lock (needs uv)
	uv pip compile --upgrade --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate \
		--no-header --extra pardiso --extra vision --extra export --extra neural --extra detect --extra sensitivity --extra fit --extra cluster --extra web --extra gym --extra dev --extra docs pyproject.toml -o requirements.lock

libraries:  ## check the system libraries that Gmsh and VTK load
	$(PYTHON) src/fingerslip/installation.py

clean:  ## remove the environment and everything that was built
	rm -rf $(VENV) $(OLDEST) .numba docs/_build docs/api/generated .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c '$(SUPPORTED)' || { \
		echo "fingerslip needs Python 3.11, 3.12 or 3.13; $(PYTHON) is $$($(PYTHON) --version 2>&1)." \
			"Name another: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 2; }
	@$(PYTHON) src/fingerslip/installation.py
	@if command -v uv >/dev/null 2>&1; then \
		echo "Making $(VENV) with uv ..."; \
		uv venv --quiet --clear --python "$$($(PYTHON) -c 'import sys; print(sys.executable)')" $(VENV) && \
		uv pip install --quiet --python $(BIN)/python --require-hashes -r requirements.lock && \
		uv pip install --quiet --python $(BIN)/python --no-deps --no-build-isolation -e .; \
	else \
		echo "Making $(VENV) with venv and pip (a minute or two) ..."; \
		{ $(PYTHON) -m venv --clear $(VENV) || { \
			echo "Python's venv module is missing; on Debian and Ubuntu: sudo apt-get install python3-venv" >&2; exit 2; }; } && \
		$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock && \
		$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .; \
	fi
	@touch $@
