# SPDX-License-Identifier: Apache-2.0
# Placement, clock tree and power grid by our own placer (docs/make/layout.md), proved and timed at each corner. Included by the Makefile.
placed := $(out)/placed
UTILIZATION ?= $(utilization)
ifeq ($(PLACER),)
PLACER := $(root)/build/release/asic/layout/meltstage_place
$(PLACER): $(wildcard $(root)/asic/layout/*/*.?pp $(root)/asic/netlist/*.?pp)
	cd $(root) && cmake --preset release -DMELTSTAGE_SILICON=ON > /dev/null && cmake --build --preset release --target meltstage_place > /dev/null
endif
.PHONY: place
place: $(placed)/place.txt $(placed)/equivalence.txt $(corners:%=$(placed)/timing_%.txt)
	$(here)/summary.py $(BUILD)/$(TECH) $(TOP) $(PERIOD_NS) $(corners)

$(placed)/netlist.json: $(out)/netlist.v
	mkdir -p $(@D)
	yosys -q -p "read_verilog $<; write_json $@.part" > $(placed)/yosys.log 2>&1 || { tail -n 3 $(placed)/yosys.log >&2; exit 1; }
	mv $@.part $@

$(addprefix $(placed)/,place.txt placed.def placed.v placed.spef) &: $(placed)/netlist.json $(PLACER)
	for share in $(UTILIZATION); do \
	  ! $(PLACER) --lef $(lef) --liberty $(liberty) --netlist $< --utilization $$share --clock $(CLOCK) $(place_options) --def $(placed)/placed.def \
	    --verilog $(placed)/placed.v --spef $(placed)/placed.spef > $(placed)/place.txt.part 2> $(placed)/place.log || exit 0; \
	  grep -q "found no room" $(placed)/place.log || break; \
	done; cat $(placed)/place.log >&2; exit 1
	mv $(placed)/place.txt.part $(placed)/place.txt

$(placed)/equivalence.txt: $(placed)/placed.v $(out)/reference.il
	$(here)/equivalence.sh $(out)/reference.il $< $(TOP) $(liberty) $(clock_gate) $(scan_off) > $@.part || { cat $@.part >&2; exit 1; }
	mv $@.part $@

$(placed)/timing_%.txt: $(placed)/placed.v $(placed)/placed.spef $(here)/placed_timing.tcl $(here)/clock.tcl
	LIBERTY=$(liberty_$*) NETLIST=$< TOP=$(TOP) CLOCK=$(CLOCK) PERIOD_NS=$(PERIOD_NS) WIRES=$(placed)/placed.spef DELAYS= \
	  sta -no_splash -exit $(here)/placed_timing.tcl > $@.part 2>&1
	! grep -m1 -E '^Error|spef, line' $@.part >&2 # a net it doesn't find is one without its wire
	mv $@.part $@
