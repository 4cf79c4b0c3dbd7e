# relit: every user command. `make demo` and `make test` are the two to know.
#
#   make demo        install what is missing, build, re-light the bundled capture
#   make test        install what the tests miss, build, run them all
#   make             build build/relit, build/librelit.a, build/librelit.so and the modules
#   make test-asan   the tests under AddressSanitizer and UndefinedBehaviorSanitizer
#   make fuzz        changed inputs against parsers and readers, FUZZ_SECONDS=60 each
#   make soak        2,000 frames: memory flat, nothing leaked
#   make bench       kernels and codecs against their peers
#   make temporal    CAPTURES="folders": temporal anti-aliasing against the truth, and its flicker: tables and strips
#   make accuracy    TRUTH=folder: every model against a path-traced truth (tests/accuracy.c)
#   make docs        passes/README.md from the passes' tables, and its pictures (make docs-page: the tables alone)
#   make install     PREFIX=/usr/local: program, library, headers, relit.pc, configs, kernels
#   make deps        Debian packages
#   make format      clang-format 14 (make format-check only looks); make layers: includes point one way only

BUILD   ?= build
PREFIX  ?= /usr/local
DESTDIR ?=
CC      ?= cc
CXX     ?= c++
PKGS     = OpenEXR yaml-0.1 jansson libxxhash libdeflate libisal
WARN     = -Wall -Wextra -Wpedantic -Wshadow -Wconversion
OPT     ?= -O2 -g
SAN     ?=
# No contraction and no reordering of floating point: the same bits on every machine.
CFLAGS   += -std=c11 -D_GNU_SOURCE $(OPT) $(SAN) $(WARN) -Wstrict-prototypes -Wmissing-prototypes \
            -ffp-contract=off -fPIC -pthread
CXXFLAGS += -std=c++17 $(OPT) $(SAN) -Wall -Wextra -Wshadow -fPIC -pthread
CPPFLAGS += -I. $(shell pkg-config --cflags $(PKGS) 2>/dev/null)
LDFLAGS  += $(SAN) -pthread -Wl,--as-needed
LIBS      = $(shell pkg-config --libs $(PKGS) OpenColorIO) -lOpenCL -lstdc++ -ldl -lm

# `make V=1` shows whole commands.
ifeq ($(V),1)
say =
Q   =
else
say = @echo "  $(1)"
Q   = @
endif

# ---- what is built -------------------------------------------------------------------------------------------

# OpenImageIO takes a quarter of a second to load: its shim is a module of its own, loaded on first use.
MODULE_CXX := graph/run/shim_oiio.cc
LIB_C   := $(wildcard graph/base/*.c graph/model/*.c graph/run/*.c passes/*.c)
LIB_CXX := $(filter-out $(MODULE_CXX),$(wildcard graph/run/*.cc))
TOOL_C  := $(wildcard graph/tool/*.c)
KERNELS := kernels/shared.h $(wildcard kernels/*.cl)
LIB_O   := $(LIB_C:%.c=$(BUILD)/%.o) $(LIB_CXX:%.cc=$(BUILD)/%.o) $(BUILD)/kernels.o
TOOL_O  := $(TOOL_C:%.c=$(BUILD)/%.o)
MAIN_O  := $(BUILD)/graph/tool/relit.o
TESTS   := $(patsubst tests/%.c,$(BUILD)/tests/%,$(wildcard tests/test_*.c))
SCRIPTS := $(wildcard tests/test_*.sh)
# Programs of their own; all other files in tests/ are helpers that they share.
MAINS   := tests/test_%.c tests/bench_%.c tests/fit_%.c tests/make_%.c tests/example.c tests/accuracy.c tests/temporal.c tests/fuzz/main.c
BENCHES := $(patsubst tests/%.c,$(BUILD)/tests/%,$(wildcard tests/bench_*.c))
HELP_O  := $(patsubst tests/%.c,$(BUILD)/tests/%.o,$(filter-out $(MAINS),$(wildcard tests/*.c tests/fuzz/*.c)))

all: $(BUILD)/relit $(BUILD)/librelit.a $(BUILD)/librelit.so $(BUILD)/relit_oiio.so

$(BUILD)/%.o: %.c
	@mkdir -p $(@D)
	$(call say,cc   $<)
	$(Q)$(CC) $(CPPFLAGS) $(CFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/%.o: %.cc
	@mkdir -p $(@D)
	$(call say,c++  $<)
	$(Q)$(CXX) $(CPPFLAGS) $(CXXFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/librelit.a: $(LIB_O)
	@rm -f $@
	@ar rcs $@ $^

$(BUILD)/librelit.so: $(LIB_O)
	$(call say,link $@)
	$(Q)$(CC) $(LDFLAGS) -shared -Wl,-soname,librelit.so -o $@ $^ $(LIBS)

# All of the tool but main(): tests call it in their own process.
$(BUILD)/tool.a: $(filter-out $(MAIN_O),$(TOOL_O))
	@rm -f $@
	@ar rcs $@ $^

$(BUILD)/relit: $(MAIN_O) $(BUILD)/tool.a $(BUILD)/librelit.a
	$(call say,link $@)
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)

$(BUILD)/relit_oiio.so: $(MODULE_CXX:%.cc=$(BUILD)/%.o)
	$(call say,link $@)
	$(Q)$(CXX) $(LDFLAGS) -shared -o $@ $^ $(shell pkg-config --libs OpenImageIO)

# Kernels are built into the library, so that it runs from anywhere; $RELIT_KERNELS overrides them.
$(BUILD)/kernels.c: $(KERNELS) Makefile
	@mkdir -p $(@D)
	@{ echo '/* generated from kernels/ */'; \
	  n=0; for k in $(KERNELS); do echo "static const unsigned char k$$n[] = {"; \
	    od -An -v -tu1 $$k | sed 's/  */,/g;s/^,//;s/$$/,/'; echo '0};'; n=$$((n+1)); done; \
	  echo 'typedef struct embedded { const char *name; const unsigned char *text; } embedded;'; \
	  echo 'extern const embedded rl_embedded_kernels[];'; \
	  echo 'const embedded rl_embedded_kernels[] = {'; \
	  n=0; for k in $(KERNELS); do echo "{\"$$(basename $$k)\", k$$n},"; n=$$((n+1)); done; \
	  echo '{0, 0}};'; } > $@.tmp && mv $@.tmp $@
