# Everything rests on `install`, which makes .venv from the hashed lock file; needs python3 (3.11 or later), venv, make, pip.
PYTHON ?= python3
BIN := .venv/bin
SITE := $(BIN)/sphinx-build --quiet --fail-on-warning --keep-going --doctree-dir out/doctrees docs out/site

.PHONY: demo test install docs models identify paper lock turbulence airspeed variance promise notebook verdict laws bench tuned_gains planted blind peers fuzz adopt-all adopted clean

demo: install  ## fly the main job: the paper's case, two laws, three aircraft
	$(BIN)/harness demo --out out/demo

test: install  ## everything CI checks
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest -n auto --dist loadfile

docs: install  ## the documents as a site, offline, warnings as errors: out/site/index.html
	$(SITE)

install: .venv/installed  ## .venv with .venv/bin/harness

.venv/installed: requirements.lock pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

models: install  ## write the JSBSim models from the airframes' data
	$(BIN)/python -m aircraft.write_models

identify: install  ## fly and fit the airframes anew: aircraft/*/identified.toml
	for name in ultra_stick_25e skywalker_x8 aerosonde; do $(BIN)/harness identify $$name --keep || exit 1; done

paper: install  ## the paper's numbers, figures and claims under docs/answers, on the airframes too (a quarter of an hour)
	$(BIN)/harness reproduce --out docs/answers --sixdof
	$(BIN)/python -m harness.studies.fitted

turbulence: install  ## fly the airframes in turbulence: docs/answers/turbulence.md (five minutes on two processors)
	$(BIN)/harness run experiments/turbulence.toml --out out/turbulence/moderate --log none
	$(BIN)/harness run experiments/turbulence.toml --out out/turbulence/unturned --log none --set wind.rotation=false --limit 60
	$(BIN)/harness run experiments/turbulence.toml --out out/turbulence/severe --log none --set wind.turbulence=severe --limit 90
	$(BIN)/harness run experiments/turbulence.toml --out out/turbulence/light --log none --set wind.turbulence=light --limit 60
	$(BIN)/python -m harness.studies.turbulence out/turbulence/light out/turbulence/moderate out/turbulence/unturned out/turbulence/severe

airspeed: install  ## which airspeed a law should compute with: docs/answers/airspeed.md (two minutes)
	$(BIN)/harness run experiments/airspeed.toml --out out/airspeed --log none
	$(BIN)/python -m harness.studies.airspeed out/airspeed

variance: install  ## what cheaper plants save of 6-DOF flights: docs/answers/variance_reduction.md (ten minutes on two processors)
	$(BIN)/harness run experiments/monte_carlo.toml --out out/variance --log none --set 'plant=["kinematic","lagged","coordinated"]' --set 'seed={start=0,count=320}'
	$(BIN)/harness run experiments/monte_carlo.toml --out out/variance --log none --set plant=sixdof --set 'seed={start=0,count=100}'
	$(BIN)/python -m harness.studies.variance_reduction out/variance

promise: install  ## fly the laws that know the inner loop: docs/answers/promise.md (two minutes)
	$(BIN)/python -m harness.studies.promise

notebook: install  ## execute docs/guide/notebook.ipynb anew: its outputs are what it says
	$(BIN)/python docs/execute_notebook.py docs/guide/notebook.ipynb

verdict: install  ## fly the full matrix (half an hour on two processors), and write the answer
	$(BIN)/harness run experiments/assumption.toml --out out/assumption --log none
	$(BIN)/harness report out/assumption
	$(BIN)/harness run experiments/quiet_gains.toml --out out/quiet_gains --log none
	$(BIN)/python -m harness.studies.does_it_hold out/assumption out/quiet_gains --readme README.md --rows tests

laws: install  ## fly every law in every air (ten minutes on two processors): docs/answers/floor.md, which_law.md
	$(BIN)/python -m harness.studies.floor
	$(BIN)/harness run experiments/laws.toml --out out/laws --log none
	$(BIN)/python -m harness.studies.which_law out/laws

adopt-all: install  ## adopt every model that comes with JSBSim: docs/answers/adopted_models.md (a quarter of an hour)
	$(BIN)/python -m harness.studies.adopted_models

adopted: install  ## the law on three adopted aircraft and our own: docs/answers/adopted_law.md, design_rule.md (three minutes)
	for name in c172p T38 dr1; do $(BIN)/harness adopt $$name --out out/adopted || exit 1; done
	$(BIN)/python -m harness.studies.adopted_law experiments/adopted.toml
	$(BIN)/python -m harness.studies.design_rule

bench: install  ## the speed of the loop, as ratios in one run, of the laws, of --help, of recordings
	$(BIN)/python -m benchmarks.flight_speed
	$(BIN)/python -m benchmarks.performance
	$(BIN)/python -m benchmarks.law_speed
	$(BIN)/python -m benchmarks.help_speed
	$(BIN)/python -m benchmarks.recording_speed
	$(BIN)/python -m benchmarks.runs
	$(BIN)/python -m benchmarks.maps
	$(BIN)/python -m benchmarks.compiled

tuned_gains: install  ## whether tune finds the gains of a fine grid: docs/answers/tuned_gains.md (a quarter of an hour)
	$(BIN)/python -m benchmarks.tuned_gains

planted: install  ## what falsify finds of planted failures: docs/answers/planted_failures.md (a few minutes)
	$(BIN)/python -m benchmarks.planted_failures

blind: install  ## what assess recovers of logs with hidden wind, scale, age and signs: docs/answers/blind_logs.md (minutes)
	$(BIN)/python -m benchmarks.blind_logs

peers: install  ## other simulators beside bare JSBSim, which pip fetches: docs/answers/other_simulators.md (ten minutes)
	$(BIN)/python -m benchmarks.peers --install

fuzz: install  ## the command line with 2000 inputs that nobody meant, at random (a quarter of an hour)
	FUZZ=2000 $(BIN)/pytest tests/test_fuzz.py

lock:  ## resolve the dependencies, keeping the pins that still serve (needs uv); UPGRADE=--upgrade moves them all
	uv pip compile pyproject.toml --extra dev --generate-hashes --universal --python-version 3.11 \
		--custom-compile-command "make lock" --output-file requirements.lock --quiet $(UPGRADE)

clean:
	rm -rf .venv out
