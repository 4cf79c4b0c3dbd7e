# relit: every user command. `make demo` and `make test` are the two to know; `make help` lists the rest.

BUILD   ?= build
PREFIX  ?= /usr/local
CC      ?= cc
CXX     ?= c++
PKGS     = OpenEXR yaml-0.1 jansson libxxhash libdeflate libisal
WARN     = -Wall -Wextra -Wpedantic -Wshadow -Wconversion
OPT     ?= -O2 -g
SAN     ?=
# No fused multiply-adds and no reordering: the same bits on every machine.
CFLAGS  += -std=c11 -D_GNU_SOURCE $(OPT) $(SAN) $(WARN) -Wstrict-prototypes -Wmissing-prototypes -ffp-contract=off -fPIC -pthread
CXXFLAGS += -std=c++17 $(OPT) $(SAN) -Wall -Wextra -Wshadow -fPIC -pthread
CPPFLAGS += -I. $(shell pkg-config --cflags $(PKGS) 2>/dev/null)
LDFLAGS += $(SAN) -pthread -Wl,--as-needed

# ---- what is built -------------------------------------------------------------------------------------------
LIB_C   := $(wildcard graph/base/*.c graph/model/*.c graph/run/*.c passes/*.c)
LIB_CXX := $(wildcard graph/run/*.cc)
# OpenImageIO takes a quarter of a second to load: its shim is a module of its own, loaded on first use.
MODULE_CXX := graph/run/shim_oiio.cc
LIB_CXX := $(filter-out $(MODULE_CXX),$(LIB_CXX))
TOOL_C  := $(wildcard graph/tool/*.c)
LIB_O   := $(LIB_C:%.c=$(BUILD)/%.o) $(LIB_CXX:%.cc=$(BUILD)/%.o)
TOOL_O  := $(TOOL_C:%.c=$(BUILD)/%.o)
LIBS    = $(shell pkg-config --libs $(PKGS)) $(shell pkg-config --libs OpenColorIO) -lOpenCL -lstdc++ -ldl -lm
TESTS   := $(patsubst tests/%.c,$(BUILD)/tests/%,$(wildcard tests/test_*.c))
TEST_HELP_O := $(patsubst tests/%.c,$(BUILD)/tests/%.o,$(filter-out tests/test_%.c,$(wildcard tests/*.c)))

all: $(BUILD)/relit $(BUILD)/librelit.a $(BUILD)/relit_oiio.so

$(BUILD)/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(CPPFLAGS) $(CFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/%.o: %.cc
	@mkdir -p $(@D)
	$(CXX) $(CPPFLAGS) $(CXXFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/librelit.a: $(LIB_O)
	@rm -f $@
	ar rcs $@ $^

$(BUILD)/relit_oiio.so: $(MODULE_CXX:%.cc=$(BUILD)/%.o)
	$(CXX) $(LDFLAGS) -shared -o $@ $^ $(shell pkg-config --libs OpenImageIO)

# Where `make install` puts the module; it is also found beside the program.
$(BUILD)/graph/run/image_module.o: CPPFLAGS += -DRL_MODULE_DIR='"$(PREFIX)/lib/relit"'

$(BUILD)/relit: $(TOOL_O) $(BUILD)/librelit.a
	$(CC) $(LDFLAGS) -o $@ $^ $(LIBS)

$(BUILD)/tests/%: $(BUILD)/tests/%.o $(TEST_HELP_O) $(BUILD)/librelit.a
	$(CC) $(LDFLAGS) -o $@ $^ $(LIBS) -lcmocka

.SECONDARY:
-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)

test-build: $(TESTS) $(BUILD)/relit_oiio.so
$(BUILD)/tests/test_image_file: | $(BUILD)/relit_oiio.so

test: test-build
	@tests/run.sh $(TESTS)

format:
	@clang-format -i $$(git ls-files '*.c' '*.h' '*.cc')

clean:
	rm -rf $(BUILD)

.PHONY: all test test-build format clean