$(BUILD)/kernels.o: $(BUILD)/kernels.c
	$(Q)$(CC) $(CPPFLAGS) $(CFLAGS) -c $< -o $@

# Loops over every sample of a frame: gcc vectorizes them from -O3 on.
$(BUILD)/graph/run/ingest.o: OPT += -O3

# Sums over filter taps, the same; and powers of pixels, where errno and traps would keep sqrt and choices from it.
$(BUILD)/graph/tool/metric_filter.o: OPT += -O3
$(BUILD)/graph/tool/metric_flip_rows.o: OPT += -O3 -fno-math-errno -fno-trapping-math

# Where `make install` puts things that are looked for at run time; a build tree finds its own first.
$(BUILD)/graph/run/image_module.o: CPPFLAGS += -DRL_MODULE_DIR='"$(PREFIX)/lib/relit"'
$(BUILD)/graph/run/data_files.o: CPPFLAGS += -DRELIT_DATADIR='"$(PREFIX)/share/relit/configs"'

.SECONDARY:
-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)

# ---- user commands ---------------------------------------------------------------------------------------------

demo: deps
	@$(MAKE) --no-print-directory -j2 all
	@echo
	$(BUILD)/relit run configs/skin.yaml --out out/demo
	$(BUILD)/relit run configs/skin_off.yaml --out out/demo_off --frames 8
	@echo; echo "With scattering:"; ls out/demo/*.png out/demo/*.exr; echo "Without:"; ls out/demo_off/*.png

# ---- tests -----------------------------------------------------------------------------------------------------

# An archive: a test gets the helpers that it uses, and what those need.
$(BUILD)/tests/help.a: $(HELP_O)
	@rm -f $@
	@ar rcs $@ $^

$(BUILD)/tests/%: $(BUILD)/tests/%.o $(BUILD)/tests/sanitizers.o $(BUILD)/tests/help.a $(BUILD)/tool.a $(BUILD)/librelit.a
	$(call say,link $@)
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LIBS) -lcmocka

# They load the module; so does whatever writes PNG files.
$(BUILD)/tests/test_image_file $(BUILD)/tests/test_sg_run $(BUILD)/tests/test_diff: | $(BUILD)/relit_oiio.so

test-build: all $(TESTS) $(BENCHES)

test: deps
	@$(MAKE) --no-print-directory -j2 test-build layers
	@BUILD=$(BUILD) tests/run.sh $(TESTS) $(SCRIPTS)

SANITIZE = -fsanitize=address,undefined -fno-sanitize-recover=undefined
ASAN     = BUILD=build-asan SAN="$(SANITIZE)"

test-asan: deps
	@$(MAKE) --no-print-directory -j2 $(ASAN) test-build
	@$(ASAN) ASAN_OPTIONS=detect_leaks=0 tests/run.sh $(patsubst $(BUILD)/%,build-asan/%,$(TESTS))

# Kernels and codecs against their peers; tests/bench_batch.sh says what can be chosen.
bench: all $(BENCHES)
	$(BUILD)/tests/bench_sss
	@BUILD=$(BUILD) tests/bench_batch.sh

$(BUILD)/tests/fuzz/fuzz: $(BUILD)/tests/fuzz/main.o $(BUILD)/tests/sanitizers.o $(BUILD)/tests/help.a $(BUILD)/tool.a $(BUILD)/librelit.a
	$(call say,link $@)
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LIBS) -lcmocka

# Changed inputs against parsers and readers, under the sanitizers; tests/test_fuzz.c is its short form.
FUZZ_SECONDS ?= 60
FUZZ_SEED    ?= $(shell date +%s)
fuzz: deps
	@$(MAKE) --no-print-directory -j2 $(ASAN) build-asan/tests/fuzz/fuzz
	@ASAN_OPTIONS=detect_leaks=0 build-asan/tests/fuzz/fuzz --seconds $(FUZZ_SECONDS) --seed $(FUZZ_SEED)

# 2,000 frames: memory flat, no file left open. `make test` runs 120 of them.
soak:
	@$(MAKE) --no-print-directory -j2 $(BUILD)/tests/test_batch
	RELIT_SOAK_FRAMES=$(or $(FRAMES),2000) $(BUILD)/tests/test_batch

# A real one-node Slurm on the loopback address; needs slurm-wlm, munge and root.
slurm-test: all
	BUILD=$(BUILD) tests/slurm.sh

# ---- the rest --------------------------------------------------------------------------------------------------

DEB = build-essential pkg-config libopenexr-dev libopenimageio-dev libopencolorio-dev pocl-opencl-icd ocl-icd-opencl-dev \
      opencl-headers libyaml-dev libjansson-dev libxxhash-dev libdeflate-dev libisal-dev libcmocka-dev libgraphviz-dev clang-format

# Asks for root rights only when something is missing.
deps:
	@missing=""; for p in $(DEB); do \
	  dpkg-query -W -f '$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || missing="$$missing $$p"; done; \
	if [ -n "$$missing" ]; then \
	  echo "installing:$$missing"; \
	  sudo=""; [ "$$(id -u)" = 0 ] || sudo=sudo; \
	  $$sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -y -qq --no-install-recommends $$missing; \
	fi

# Pictures of the error go to OUT.
temporal: all $(BUILD)/tests/temporal
	@$(BUILD)/tests/temporal $(CAPTURES)

OUT ?= out/accuracy
accuracy: all $(BUILD)/tests/accuracy
	@test -n "$(TRUTH)" || { echo "give TRUTH=folder, as tests/accuracy_scene.h describes it" >&2; exit 2; }
	@$(BUILD)/tests/accuracy $(TRUTH) $(OUT)

# Half a minute, for the dense sum; `make test` checks that the page is up to date.
docs: all
	RELIT=$(BUILD)/relit passes/docs/pictures.sh
	@$(MAKE) --no-print-directory docs-page
docs-page: all
	RELIT=$(BUILD)/relit passes/docs/page.sh > passes/README.md.tmp && mv passes/README.md.tmp passes/README.md

install: all
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/lib/relit \
	  $(DESTDIR)$(PREFIX)/include/relit/graph/base $(DESTDIR)$(PREFIX)/share/relit/kernels
	install -m 755 $(BUILD)/relit $(DESTDIR)$(PREFIX)/bin/
	install -m 644 $(BUILD)/librelit.a $(BUILD)/librelit.so $(DESTDIR)$(PREFIX)/lib/
	install -m 644 $(BUILD)/relit_oiio.so $(DESTDIR)$(PREFIX)/lib/relit/
	install -m 644 graph/relit.h $(DESTDIR)$(PREFIX)/include/relit/graph/
	install -m 644 graph/base/error.h graph/base/log.h $(DESTDIR)$(PREFIX)/include/relit/graph/base/
	install -m 644 $(KERNELS) $(DESTDIR)$(PREFIX)/share/relit/kernels/
	cp -R configs $(DESTDIR)$(PREFIX)/share/relit/
	sed -e 's|@PREFIX@|$(PREFIX)|' -e 's|@VERSION@|$(VERSION)|' graph/relit.pc.in > $(DESTDIR)$(PREFIX)/lib/pkgconfig/relit.pc

VERSION := $(shell sed -n 's/^.define RL_VERSION "\(.*\)"/\1/p' graph/relit.h)

FORMATTED = $(shell git ls-files '*.c' '*.h' '*.cc' '*.hh')
format:
	clang-format -i $(FORMATTED)
format-check:
	@tests/test_format.sh

layers:
	@tests/layers.sh

clean:
	rm -rf $(BUILD) build-asan

.PHONY: all demo bench test test-build test-asan deps install format format-check layers clean fuzz accuracy docs docs-page soak slurm-test temporal
