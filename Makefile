# Cyclops: one eye on the tanker. `make help` lists the targets.
#
# One makefile, no recursion. VARIANT=release (default), debug, asan, ubsan, tsan or coverage; each builds in its own
# folder below build/, release in build/ itself.

VARIANT ?= release
MAKEFLAGS += --no-builtin-rules
SHELL := /bin/bash
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.SUFFIXES:

VERSION := $(shell cat VERSION 2>/dev/null || echo 0.0.0)
B := $(if $(filter release,$(VARIANT)),build,build/$(VARIANT))
GEN := build/gen
PREFIX ?= /usr/local

# --- what is needed from the system ------------------------------------------------------------------------------
# build/deps.mk is made by tools/deps.sh: it installs what is missing, then writes the compiler flags of each library.
# GNU make remakes it and starts over, so the first `make` on a fresh machine needs no second call.
QUIET_GOALS := help clean deps layers loc deps-extra
ifneq ($(filter-out $(QUIET_GOALS),$(or $(MAKECMDGOALS),help)),)
-include build/deps.mk
build/deps.mk: tools/deps.sh tools/packages.txt
	@tools/deps.sh $@
endif

# --- flags -------------------------------------------------------------------------------------------------------
CXX ?= g++
ARCH ?= $(if $(filter x86_64,$(shell uname -m)),x86-64-v3,native)
OPT_release  := -O3 -g1
OPT_debug    := -O0 -g
OPT_asan     := -O1 -g -fsanitize=address -fno-omit-frame-pointer
OPT_ubsan    := -O1 -g -fsanitize=undefined -fno-sanitize-recover=all
OPT_tsan     := -O1 -g -fsanitize=thread
OPT_coverage := -O1 -g --coverage -fprofile-update=atomic
WARN := -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Werror=return-type
# No fused multiply-add: every build of the same source gives the same bits. -ffp-contract=off alone is not enough, GCC 12 makes
# vfmsubadd of neighbouring operations. The corner kernel asks for fused ones by name (src/detect/lanes.hpp), so its folder may.
NO_FMA := -ffp-contract=off $(if $(filter x86_64,$(shell uname -m)),-mno-fma)
CXXFLAGS += -std=c++20 $(OPT_$(VARIANT)) -march=$(ARCH) $(NO_FMA) $(WARN) -pthread -DCYCLOPS_VERSION='"$(VERSION)"'
CPPFLAGS += -Isrc -I. -isystem $(GEN)/cpp $(DEPS_CFLAGS)
LDFLAGS += $(OPT_$(VARIANT)) -pthread -Wl,--as-needed
LDLIBS += $(DEPS_LIBS)

