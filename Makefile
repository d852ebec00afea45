# Each target does its own set-up: a virtual environment in the checkout, versions pinned.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PEERS := .venv-peers
ROS := .venv-ros
PIP := PIP_CONSTRAINT=constraints.txt PIP_DISABLE_PIP_VERSION_CHECK=1 $(BIN)/python -m pip install --quiet --no-compile
# Byte code of what is installed, on all cores, which pip makes on one; half of it would be tests and
# dialects that nothing here loads. Some packages hold files of other Pythons.
BYTE_CODE := -$(BIN)/python -m compileall -qq -j 0 -x '/tests?/|/dialects/' $(VENV)/lib
EXTRAS := adsb,dask,foxglove,lidar,map,mavlink,ouster,parquet,plants,ros2,ulog,docs,dev

# The compiled loops, where they are not as their sources.
CORE := $(BIN)/python -m clearway_build

# Byte code is kept whatever the machine says elsewhere: hundreds of short processes read it again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo core test lint types imports unit realtime nightly ros sanitized docs addresses pictures fuzz bench ratios bench-peers bench-filters wheel format clean

demo: $(VENV)/.core
	$(BIN)/clearway fly copter-columns --out clearway-out/demo

core: $(VENV)/.core
	$(CORE)

test: lint types imports realtime unit

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.dev
	$(BIN)/mypy

imports: $(VENV)/.dev
	$(BIN)/lint-imports

unit: $(VENV)/.dev
	$(CORE)
	$(BIN)/pytest -n 2 --dist loadfile -m 'not nightly and not realtime'

# Processes that meet in real time, three tests at a time: they mostly wait, and beside more they would
# come too late. A machine that stalls makes one late all the same: what failed must pass when it runs
# once more, alone. Other files would take longer to load than the tests of many of them.
REALTIME = $(BIN)/pytest -m 'realtime and not nightly' $$(grep -rl --include='test_*.py' mark.realtime tests)
realtime: $(VENV)/.dev
	$(CORE)
	$(REALTIME) -n 3 --dist worksteal || { echo 'warning: real-time tests failed and are run once more'; \
		$(REALTIME) --last-failed --last-failed-no-failures none; }

# What takes too long for every change: wider families, longer laws.
nightly: $(VENV)/.dev
	$(CORE)
	-$(MAKE) ros
	CLEARWAY_ROS_PYTHON=$$(ls -d $(CURDIR)/$(ROS)/*/bin/python 2> /dev/null | paste -sd:) \
		$(BIN)/pytest -n 2 --dist loadfile -m nightly

# Real ROS 2 of two distributions, without its command line; x86-64 alone has wheels.
ros: $(ROS)/kilted/.ready $(ROS)/jazzy/.ready

# The core with every index checked, under the sanitizers of g++: the loops' tests, then damaged files
# of every format: make sanitized COUNT=20000
COUNT ?= 5000
sanitized: $(VENV)/.dev
	$(BIN)/python -m tools.sanitized --count $(COUNT)

# The site of the documentation, in site/: any warning ends it.
docs: $(VENV)/.docs
	$(BIN)/mkdocs build --quiet

# The project's addresses, from pyproject.toml to where else they stand.
addresses: $(VENV)/.core
	$(BIN)/python -m tools.addresses --write

# Every picture of every command, on one page: clearway-out/pictures/index.html
pictures: $(VENV)/.dev
	$(BIN)/python -m tools.contact_sheet

$(VENV)/.docs: $(VENV)/.core
	$(PIP) --editable '.[docs]'
	touch $@

# Damaged files of every format through the commands: make fuzz MINUTES=5 SEED=1
MINUTES ?= 5
SEED ?= 1
fuzz: $(VENV)/.dev
	$(BIN)/python -m tools.fuzz --minutes $(MINUTES) --seed $(SEED)

bench: $(VENV)/.dev
	$(BIN)/python -m benchmarks

# What has become slower, by ratios to references beside it; warns, and fails nothing.
ratios: $(VENV)/.dev
	$(BIN)/python -m benchmarks.ratios

bench-peers: $(VENV)/.dev $(PEERS)/.ready
	$(BIN)/python -m benchmarks.peers --python $(PEERS)/bin/python
	$(BIN)/python -m benchmarks.peers.speed --python $(PEERS)/bin/python

# The guardian beside other safety filters; goes on where it was stopped.
bench-filters: $(VENV)/.dev $(PEERS)/.ready
	$(BIN)/python -m benchmarks.filters --python $(PEERS)/bin/python --docs docs/results/filters.md

# The source distribution and wheels for any Linux from 2014 on, by the compiler from PyPI.
wheel: $(VENV)/.dev
	CLEARWAY_TARGET=x86_64 $(BIN)/python -m build
	CLEARWAY_TARGET=aarch64 $(BIN)/python -m build --wheel

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

# What a flight needs, and no more; pip builds the core in an environment of its own.
$(VENV)/.core: pyproject.toml constraints.txt hatch_build.py | $(BIN)/python
	$(PIP) --editable .
	touch $@

# Other people's programs, never installed beside ours.
$(PEERS)/.ready: benchmarks/peers/constraints.txt
	test -x $(PEERS)/bin/python || $(PYTHON) -m venv $(PEERS)
	PIP_CONSTRAINT=benchmarks/peers/constraints.txt PIP_DISABLE_PIP_VERSION_CHECK=1 \
		$(PEERS)/bin/python -m pip install --quiet bluesky-simulator cbfpy pyoctomap pyrvo run-time-assurance
	touch $@

# By `make -j2` the core is compiled while the packages are fetched. Where no compiler is found, pip
# brings one.
$(VENV)/.numpy: constraints.txt | $(BIN)/python
	$(PIP) numpy
	touch $@

$(VENV)/.compiled: hatch_build.py $(VENV)/.numpy
	-PYTHONPATH=src $(CORE)
	touch $@

$(VENV)/.packages: pyproject.toml $(VENV)/.numpy
	$(BIN)/python -m tools.requirements $(EXTRAS) | $(PIP) --requirement /dev/stdin
	$(BYTE_CODE)
	touch $@

$(VENV)/.dev: $(VENV)/.compiled $(VENV)/.packages
	$(PIP) --no-deps --editable .
	touch $(VENV)/.core $(VENV)/.docs $@

# Beside rclpy it finds what is installed for clearway.
$(ROS)/%/.ready: tests/ros2/constraints-%.txt $(VENV)/.dev
	test -x $(ROS)/$*/bin/python || $(PYTHON) -m venv $(ROS)/$*
	PIP_CONSTRAINT=$< PIP_DISABLE_PIP_VERSION_CHECK=1 $(ROS)/$*/bin/python -m pip install --quiet \
		ros-$*-rclpy ros-$*-common-interfaces ros-$*-rmw-fastrtps-cpp \
		colcon-core colcon-ros colcon-python-setup-py
	$(BIN)/python -c "import site; print(site.getsitepackages()[0])" > \
		$$($(ROS)/$*/bin/python -c "import site; print(site.getsitepackages()[0])")/zz_clearway.pth
	touch $@

clean:
	rm -rf $(VENV) $(PEERS) $(ROS) build clearway-out dist site src/clearway/base/_core.* \
		.mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
