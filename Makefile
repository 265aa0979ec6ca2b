# Set-up, checks and the main job. `make run` and `make test` need Python 3.11 or later with its venv module, and make.
# Each step of the set-up leaves a stamp when it has succeeded, so that a second call skips it and an interrupted one repeats it.

VENV := .venv
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.DELETE_ON_ERROR:
.PHONY: help run test test-all lint docs notebooks lock audit clean

help:
	@echo "make run    set up and fit the embedded example"
	@echo "make test   set up and run the tests that a change has to pass"
	@echo "make test-all  the same with every search, the notebooks at full size, and the benchmarks' own tests"
	@echo "make lint   style and types"
	@echo "make docs   the documentation site, built strictly into site/"
	@echo "make notebooks  run every notebook at full size and write its .ipynb"
	@echo "make lock   write requirements*.lock anew; UPGRADE=1 takes the newest versions"
	@echo "make audit  known vulnerabilities of the versions in requirements.lock, as pypi.org states them"
	@echo "make clean  remove everything that can be made again"

run: $(VENV)/.stamp-run
	$(BIN)/fit-parameters

PYTEST := $(BIN)/python -m pytest --numprocesses logical --maxprocesses 4 --dist loadfile --no-loadscope-reorder

# What runs with array types checked (`tests/conftest.py`), each test once: three diagnoses from records to files, a fit, the readers, studies,
# every effect and every law. All other tests are traced faster without.
CHECKED := tests/identification/diagnosis/test_diagnose.py tests/identification/commands tests/identification/experiment \
	tests/studies/test_studies.py tests/effects tests/contact tests/suspension tests/excitation tests/test_type_checking.py

test: $(VENV)/.stamp-test
	JAXTYPING_DISABLE=1 $(PYTEST) -m "not thorough" --ignore tests/benchmarks $(CHECKED:%=--ignore %)
	$(PYTEST) -m "not thorough" $(CHECKED)

test-all: $(VENV)/.stamp-test
	$(PYTEST)

lint: $(VENV)/.stamp-test
	$(BIN)/python -m ruff check .
	$(BIN)/python -m pyright

docs: $(VENV)/.stamp-test
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

notebooks: $(VENV)/.stamp-test
	$(BIN)/python notebooks/builder

# The exact versions of the lock, checked by hash; then the project itself, built with the lock's hatchling.
define install
	$(BIN)/python -m pip install --quiet --require-hashes --requirement $<
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@
endef

$(VENV)/.stamp-run: requirements.lock pyproject.toml $(VENV)/.stamp-venv
	@echo "installing the versions of $< into $(VENV)"
	$(install)

$(VENV)/.stamp-test: requirements-test.lock pyproject.toml $(VENV)/.stamp-venv
	@echo "installing the versions of $< into $(VENV)"
	$(install)

# A usable environment (new enough, every file of pip there) is kept; any other is made again. PYTHON chooses the interpreter.
IS_USABLE = import sys; from importlib.metadata import files; \
	sys.exit(sys.version_info < (3, 11) or not all(f.locate().exists() for f in files("pip") if f.suffix == ".py"))

$(VENV)/.stamp-venv:
	@if ! $(BIN)/python -c '$(IS_USABLE)' 2>/dev/null; then \
		for python in $(or $(PYTHON),python3 python3.11 python3.12 python3.13 python3.14); do \
			if $$python -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
				echo "creating $(VENV) with $$python"; \
				$$python -m venv --clear $(VENV) || exit 1; \
				touch $@; \
				exit 0; \
			fi; \
		done; \
		echo "error: Python 3.11 or later with venv is needed (Debian, Ubuntu: apt install python3 python3-venv);" \
			"choose another interpreter with make PYTHON=..." >&2; \
		exit 1; \
	fi; \
	touch $@

COMPILE = build/lock/bin/uv pip compile pyproject.toml --quiet --universal --python-version 3.11 --generate-hashes \
	--group build --custom-compile-command "make lock" $(if $(UPGRADE),--upgrade)

lock: $(VENV)/.stamp-venv
	$(BIN)/python -m venv build/lock
	build/lock/bin/python -m pip install --quiet uv
	$(COMPILE) --output-file requirements.lock
	$(COMPILE) --extra test --extra dev --extra docs --extra notebooks --constraint requirements.lock --output-file requirements-test.lock

# Strict: a package of which nothing can be learned, as without a network, is an error.
audit: $(VENV)/.stamp-venv
	$(BIN)/python -m venv build/audit
	build/audit/bin/python -m pip install --quiet pip-audit
	build/audit/bin/pip-audit --strict --disable-pip --require-hashes --requirement requirements.lock

clean:
	rm -rf $(VENV) build dist site .pytest_cache .ruff_cache .hypothesis