# --- sources: the path tells what a file becomes -----------------------------------------------------------------
#   src/**/*.cpp            libcyclops.a      src/service/cyclops_main.cpp   bin/cyclops
#   hil/**/*.cpp            libhil.a          {hil,tools}/NAME_main.cpp      bin/cyclops-NAME
#   test/<mirror>/*_test.cpp  unit tests      test/integration/*_test.cpp    tests in their own network namespace
#   test/gpio/*_test.cpp    on a real kernel's GPIO chip
#   test/bench/*_bench.cpp  bin/bench         test/fuzz/NAME_fuzz.cpp        bin/fuzz-NAME (clang)
MAINS     := $(wildcard src/service/*_main.cpp hil/*_main.cpp tools/*_main.cpp)
LIB_SRC   := $(filter-out %_main.cpp,$(shell find src -name '*.cpp'))
HIL_SRC   := $(filter-out %_main.cpp,$(shell find hil -name '*.cpp'))
TOOL_SRC  := $(filter-out %_main.cpp,$(wildcard tools/*.cpp))
UNIT_SRC  := $(filter-out test/integration/% test/gpio/% test/bench/% test/fuzz/%,$(shell find test -name '*_test.cpp'))
INTEG_SRC := $(wildcard test/integration/*_test.cpp)
GPIO_SRC  := $(wildcard test/gpio/*_test.cpp)
BENCH_SRC := test/bench/bench_main.cpp $(wildcard test/bench/*_bench.cpp)
FUZZ_SRC  := $(wildcard test/fuzz/*_fuzz.cpp)
LCM_SRC   := $(wildcard lcmtypes/*.lcm)
objects    = $(patsubst %.cpp,$(B)/obj/%.o,$(1))
program    = $(B)/bin/$(if $(filter src/service/cyclops_main.cpp,$(1)),cyclops,cyclops-$(patsubst %_main.cpp,%,$(notdir $(1))))
PROGRAMS  := $(foreach m,$(MAINS),$(call program,$(m)))
LIBS      := $(B)/lib/libtools.a $(B)/lib/libhil.a $(B)/lib/libcyclops.a

.PHONY: help deps deps-extra all types run check unit integration bench fuzz asan ubsan tsan coverage spy install layers loc clean

help: ## this list
	@echo "Cyclops $(VERSION): measured tanker features for navigation. Usual: make run, make check."
	@grep -hE '^[a-z][a-z-]*:.*##' Makefile | sed -E 's/^([a-z-]+):.*## /  \1|/' | column -t -s'|'

deps: ## install what is missing (Debian packages; needs root or sudo without a password)
	@tools/deps.sh build/deps.mk
deps-extra: ## packages for fuzzing, screenshots and benchmarks against peers
	@tools/deps.sh --extra

all: $(PROGRAMS) types ## build every program

# --- generated message types -------------------------------------------------------------------------------------
TYPES_STAMP := $(GEN)/stamp
$(TYPES_STAMP): $(LCM_SRC)
	@mkdir -p $(GEN)/cpp $(GEN)/python $(GEN)/java
	@lcm-gen -x --cpp-std=c++11 --cpp-hpath $(GEN)/cpp $(LCM_SRC)
	@lcm-gen -p --ppath $(GEN)/python $(LCM_SRC)
	@lcm-gen -j --jpath $(GEN)/java $(LCM_SRC)
	@touch $@
$(GEN)/cpp/cyclops/%.hpp: $(TYPES_STAMP) ;
$(GEN)/cyclops-types.jar: $(TYPES_STAMP)
	@echo "  jar $@"; mkdir -p $(GEN)/classes
	@javac -nowarn -Xlint:none -cp $(LCM_JAR) -d $(GEN)/classes $(GEN)/java/cyclops/*.java
	@jar cf $@ -C $(GEN)/classes .
types: $(GEN)/cyclops-types.jar ## C++, Python and Java message types, and the jar for lcm-spy

# --- compiling ---------------------------------------------------------------------------------------------------
KERNEL_FMA := -ffp-contract=off
$(B)/obj/src/detect/%.o: NO_FMA := $(KERNEL_FMA)
# Objects depend on the command that makes them, not on this file.
FLAGS := $(B)/flags
ifneq ($(file <$(FLAGS)),$(CXX) $(CPPFLAGS) $(CXXFLAGS) $(KERNEL_FMA))
.PHONY: $(FLAGS)
endif
$(FLAGS):
	@mkdir -p $(@D); printf '%s' '$(subst ','\'',$(CXX) $(CPPFLAGS) $(CXXFLAGS) $(KERNEL_FMA))' >$@
$(B)/obj/%.o: %.cpp $(FLAGS) | $(TYPES_STAMP)
	@mkdir -p $(@D); echo "  c++ $<"
	@$(CXX) $(CPPFLAGS) $(CXXFLAGS) -MD -MP -c $< -o $@
$(B)/obj/tools/web_page.o: tools/web_page.html
$(B)/obj/src/monitor/limits.o: config/alarms.toml
$(B)/lib/libcyclops.a: $(call objects,$(LIB_SRC))
$(B)/lib/libhil.a: $(call objects,$(HIL_SRC))
$(B)/lib/libtools.a: $(call objects,$(TOOL_SRC))
$(B)/lib/%.a:
	@mkdir -p $(@D); rm -f $@; $(AR) rcs $@ $^
define program_rule
$(call program,$(1)): $(call objects,$(1)) $(LIBS)
	@mkdir -p $$(@D); echo "  link $$@"
	@$(CXX) $(LDFLAGS) $$^ $$(LDLIBS) -o $$@
endef
$(foreach m,$(MAINS),$(eval $(call program_rule,$(m))))
# Only learning needs a solver.
$(B)/bin/cyclops-learn $(B)/test/unit-tests: LDLIBS += -lceres -lglog
$(B)/test/unit-tests: $(call objects,$(UNIT_SRC)) $(call objects,test/support.cpp) $(LIBS)
	@mkdir -p $(@D); echo "  link $@"; $(CXX) $(LDFLAGS) $^ $(LDLIBS) -lgtest -lgtest_main -o $@
$(B)/test/integration-tests: $(call objects,$(INTEG_SRC)) $(call objects,test/support.cpp) $(LIBS)
	@mkdir -p $(@D); echo "  link $@"; $(CXX) $(LDFLAGS) $^ $(LDLIBS) -lgtest -lgtest_main -o $@
$(B)/test/gpio-tests: $(call objects,$(GPIO_SRC)) $(LIBS)
	@mkdir -p $(@D); echo "  link $@"; $(CXX) $(LDFLAGS) $^ $(LDLIBS) -lgtest -lgtest_main -o $@
$(B)/bin/bench: $(call objects,$(BENCH_SRC)) $(call objects,test/support.cpp) $(LIBS)
	@mkdir -p $(@D); echo "  link $@"; $(CXX) $(LDFLAGS) $^ $(LDLIBS) -lopencv_calib3d -lopencv_video -lopencv_features2d -o $@
# Peers: trackers of other people for `make evaluate`, each built when its library is there.
PEERS := $(B)/bin/cyclops-peer-opencv $(if $(wildcard /usr/include/*/visp3/mbt/vpMbEdgeTracker.h),$(B)/bin/cyclops-peer-visp)
$(B)/bin/cyclops-peer-opencv: PEER_LIBS := -lopencv_video
$(B)/bin/cyclops-peer-visp: $(call objects,tools/peers/visp_edges.cpp tools/peers/wire_model.cpp)
$(B)/obj/tools/peers/visp_edges.o: CXXFLAGS += -std=c++17
$(B)/bin/cyclops-peer-visp: PEER_LIBS := -lvisp_mbt -lvisp_me -lvisp_core
.SECONDARY: $(call objects,$(wildcard tools/peers/*.cpp))
$(B)/bin/cyclops-peer-%: $(B)/obj/tools/peers/%_main.o $(call objects,tools/peers/peer.cpp) $(LIBS)
	@mkdir -p $(@D); echo "  link $@"
	@$(CXX) $(LDFLAGS) $(filter %.o,$^) $(LIBS) $(LDLIBS) $(PEER_LIBS) -o $@
-include $(patsubst %.o,%.d,$(call objects,$(LIB_SRC) $(HIL_SRC) $(TOOL_SRC) $(UNIT_SRC) $(INTEG_SRC) $(GPIO_SRC) $(BENCH_SRC) $(FUZZ_SRC) $(MAINS) test/support.cpp $(wildcard tools/peers/*.cpp)))

# --- doing the job -----------------------------------------------------------------------------------------------
SCENARIO ?= config/scenarios/s1.toml
PROFILE ?= -
FRAMES ?= 600
run: all ## fly a scenario through the whole rig (SCENARIO, PROFILE, FRAMES; 0: all frames); report in build/run/
	@hil/run.sh $(B) $(SCENARIO) $(PROFILE) $(FRAMES)

.PHONY: corners
corners: $(B)/bin/cyclops-render ## rendered against projected corners, measured by a fit that knows no camera
	@$(B)/bin/cyclops-render --corners

SEEDS ?= 101-120
JOBS ?= $(shell nproc)
.PHONY: evaluate peers
evaluate: $(addprefix $(B)/bin/cyclops-,flight evaluate disturb learn) $(PEERS) ## every flight x profile x seed beside the goals: SEEDS=1-20 FLIGHTS=s1,s3 PROFILES=default,thesis-2007 JOBS=2 EVALUATE=--help
	@/usr/bin/python3 tools/evaluate.py $(B) --seeds $(SEEDS) --jobs $(JOBS) $(if $(FLIGHTS),--flights $(FLIGHTS)) $(if $(PROFILES),--profiles $(PROFILES)) $(EVALUATE)
peers: $(PEERS) ## other people's trackers behind the same tables: OpenCV, and ViSP when libvisp-mbt-dev is there (make deps-extra)

FLIGHT ?=
.PHONY: flights flights-verify flights-page thesis-table
flights: $(B)/bin/cyclops-flight types ## fly every scenario into build/flights (FLIGHT=name: only that one); goes on where it was stopped
	@/usr/bin/python3 tools/flights.py make $(B) $(FLIGHT)
flights-verify: ## are the flights of build/flights still what was made?
	@/usr/bin/python3 tools/flights.py verify
flights-page: types ## one page with pictures and figures of build/flights (PAGE=--video adds videos)
	@/usr/bin/python3 tools/flights_page.py $(PAGE)
thesis-table: all ## the thesis' results beside ours over S1 to S4; flies what is missing
	@/usr/bin/python3 tools/flights.py make $(B) s1 s2 s3 s4
	@/usr/bin/python3 tools/thesis_table.py $(B)

MINUTES ?= 3
FPS ?= 60
SEED ?= 1
.PHONY: faults soak
build/flights/%/manifest.toml: config/scenarios/%.toml | $(B)/bin/cyclops-flight
	@$(B)/bin/cyclops-flight --scenario $< --out $(@D) --replace -q
faults: all build/flights/faults/manifest.toml ## every fault of the table on the whole rig: noticed, recovered, lost, wrong (ONLY=word)
	@/usr/bin/python3 tools/faults.py $(B) --only "$(ONLY)"
soak: all build/flights/soak/manifest.toml ## random faults for MINUTES at FPS frames a second: does every counter balance, is memory flat?
	@/usr/bin/python3 tools/soak.py $(B) --minutes $(MINUTES) --fps $(FPS) --seed $(SEED)

LEARN ?= build/flights/tour build/flights/block1
LEARN_TEST ?= build/flights/s1 build/flights/s2 build/flights/s4
LEARN_OUT ?= build/learnt.csv
.PHONY: learn
learn: $(B)/bin/cyclops-learn ## learn the tanker from flights (LEARN, LEARN_OUT) and try it on others (LEARN_TEST)
	@$(B)/bin/cyclops-learn $(LEARN) --out $(LEARN_OUT) --strength $(LEARN_OUT:.csv=.json) --looks $(LEARN_OUT:.csv=.looks) --test $(LEARN_TEST) --figures $(LEARN_OUT:.csv=-test.json)

REPLAY_FLIGHT ?= -
.PHONY: replay-check mcap
replay-check: all ## records a sortie and replays it at 1x, 20x, stepped and offline: everything must be what was published (REPLAY_FLIGHT=folder)
	@/usr/bin/python3 test/replay_check.py $(B) $(REPLAY_FLIGHT)
mcap: build/mcap/ready types ## the library for tools/export_mcap.py, from PyPI into build/mcap
build/mcap/ready: tools/mcap.txt
	@rm -rf build/mcap && /usr/bin/python3 -m venv --system-site-packages build/mcap
	@build/mcap/bin/pip install --quiet --disable-pip-version-check -r $< && touch $@

check: all $(B)/test/unit-tests $(B)/test/integration-tests ## every test; last line: N passed, N failed
	@test/check.sh $(B)
KILLS ?= 200
.PHONY: kill-test
kill-test: all ## the service records and is killed KILLS times; every record must be readable to within its last second
	@test/tools/kill_test.py $(B) $(KILLS)
unit: $(B)/test/unit-tests ## unit and property tests only
	@$(B)/test/unit-tests --gtest_brief=1
integration: all $(B)/test/integration-tests ## tests over real GVSP packets and LCM multicast
	@test/in-netns.sh $(B)/test/integration-tests --gtest_brief=1
.PHONY: gpio
gpio: $(B)/bin/cyclops $(B)/bin/cyclops-replay $(B)/bin/cyclops-flight $(B)/test/gpio-tests ## strobe and PPS on a real kernel's GPIO chip, in a virtual machine (some minutes, 700 MB)
	@tools/deps.sh --extra gpio
	@test/gpio/run.sh $(B)
bench: $(B)/bin/bench ## time per stage beside OpenCV, in one run
	@$(B)/bin/bench $(BENCH)
.PHONY: bench-scaling callgrind
bench-scaling: $(B)/bin/bench ## time of the chain with 38 to 1000 features and 1 to 4 thousand pixels square, as table and picture (build/scaling.png)
	@CYCLOPS_SCALING=build/scaling.json $(B)/bin/bench scaling
	@/usr/bin/python3 test/bench/scaling_plot.py build/scaling.json build/scaling.png
callgrind: $(B)/bin/bench ## instructions a pixel of the corner kernel (needs valgrind)
	@test/bench/callgrind.sh $(B)

# --- sanitizers, coverage, fuzzing -------------------------------------------------------------------------------
asan: ## all tests and the whole pipeline under AddressSanitizer
ubsan: ## the same under UndefinedBehaviorSanitizer
tsan: ## the same under ThreadSanitizer
# A sub-make compiles with all cores unless told otherwise.
SUB_JOBS = $(if $(filter -j%,$(MAKEFLAGS)),,-j$(shell nproc))
asan ubsan tsan:
	@$(MAKE) --no-print-directory $(SUB_JOBS) VARIANT=$@ sanitized
.PHONY: sanitized
sanitized: all $(B)/test/unit-tests $(B)/test/integration-tests
	@test/sanitized.sh $(B) $(VARIANT)
coverage: ## line coverage of src/ by the unit and integration tests
	@$(MAKE) --no-print-directory $(SUB_JOBS) VARIANT=coverage sanitized && test/coverage.sh
FUZZ_SECONDS ?= 30
FUZZ_RUNS ?=
FUZZ_TARGETS ?=
fuzz: $(TYPES_STAMP) ## every decoder and parser under libFuzzer, FUZZ_SECONDS or FUZZ_RUNS inputs each (needs make deps-extra); FUZZ_TARGETS="log csv"
	@FUZZ_RUNS=$(FUZZ_RUNS) test/fuzz.sh $(FUZZ_SECONDS) $(FUZZ_TARGETS)

# --- looking, installing -----------------------------------------------------------------------------------------
spy: types ## lcm-spy with our types
	@tools/spy.sh $(GEN)/cyclops-types.jar
install: all ## into DESTDIR/PREFIX
	@install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/share/cyclops $(DESTDIR)$(PREFIX)/share/doc/cyclops
	@install -m 755 $(PROGRAMS) $(DESTDIR)$(PREFIX)/bin
	@cp -r config lcmtypes $(DESTDIR)$(PREFIX)/share/cyclops
	@install -m 644 $(GEN)/cyclops-types.jar $(DESTDIR)$(PREFIX)/share/cyclops
	@install -m 755 tools/spy.sh tools/report.py tools/event_log.py $(DESTDIR)$(PREFIX)/share/cyclops
	@install -m 644 README.md LICENSE CHANGELOG.md docs/*.md $(DESTDIR)$(PREFIX)/share/doc/cyclops
layers: ## is the include direction of src/ true?
	@test/layers.sh
loc: ## lines by folder
	@for d in src/* hil tools test; do printf '%7d %s\n' $$(find $$d -name '*.[ch]pp' -o -name '*.py' -o -name '*.sh' | xargs -r cat | wc -l) $$d; done
clean: ## remove build/
	@rm -rf build
