# Two commands do everything on a fresh machine with Python 3.11 or newer:
#   make demo    install into .venv and run the main job end to end
#   make test    install into .venv, lint, and run the tests
# and more for those who want to know:
#   make bench         tune the kernels for this machine, measure speed and what accuracy costs
#   make soak          the long checks
#   make docs          the documentation, build/site/index.html
#   make dist          a wheel and an sdist, installed and tried in bare environments
#   make test-lowest   the tests with the oldest versions of every dependency that pyproject.toml allows
PYTHON ?= python3
BIN := .venv/bin

.PHONY: demo test test-lowest bench soak docs dist lint tree format kernels scans clean
.DEFAULT_GOAL := demo

demo: .venv/installed
	$(BIN)/clbrdf demo -o demo --overwrite

test: lint docs
	$(BIN)/python -m pytest -n auto --dist worksteal -m "not soak"

test-lowest: .venv/installed-dev
	rm -rf build/lowest
	$(BIN)/uv venv --quiet --python $(BIN)/python build/lowest
	$(BIN)/uv pip install --quiet --python build/lowest/bin/python --resolution lowest-direct --editable '.[test]'
	build/lowest/bin/python -m pytest -n auto -m "not soak"

docs: .venv/installed-dev
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs build/site

# Whoever installs has neither the tree nor what the developers have: each file goes into an environment of its own,
# and the tests run from the unpacked sdist.
dist: .venv/installed-dev
	rm -rf build/dist
	$(BIN)/python -m build --outdir build/dist . >build/dist.log 2>&1 || { tail -20 build/dist.log; exit 1; }
	mkdir build/dist/source && tar -xzf build/dist/*.tar.gz --strip-components=1 -C build/dist/source
	for file in build/dist/*.whl build/dist/*.tar.gz; do \
	    rm -rf build/dist/env && $(BIN)/python -m venv build/dist/env && \
	    build/dist/env/bin/python -m pip install --quiet "$$file" && \
	    build/dist/env/bin/clbrdf demo -o build/dist/demo --overwrite || exit; \
	done
	build/dist/env/bin/python -m pip install --quiet "$$(ls build/dist/*.whl)[test]"
	cd build/dist/source && rm -rf clbrdf && ../env/bin/python -m pytest -n auto -q -m "not soak" tests/cli tests/fit tests/scene tests/models

bench: .venv/installed-bench
	$(BIN)/clbrdf devices --tune
	$(BIN)/clbrdf bench throughput
	$(BIN)/clbrdf bench grids
	$(BIN)/clbrdf bench accuracy --png docs/pictures/accuracy.png --overwrite
	$(BIN)/clbrdf bench fit
	$(BIN)/clbrdf bench optimizers --png docs/pictures/optimizers.png --overwrite

soak: .venv/installed-dev build/oracles/installed build/comet/installed
	$(BIN)/python -m pytest -m soak --ignore=tests/oracles
	PYTHONPATH=build/oracles $(BIN)/python -m pytest -m soak tests/oracles

lint: .venv/installed-dev tree
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	cd build/tree && PYTHONPATH=. ../../$(BIN)/lint-imports --config ../../pyproject.toml --no-cache --no-logo
	cd build/tree && ../../$(BIN)/mypy --config-file ../../pyproject.toml --cache-dir ../mypy -p clbrdf

format: .venv/installed-dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The kernels that follow from the models' pages; wang2013's is written by hand.
kernels: .venv/installed
	$(BIN)/python -m clbrdf.models kernels/models

scans: .venv/installed
	for scene in scans/*.toml; do $(BIN)/clbrdf simulate $$scene -o $${scene%.toml}.h5 --overwrite || exit; done

clean:
	rm -rf .venv build demo *.egg-info

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "clbrdf needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1). Name another: make PYTHON=python3.12 ..." >&2; exit 2; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip

.venv/installed: pyproject.toml | .venv/bin/python
	@mkdir -p build
	$(BIN)/python -m pip install --editable . >build/install.log 2>&1 || { tail -20 build/install.log; exit 1; }
	touch $@

.venv/installed-dev: pyproject.toml | .venv/bin/python
	@mkdir -p build
	$(BIN)/python -m pip install --editable '.[dev]' >build/install.log 2>&1 || { tail -20 build/install.log; exit 1; }
	touch $@ .venv/installed

.venv/installed-bench: pyproject.toml | .venv/bin/python
	@mkdir -p build
	$(BIN)/python -m pip install --editable '.[peers]' >build/install.log 2>&1 || { tail -20 build/install.log; exit 1; }
	touch $@

# In a folder of their own: one of them installs the module mitsuba, which is also the name of another package.
# Where they cannot be installed, say so and go on: their tests are skipped.
build/oracles/installed: pyproject.toml | .venv/installed-dev
	rm -rf build/oracles && mkdir -p build/oracles
	$(BIN)/python -m pip install --target build/oracles $$($(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["oracles"])') >build/oracles.log 2>&1 && touch $@ || { rm -rf build/oracles; echo "soak: the oracles could not be installed (build/oracles.log); their tests are skipped" >&2; }

# The CoMET tools read our files in an environment of their own. Where they cannot be installed, say so and go on.
build/comet/installed: pyproject.toml | .venv/installed-dev
	rm -rf build/comet && mkdir -p build
	$(PYTHON) -m venv build/comet && build/comet/bin/python -m pip install $$($(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["comet"])') >build/comet.log 2>&1 && touch $@ || { rm -rf build/comet; echo "soak: obsarray could not be installed (build/comet.log); its test is skipped" >&2; }

# The mapped folders at their place inside the package, for the type checker and the import linter.
tree:
	rm -rf build/tree && mkdir -p build/tree/clbrdf
	ln -s "$(CURDIR)"/clbrdf/* build/tree/clbrdf/
	ln -s "$(CURDIR)"/clbrdf_start.py build/tree/
	for folder in kernels scans viz; do ln -s "$(CURDIR)/$$folder" build/tree/clbrdf/$$folder; done
