debounce.sv
