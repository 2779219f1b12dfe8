# Two commands for a stranger: `make demo` and `make test`. Needs Python 3.11 or later, make and pip; no root.
# PYTHON chooses the interpreter of a new .venv:  make demo PYTHON=python3.12
PYTHON ?= python3
OUT ?= out
WORKERS ?= 2

BIN := .venv/bin
STAMP := .venv/installed
# With the training libraries, which the tests need beside the rest; torch is large, the demo does without it.
TRAIN_STAMP := .venv/installed-train
# With all extras, and the readers that exported policies are checked with; without them those tests are skipped.
ALL_STAMP := .venv/installed-all
# The lower bound in pyproject.toml.
OLDEST_GYMNASIUM := 1.2.0

.PHONY: help demo test test-slow test-oldest test-rllib fuzz bench bench-peers lint format docs clean

help:
	@echo "make demo   the paper's four scenarios, then baselines and learned policies: figures, tables, film, into $(OUT)"
	@echo "            (two minutes on two idle cores; the first time some more, for installing and compiling)"
	@echo "make test   the tests (less than six minutes on two idle cores; the first time some more)"
	@echo "make test-slow  those that take longest, and those that need ONNX and Ray"
	@echo "make test-oldest  those of the environment with Gymnasium $(OLDEST_GYMNASIUM), the oldest allowed"
	@echo "make test-rllib  a training step of RLlib"
	@echo "make fuzz   10,000 damaged files to each reader of files; the count at the end (half an hour on two idle cores)"
	@echo "make bench  speed and growth, as tables and CSV files, into $(OUT)/bench"
	@echo "make bench-peers  time Exudyn, MuJoCo and MyoSuite in the same way; \`make bench\` prints ratios to them"
	@echo "make lint   ruff and mypy"
	@echo "make format rewrite the sources in the project's layout"
	@echo "make docs   generate docs/model-files.md, the scenarios and the picture of the README"
	@echo "make clean  remove .venv, out, build products and compiled kernels"
	@echo "Variables: PYTHON=$(PYTHON) makes .venv, OUT=$(OUT) takes results, WORKERS=$(WORKERS) run tests side by side"

# Made again when it is missing or when the dependencies change.
$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "$(PYTHON) is $$($(PYTHON) --version); Python 3.11 or later is needed: make ... PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[pictures,dev]"
	@touch $@

$(TRAIN_STAMP): $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[pictures,dev,train]"
	@touch $@

$(ALL_STAMP): $(TRAIN_STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt \
	    -e ".[pictures,dev,train,export,sweep]" onnxruntime safetensors
	@touch $@

demo: $(STAMP)
	$(BIN)/python -m exo_env scenarios --out $(OUT)/scenarios
	$(BIN)/python -m agents evaluate --policy pid none pid_yielding pid_compensated assist_as_needed learned \
	    --patients 20 --out $(OUT)/evaluation
	$(BIN)/python -m agents report $(OUT)/evaluation --policies pid learned --out $(OUT)/report
	$(BIN)/python -m agents evaluate --env exo/HiddenIntent-v0 --policy none learned \
	    --population evaluation --patients 20 --seed 1 --out $(OUT)/intent
	$(BIN)/python -m agents video --env exo/HiddenIntent-v0 --policy none learned oracle --patient stroke_severe --seed 3 \
	    --out $(OUT)/intent.mp4 --overwrite
	@echo "In $(abspath $(OUT)): figures of the paper in scenarios, tables and figures of the policies in report/report.md,"
	@echo "all measures of 20 patients in evaluation and, where the plan is hidden, in intent; a severe patient alone, with"
	@echo "the learned policy and with one that knows the plan in intent.mp4"

test: $(TRAIN_STAMP)
	$(BIN)/python -m pytest -n $(WORKERS) -m "not slow"

test-slow: $(ALL_STAMP)
	$(BIN)/python -m pytest -n $(WORKERS) -m slow
	$(BIN)/python -m pytest -n $(WORKERS) -m "not slow" tests/agents/export tests/agents/distributed/test_sweep.py

test-oldest: $(TRAIN_STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --upgrade --target .venv/oldest \
	    gymnasium==$(OLDEST_GYMNASIUM)
	PYTHONPATH=$(CURDIR)/.venv/oldest $(BIN)/python -m pytest -n $(WORKERS) tests/exo_env/envs tests/exo_env/world tests/exo_env/rendering

# RLlib pins another Gymnasium than the newest: an environment of its own.
test-rllib:
	$(PYTHON) -m venv .venv/rllib
	.venv/rllib/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt \
	    -e . "ray[rllib]" torch pytest pytest-xdist
	.venv/rllib/bin/python -m pytest tests/agents/distributed/test_rllib.py

fuzz: $(TRAIN_STAMP)
	EXO_FUZZ=deep $(BIN)/python -m pytest -v -n $(WORKERS) tests/fuzz

# One thread each: numerical libraries must not take cores that a table does not tell of. Fifteen minutes in all.
BENCH := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python tests/benchmarks
BENCH_OUT := $(OUT)/bench

bench: $(TRAIN_STAMP)
	$(BENCH)/bench.py --peers $(BENCH_OUT)/peers.json --out $(BENCH_OUT)/core.csv
	$(BENCH)/env_speed.py --peers $(BENCH_OUT)/peers.json --out $(BENCH_OUT)/env_speed.csv
	$(BENCH)/growth.py --out $(BENCH_OUT)/growth.csv
	$(BENCH)/train_speed.py --out $(BENCH_OUT)/train_speed.csv
	$(BENCH)/work_precision.py --peers $(BENCH_OUT)/peers.json --out $(BENCH_OUT)

# The other programs, in environments of their own; `make bench` then prints ratios to what was measured here.
PEERS := tests/benchmarks/peers

.venv-peers/%/installed: $(PEERS)/requirements-%.txt
	mkdir -p .venv-peers
	@echo '*' > .venv-peers/.gitignore
	$(PYTHON) -m venv $(@D)
	$(@D)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r $<
	@touch $@

bench-peers: .venv-peers/myo/installed .venv-peers/exu/installed
	$(PYTHON) $(PEERS)/run.py --venvs .venv-peers --out $(BENCH_OUT)/peers.json

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(STAMP)
	$(BIN)/python -m dms_core schema --out docs/model-files.md --overwrite
	$(BIN)/python -m exo_env scenarios --out $(OUT)/scenarios
	cp $(OUT)/scenarios/fig12_joint_moments.png docs/scenarios.png
	$(BIN)/python -m agents picture --policy none mean_angle learned oracle --patient stroke_severe --seed 3 \
	    --out docs/hidden-intent.png --overwrite

clean:
	rm -rf .venv .venv-peers out build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
