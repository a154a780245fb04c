# Each target sets up what it needs in .venv, the first time and every time.
.PHONY: help setup setup-demo setup-play build build-demo build-play demo play test lint docs bench faults figures study report clean
PYTHON ?= python3
export PYTHON
# A domain of its own, on this machine only: nothing here meets another ROS system.
export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST
RUN := scripts/ros_env

help:            ## Show the targets
	@grep -E '^[a-z]+: .*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 14

setup:           ## Make .venv with pinned requirements
	@scripts/setup

setup-demo:
	@scripts/setup demo

define COLCON
@[ -f ros2_ws/install/setup.bash ] || echo 'build: building ros2_ws with colcon (half a minute)'
@unset PYTHONPATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH; \
    . .venv/bin/activate && export AMENT_PREFIX_PATH="$$VIRTUAL_ENV" && cd ros2_ws && \
    colcon --log-level error build --event-handlers console_cohesion- >../.venv/colcon.log 2>&1 \
    || { cat ../.venv/colcon.log; exit 1; }
endef

build: setup     ## Build the ROS 2 workspace with colcon
	$(COLCON)

build-demo: setup-demo
	$(COLCON)

setup-play:
	@scripts/setup play

build-play: setup-play
	$(COLCON)

demo: build-demo ## Walk the simulated robot by words; writes out/demo/ (ROBOT=, ENGINE=)
	@$(RUN) python -m demo --out out/demo $(if $(ROBOT),--controller $(ROBOT)) \
	    $(if $(ENGINE),--engine $(ENGINE))

play: build-play ## Talk to a robot in the browser (ROBOT=, ENGINE=, HARDWARE=simulated, PORT=)
	@$(RUN) w2b play $(if $(ROBOT),--robot $(ROBOT)) $(if $(ENGINE),--engine $(ENGINE)) \
	    $(if $(HARDWARE),--hardware $(HARDWARE)) $(if $(PORT),--port $(PORT)) $(ARGS)

test: build      ## Run all tests: two at a time, then those against the clock one by one
	@$(RUN) python -m pytest -q -n 2 --dist loadfile -m 'not realtime'
	@$(RUN) python -m pytest -q -m realtime

lint: setup      ## Style and types
	@.venv/bin/ruff check .
	@.venv/bin/mypy

docs:            ## Build the documentation's site, strictly; writes out/site/
	@scripts/setup docs
	@NO_MKDOCS_2_WARNING=1 .venv/docs/bin/mkdocs build --quiet --strict && echo "docs: out/site/index.html"

bench: build     ## Measure the engines' speed and the robot's timing (ARGS=--json)
	@$(RUN) python scripts/bench $(ARGS)

faults: build    ## Table of fault scenarios: time to the safe outcome (ARGS=--json)
	@$(RUN) python -m tests.faults.report $(ARGS)

study: setup     ## Repeat the study (ARGS='CONFIG.yaml --out DIR'; takes a night)
	@.venv/bin/python -m training study $(ARGS)

report: setup    ## Tables and figures of a study (ARGS=DIR)
	@.venv/bin/python -m training report $(ARGS)

figures: build   ## Refresh the README's tables and pictures (ARGS=demo, engines, faults)
	@$(RUN) python scripts/figures $(ARGS)

clean:           ## Remove the ROS build, caches and out/demo; not .venv, not runs in out/
	rm -rf build w2b.egg-info ros2_ws/build ros2_ws/install ros2_ws/log out/demo
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . \( -path ./.venv -o -path ./.git -o -path ./out \) -prune -o -name __pycache__ -prune \
	    -exec rm -rf {} +
