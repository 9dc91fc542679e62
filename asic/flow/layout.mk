# SPDX-License-Identifier: Apache-2.0
# Placement to GDS with qflow's steps (graywolf, qrouter, magic, netgen), then what the result is worth. Included by the Makefile.
lay := $(out)/layout
ifeq ($(TECH),osu018)
layout: $(addprefix $(lay)/,route.txt drc.txt lvs.txt equivalence.txt timing.txt sdf.txt layout.png)
	$(MAKE) -f $(here)/Makefile TECH=$(TECH) TOP=$(TOP) summary
else
layout: routed
endif

$(addprefix $(lay)/,route.txt drc.txt lvs.txt $(TOP).gds $(TOP).sdf routed.v) &: $(out)/netlist.v $(here)/qflow.sh
	$(here)/qflow.sh $(out) $(TOP) $(tech_dir)

# What was laid out, buffers and all, against the same reference as the mapped netlist.
$(lay)/equivalence.txt: $(lay)/routed.v $(out)/reference.il
	$(here)/equivalence.sh $(out)/reference.il $< $(TOP) $(liberty) $(clock_gate) $(scan_off) > $@.part || { cat $@.part >&2; exit 1; }
	mv $@.part $@

$(lay)/timing.txt $(lay)/delays.sdf &: $(lay)/routed.v $(lay)/$(TOP).sdf $(here)/routed_timing.tcl $(here)/clock.tcl
	cd $(lay) && LIBERTY=$(liberty) NETLIST=$< TOP=$(TOP) CLOCK=$(CLOCK) PERIOD_NS=$(PERIOD_NS) WIRES=$(TOP).sdf DELAYS=delays.sdf \
	  sta -no_splash -exit $(here)/routed_timing.tcl > timing.txt.part 2>&1
	! grep -m1 '^Error' $(lay)/timing.txt.part >&2
	mv $(lay)/timing.txt.part $(lay)/timing.txt

# The routed netlist with its delays beside the RTL's gates in Icarus, random inputs, outputs compared before each clock edge.
$(lay)/sdf.txt: $(lay)/delays.sdf $(lay)/routed.v $(out)/reference.il $(here)/sdf_replay.py $(here)/fold_wires.py
	$(here)/sdf_replay.py $(out)/reference.il $(lay)/routed.v $(lay)/delays.sdf $(TOP) $(cells_verilog) $(PERIOD_NS) --clock $(CLOCK) --reset $(RESET) > $@.part || [ $$? = 1 ]
	mv $@.part $@

$(lay)/layout.png: $(lay)/$(TOP).gds $(here)/picture.py
	QT_QPA_PLATFORM=offscreen klayout -z -r $(here)/picture.py -rd rules=$(rules) -rd gds=$< -rd png=$@ > $(lay)/log/picture.txt 2>&1
