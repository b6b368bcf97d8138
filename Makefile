# make demo    run the double pendulum, leave double_pendulum.png
# make test    the tests
# Each makes its own virtual environment first; later runs only check that it is up to date.

VENV   ?= .venv
BIN    := $(VENV)/bin
# The newest Python from 3.11 on; `make PYTHON=/path/to/python3.12 test` chooses another.
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
            $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
MODEL  := examples/double_pendulum.mech
JOBS   ?= 2
EDITS  ?= 1000000
SPELT  := README.md ARCHITECTURE.md CONTRIBUTING.md CHANGELOG.md SECURITY.md docs mechc lang compiler runtime stdlib examples bench editors
MODELS ?= 1000

.PHONY: kernel demo test test-slow test-matrix fuzz fuzz-models check check-format check-lint check-spelling check-types check-floors format bench stability gallery docs fmu-gallery clean help
.DEFAULT_GOAL := help

help:
	@sed -n 's/^# \{0,1\}//p' Makefile | head -3
	@echo "make test-slow, make test-matrix, make fuzz EDITS=1000000, make fuzz-models MODELS=100000, make check, make format, make bench, make gallery, make docs, make stability, make fmu-gallery, make kernel, make clean"

$(VENV)/pyvenv.cfg:
	@test -n "$(PYTHON)" || { echo "mechc needs Python 3.11 or newer; none was found" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml | $(VENV)/pyvenv.cfg
	@echo "installing mechc with NumPy, SciPy, SymPy and Matplotlib: half a minute, and the time to fetch 100 MB"
	$(BIN)/python -m pip install --disable-pip-version-check -e .
	@touch $@

$(VENV)/installed-dev: pyproject.toml | $(VENV)/pyvenv.cfg
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@ $(VENV)/installed

$(VENV)/installed-docs: pyproject.toml | $(VENV)/pyvenv.cfg
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	@touch $@

demo: $(VENV)/installed
	$(BIN)/mechc run $(MODEL) --plot double_pendulum.png
	@echo "To see it move: $(BIN)/mechc view $(MODEL)"

test: $(VENV)/installed-dev
	$(BIN)/python -m pytest -q -n $(JOBS) --dist loadfile -m "not slow"

test-slow: $(VENV)/installed-dev
	$(BIN)/python -m pytest -q -n $(JOBS) -m "slow and not matrix"

test-matrix: $(VENV)/installed-dev
	$(BIN)/python -m pytest -q -n $(JOBS) -m matrix

fuzz: $(VENV)/installed-dev
	MECHC_EDITS=$(EDITS) $(BIN)/python -m pytest -q -n $(JOBS) -m slow tests/mechc/test_random_edits.py

fuzz-models: $(VENV)/installed-dev
	PYTHONPATH=tests/random_models:tests/oracle $(BIN)/python -m random_models.campaign $(MODELS) $(JOBS) $(MODE)

check: $(VENV)/installed-dev
	@$(MAKE) --no-print-directory --keep-going check-format check-lint check-spelling check-types check-floors

check-format:
	$(BIN)/ruff format --check .

check-lint:
	$(BIN)/ruff check .

check-spelling:
	$(BIN)/python -m codespell_lib $(SPELT)

check-types:
	$(BIN)/python .ci/linked.py $(BIN)/mypy

check-floors:
	$(BIN)/python .ci/linked.py $(BIN)/lint-imports

format: $(VENV)/installed-dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(VENV)/installed-dev
	$(BIN)/python -m bench

gallery: $(VENV)/installed
	$(BIN)/python docs/figures.py
	$(BIN)/python docs/moving.py
	$(BIN)/python docs/pictures.py

docs: $(VENV)/installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/python docs/website/build.py

fmu-gallery: $(VENV)/installed
	$(BIN)/python -m bench.fmu_gallery

# The kernels that pages hold, after a change of runtime/kernel or mechc/web/kernel
kernel: $(VENV)/installed-dev
	$(BIN)/python -m pip install --quiet "ziglang==$$($(BIN)/python -c 'from mechc.web.build_kernels import ZIG; print(ZIG)')"
	$(BIN)/python -m mechc.web.build_kernels $(KERNELS)

stability: $(VENV)/installed-dev
	$(BIN)/python -m bench.stability

clean:
	rm -rf build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
