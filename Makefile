.DEFAULT_GOAL := help
.PHONY: help setup demo demo-library paper test test-thorough lint lint-types \
        lint-style docs bench clean

# The interpreter for .venv; a finished .venv stays as it is unless PYTHON is given.
ifeq ($(origin PYTHON),undefined)
PYTHON := python3
SETUP_FLAGS := --keep-python
endif

CODE := bench docs examples flex_planner launch test tools setup.py

help:
	@echo 'make demo     plan motions of a flexible arm through a ROS 2 node; results in output/'
	@echo '              (make demo ARM=spatial_3r: of an arm in space)'
	@echo 'make demo-library   plan and draw the same motion with the library alone, without ROS 2'
	@echo 'make paper    recompute Korayem et al. 2009 and write docs/paper.md (1 to 3 minutes)'
	@echo 'make test     check the style, run all unit tests and a node test of each kind (12 to 20 minutes)'
	@echo 'make test-thorough   run the other tests: long plans, every node test, every example'
	@echo 'make setup    only create .venv and build into install/'
	@echo 'make lint     only check the style'
	@echo 'make docs     build the documentation as a site, into docs/_build/html (1 minute)'
	@echo 'make bench    measure, and write docs/benchmarks.md (some minutes, on an idle machine)'
	@echo 'make clean    remove everything that these targets made'
	@echo
	@echo 'Each sets up what it needs. PYTHON=python3.12 picks the interpreter (3.10 to 3.13).'
	@echo 'tools/run COMMAND runs a command in the environment.'

setup:
	@$(PYTHON) tools/setup_environment.py $(SETUP_FLAGS)

demo: setup
	@tools/run python -m flex_planner.cli.demo $(if $(ARM),--arm '$(ARM)')

demo-library:
	@$(PYTHON) tools/setup_environment.py --library $(SETUP_FLAGS)
	@PYTHONPATH= .venv-library/bin/python -m flex_planner.cli plan korayem_ei50 --from 0.5,0 --to 0.5,0.5 \
		--duration 1 --payload 1 --effort-weights 0.125,0.125 --search fast

paper: setup
	@tools/run flex-planner paper --output docs

test: lint
	$(call run_tests,not thorough)

test-thorough: setup
	$(call run_tests,thorough)

# where the tests are that start other processes; to read the files of all others would take long
ALONE := test/ros test/system

# run_tests MARKS: first what runs beside any number of others, then what starts processes of
# its own, two files at a time; the second also if the first fails. In the order of the files: one
# that is long but a single test would otherwise come last, by itself.
define run_tests
@failed=0; \
tools/run python -m pytest -n auto --dist loadfile --no-loadscope-reorder -m '$(1) and not alone' || failed=1; \
tools/run python -m pytest -n 2 --dist loadfile --no-loadscope-reorder $(ALONE) \
	-m '$(1) and alone' || failed=1; \
exit $$failed
endef

lint: setup
	@$(MAKE) --no-print-directory -j2 lint-types lint-style

lint-types:
	tools/run mypy

lint-style:
	tools/run ruff check
	tools/run codespell
	@mkdir -p log
	@tools/run ament_flake8 $(CODE) >log/lint.txt || { cat log/lint.txt; exit 1; }
	@tools/run ament_pep257 $(CODE) >log/lint.txt

docs: setup
	tools/run python -m sphinx --builder html --fail-on-warning --keep-going --quiet \
		--jobs auto docs docs/_build/html
	@echo 'docs/_build/html/index.html'

bench: setup
	@tools/run pip install -q -r bench/requirements.txt
	tools/run python -m bench

clean:
	rm -rf .venv .venv-library build install log output docs/_build docs/generated \
		.mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
