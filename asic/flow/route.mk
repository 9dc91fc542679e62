# SPDX-License-Identifier: Apache-2.0
# Routing of what place.mk placed by our own router, GDS, design rules, connectivity, and what the result is worth (docs/make/layout.md).
# Included by the Makefile.
routed := $(out)/routed
rules := $(here)/tech/$(TECH)_rules.json
klayout := QT_QPA_PLATFORM=offscreen klayout
comma := ,
empty :=
ifeq ($(ROUTER),)
ROUTER := $(root)/build/release/asic/layout/meltstage_route
$(ROUTER): $(wildcard $(root)/asic/layout/*/*.?pp $(root)/asic/netlist/*.?pp)
	cd $(root) && cmake --preset release -DMELTSTAGE_SILICON=ON > /dev/null && cmake --build --preset release --target meltstage_route > /dev/null
endif
.PHONY: routed factory
routed: $(addprefix $(routed)/,route.txt drc.txt lvs.txt equivalence.txt sdf.txt layout.png) $(corners:%=$(routed)/timing_%.txt) \
  $(if $(wildcard $(FACTORY_DECK)),$(routed)/factory.txt)
	$(MAKE) -f $(here)/Makefile TECH=$(TECH) TOP=$(TOP) summary

# Open nets, conflicts and broken antenna rules are in route.txt, mismatches in sdf.txt; the summary is what fails for them.
$(addprefix $(routed)/,route.txt routed.def routed.v routed.spef) &: $(placed)/placed.def $(ROUTER)
	mkdir -p $(routed)
	$(ROUTER) --lef $(lef) --def $< --out $(routed)/routed.def --netlist $(routed)/routed.v --spef $(routed)/routed.spef > $(routed)/route.txt.part || [ $$? = 1 ]
	mv $(routed)/route.txt.part $(routed)/route.txt

$(routed)/$(TOP).gds: $(routed)/routed.def $(rules) $(here)/gds.py
	$(klayout) -b -r $(here)/gds.py -rd rules=$(rules) -rd lef=$(subst $(empty) $(empty),$(comma),$(lef)) -rd routed=$< -rd cells=$(cells_gds) -rd gds=$@

$(routed)/drc.txt: $(routed)/$(TOP).gds $(rules) $(here)/design_rules.py
	$(klayout) -b -r $(here)/design_rules.py -rd rules=$(rules) -rd gds=$< -rd report=$@ -rd marks=$(routed)/drc.lyrdb

# The netlist is the DEF's, with the router's diodes; the metal is the GDS's.
$(routed)/lvs.txt $(routed)/metal.v &: $(routed)/$(TOP).gds $(routed)/routed.def $(rules) $(here)/connectivity.py
	$(klayout) -b -r $(here)/connectivity.py -rd rules=$(rules) -rd lef=$(lastword $(lef)) -rd netlist_of=$(routed)/routed.def -rd gds=$< \
	  -rd report=$(routed)/lvs.txt -rd netlist=$(routed)/metal.v

# The factory's own rules, by its own deck for KLayout, where the PDK has it. Density is told apart: fill is put in when the die is finished.
factory: $(routed)/factory.txt
	cat $<
$(routed)/factory.txt: $(routed)/$(TOP).gds $(wildcard $(FACTORY_DECK))
	test -f "$(FACTORY_DECK)" || { echo "factory: FACTORY_DECK=$(FACTORY_DECK): no such file, expected the deck for KLayout of a whole PDK (libs.tech)" >&2; exit 2; }
	$(klayout) -b -r $(FACTORY_DECK) -rd in_gds=$< -rd report_file=$(routed)/factory.lyrdb > $(routed)/factory.log 2>&1 || \
	  { echo "factory: $(FACTORY_DECK): $$(grep -m1 '^ERROR: [^I]' $(routed)/factory.log); expected a deck that this KLayout reads" >&2; exit 1; }
	awk -v density='$(factory_density)' '/^Rule / { sub(/:$$/, "", $$2); rules++; if ($$3 > 0) print $$2 ": " $$3; if ($$2 ~ density) filled += $$3; else errors += $$3 } \
	  END { print rules " rules, " errors + 0 " errors; of density: " filled + 0 }' $(routed)/factory.log > $@.part
	mv $@.part $@

# What the metal connects, against the same reference as the mapped netlist. Metal with a short is no netlist to compare; the summary fails for it.
$(routed)/equivalence.txt: $(routed)/metal.v $(out)/reference.il
	case "$$(tail -n 1 $(routed)/lvs.txt)" in \
	  *", 0 errors") $(here)/equivalence.sh $(out)/reference.il $< $(TOP) $(liberty) $(clock_gate) $(scan_off) ;; \
	  *) echo "not compared: $$(tail -n 1 $(routed)/lvs.txt)" ;; \
	esac > $@.part || { cat $@.part >&2; exit 1; }
	mv $@.part $@

$(routed)/timing_%.txt $(routed)/delays_%.sdf: $(routed)/routed.v $(routed)/routed.spef $(here)/placed_timing.tcl $(here)/clock.tcl
	LIBERTY=$(liberty_$*) NETLIST=$< TOP=$(TOP) CLOCK=$(CLOCK) PERIOD_NS=$(PERIOD_NS) WIRES=$(routed)/routed.spef DELAYS=$(routed)/delays_$*.sdf \
	  sta -no_splash -exit $(here)/placed_timing.tcl > $(routed)/timing_$*.part 2>&1
	! grep -m1 -E '^Error|spef, line' $(routed)/timing_$*.part >&2 # a net it doesn't find is one without its wire
	mv $(routed)/timing_$*.part $(routed)/timing_$*.txt

# What the metal connects with its wires' delays beside the RTL's gates in Icarus, random inputs, in the corner of synthesis.
$(routed)/sdf.txt: $(routed)/routed.v $(routed)/delays_$(synth_corner).sdf $(cells_verilog) $(out)/reference.il $(here)/sdf_replay.py $(here)/fold_wires.py
	$(here)/sdf_replay.py $(out)/reference.il $< $(routed)/delays_$(synth_corner).sdf $(TOP) $(cells_verilog) $(PERIOD_NS) --clock $(CLOCK) --reset $(RESET) $(replay_held) > $@.part || [ $$? = 1 ]
	mv $@.part $@

# Where the library has no Verilog of its cells: their logic and paths from Liberty.
$(BUILD)/$(TECH)/cells.v: $(liberty) $(cells_model) $(here)/cell_models.py
	yosys -q -p "read_liberty -ignore_miss_func -ignore_miss_dir $(liberty); proc; write_verilog -noattr $@.functions" 2>&1 | { grep -v "unsupported expression" || true; }
	cat $(cells_model) >> $@.functions
	$(here)/cell_models.py $(liberty) $@.functions > $@.part
	mv $@.part $@

$(routed)/layout.png: $(routed)/$(TOP).gds $(here)/picture.py
	$(klayout) -z -r $(here)/picture.py -rd rules=$(rules) -rd gds=$< -rd png=$(routed)/middle.png -rd share=0.15 > $(routed)/picture.log 2>&1
	$(klayout) -z -r $(here)/picture.py -rd rules=$(rules) -rd gds=$< -rd png=$@ >> $(routed)/picture.log 2>&1
