# SPDX-License-Identifier: Apache-2.0
"""What the tables of chip.toml and presets.toml hold, and what is wrong with one that doesn't."""
import keyword
import re
from collections.abc import Callable
from typing import NamedTuple

NO_TEXT = re.compile(r'[|"\\\x00-\x1f]')  # ends a cell of a table or a text of C++
# Words that a language keeps for itself (IEEE 1800-2017, C++20): a register's name in small letters is one of RTL and of programs.
RESERVED = {
    "SystemVerilog": """
        accept_on alias always always_comb always_ff always_latch and assert assign assume automatic before begin bind bins binsof bit
        break buf bufif0 bufif1 byte case casex casez cell chandle checker class clocking cmos config const constraint context continue
        cover covergroup coverpoint cross deassign default defparam design disable dist do edge else end endcase endchecker endclass
        endclocking endconfig endfunction endgenerate endgroup endinterface endmodule endpackage endprimitive endprogram endproperty
        endsequence endspecify endtable endtask enum event eventually expect export extends extern final first_match for force foreach
        forever fork forkjoin function generate genvar global highz0 highz1 if iff ifnone ignore_bins illegal_bins implements implies
        import incdir include initial inout input inside instance int integer interconnect interface intersect join join_any join_none
        large let liblist library local localparam logic longint macromodule matches medium modport module nand negedge nettype new
        nexttime nmos nor noshowcancelled not notif0 notif1 null or output package packed parameter pmos posedge primitive priority
        program property protected pull0 pull1 pulldown pullup pulsestyle_ondetect pulsestyle_onevent pure rand randc randcase
        randsequence rcmos real realtime ref reg reject_on release repeat restrict return rnmos rpmos rtran rtranif0 rtranif1
        s_always s_eventually s_nexttime s_until s_until_with scalared sequence shortint shortreal showcancelled signed small soft solve
        specify specparam static string strong strong0 strong1 struct super supply0 supply1 sync_accept_on sync_reject_on table tagged
        task this throughout time timeprecision timeunit tran tranif0 tranif1 tri tri0 tri1 triand trior trireg type typedef union
        unique unique0 unsigned until until_with untyped use uwire var vectored virtual void wait wait_order wand weak weak0 weak1 while
        wildcard wire with within wor xnor xor""".split(),
    "C++": """
        alignas alignof and_eq asm auto bitand bitor bool catch char char8_t char16_t char32_t co_await co_return co_yield compl concept
        const_cast consteval constexpr constinit decltype delete double dynamic_cast explicit false float friend goto inline long mutable
        namespace noexcept not_eq nullptr operator or_eq private public register reinterpret_cast requires short sizeof static_assert
        static_cast switch template thread_local throw true try typeid typename using volatile wchar_t xor_eq""".split(),
    "Python": [word.lower() for word in keyword.kwlist],
}


class SpecError(Exception):
    """One line that names the entry and what is wrong with it."""


def camel(name: str) -> str:
    return "".join(part.capitalize() for part in name.lower().split("_"))


def is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def is_text(value: object) -> bool:
    return isinstance(value, str) and not NO_TEXT.search(value)


def shown(value: object) -> str:
    """On one line, without control characters."""
    if isinstance(value, int) and abs(value) >= 1 << 64:
        return f"a number of {value.bit_length()} bits"
    text = repr(str(value))[1:-1]
    return text if len(text) <= 100 else text[:100] + "..."


class Kind(NamedTuple):
    """Values that a key may have."""
    expected: str
    fits: Callable[[object], bool]


def whole(low: int, high: int) -> Kind:
    return Kind(f"a whole number from {low} to {high}", lambda value: is_whole(value) and low <= value <= high)


def number(low: float, high: float) -> Kind:
    return Kind(f"a number from {low} to {high}",
                lambda value: isinstance(value, (int, float)) and not isinstance(value, bool) and low <= value <= high)


def one_of(*words: str) -> Kind:
    return Kind(" or ".join(words), lambda value: isinstance(value, str) and value in words)


def name_like(pattern: str, example: str) -> Kind:
    return Kind(f"a name such as {example}", lambda value: isinstance(value, str) and re.fullmatch(pattern, value) is not None)


def list_of_names(example: str) -> Kind:
    return Kind(f"a list of names such as {example}", lambda value: isinstance(value, list) and all(isinstance(item, str) for item in value))


TRUTH = Kind("true or false", lambda value: isinstance(value, bool))
TEXT = Kind('one line without |, \\ and "', lambda value: is_text(value) and bool(value.strip()))
IDENT = Kind('a text of 1 to 60 ASCII characters without |, \\ and "', lambda value: is_text(value) and value.isascii() and 1 <= len(value) <= 60)
WORD = name_like("[A-Z][A-Za-z0-9]*", "HeaterFb")  # part of a constant's name
SMALL_WORD = name_like("[a-z][a-z0-9]*(_[a-z0-9]+)*", "temp")
PIN = name_like("[a-z][a-z0-9]*(_[a-z0-9]+)*_(i|ni|o|no)", "uart_rx_i, which ends in _i, _ni, _o or _no")
PIN_WIDTH = Kind("a whole number from 1 to 8, or scan_chains", lambda value: value == "scan_chains" if isinstance(value, str) else is_whole(value) and 1 <= value <= 8)


class Shape(NamedTuple):
    """Keys of a table: those that each has, those that it may have, and those that no two entries of a list share."""
    wanted: dict[str, Kind]
    other: dict[str, Kind] = {}
    differ: tuple[str, ...] = ()


def coded(low: int, high: int, **more: Kind) -> Shape:
    return Shape({"name": WORD, "code": whole(low, high), **more}, differ=("name", "code"))


TABLES = {
    "chip.toml": {
        "chip": Shape({"name": SMALL_WORD, "clk_hz": whole(1000, 0xFFFFFFFF), "device_id": whole(0, 0xFFFF), "version": whole(0, 0xFFFF),
                       "vendor": IDENT, "product": IDENT, "revision": IDENT, "server_id": IDENT, "scan_chains": whole(1, 64),
                       "test_speedup": whole(1, 0xFFFF), "telemetry_words": whole(1, 63),
                       "write_words": Kind("1, 2, 4, 8 or 16", lambda value: is_whole(value) and value in (1, 2, 4, 8, 16)),
                       "setpoint_margin": whole(0, 0xFFFF)}),
        "modbus": Shape({"holding_base": whole(64, 0xFFFF - 64), "max_read": whole(1, 125), "broadcast_address": whole(0, 255),
                         "exception_flag": whole(0, 255), "mei_type": whole(0, 255), "identification_object": whole(0, 255)}),
        "autotune": Shape({"hysteresis": whole(1, 0xFFFF), "adapt_cycles": whole(1, 6), "measure_cycles": whole(1, 6),
                           "limit_tenths": whole(1, 0x3FFF), "kp": number(1e-3, 100), "td": number(1e-3, 100),
                           "ti_approach": number(1e-3, 100), "ti_hold": number(1e-3, 100)}),
    },
    "presets.toml": {},
}
LISTS = {
    "chip.toml": {
        "function": coded(1, 127),
        "exception": coded(1, 255, doc=TEXT),
        "response": coded(0, 7, doc=TEXT),
        "character": Shape({"name": name_like("8[NEO][12]", "8E1: 8 data bits, parity N, E or O, 1 or 2 stop bits"), "code": whole(0, 3)}, differ=("name", "code")),
        "tuning": coded(0, 255, doc=TEXT),
        "segment": coded(0, 3, doc=TEXT),
        "pin": Shape({"name": PIN, "idle": whole(0, 255), "doc": TEXT}, {"width": PIN_WIDTH, "async": TRUTH}, ("name",)),
        "test_pin": Shape({"name": PIN, "doc": TEXT}, {"width": PIN_WIDTH, "idle": whole(0, 255), "async": TRUTH, "modelled": TRUTH}, ("name",)),
        "state": Shape({"name": WORD, "code": whole(0, 31), "to": list_of_names('["CmdReady"]'), "doc": TEXT}, differ=("name", "code")),
        "format": Shape({"name": SMALL_WORD, "width": whole(1, 64), "frac": whole(0, 64), "signed": TRUTH, "doc": TEXT}, differ=("name",)),
        "fault": Shape({"name": WORD, "bit": whole(0, 15), "latch": one_of("always", "run"), "doc": TEXT, "measured": list_of_names('["PV"]'),
                        "limits": list_of_names('["T_MAX"]'), "next": TEXT}, differ=("name", "bit")),
        "command": coded(0, 0xFFFF, doc=TEXT),
    },
    "presets.toml": {
        "preset": Shape({"name": name_like("[A-Z0-9]+(-[A-Z0-9]+)*", "MAX31855"), "code": whole(1, 7), "length": whole(1, 32), "mode": whole(0, 3),
                         "tx": whole(0, 255), "lsb": whole(0, 31), "width": whole(1, 16), "signed": TRUTH, "scale": whole(1, 0xFFFF),
                         "offset": whole(-0x8000, 0x7FFF), "fault_mask": whole(0, 0xFFFF), "check_mask": whole(0, 0xFFFFFFFF),
                         "check_value": whole(0, 0xFFFFFFFF), "setup": whole(0, 0xFFFF), "min_ts_ms": whole(1, 0xFFFF),
                         "highest_degc": number(-273.15, 10000), "doc": TEXT}, differ=("name", "code")),
    },
}


def defect(file: str, place: str, found: str, expected: str) -> SpecError:
    return SpecError(f"{file}: {place}: found {found}, expected {expected}")


def check_table(file: str, place: str, table: dict, shape: Shape) -> None:
    kinds = shape.wanted | shape.other
    for key in table:
        if key not in kinds:
            raise defect(file, place, f"{shown(key)}, which nothing reads", f"one of {', '.join(kinds)}")
    for key, kind in shape.wanted.items():
        if key not in table:
            raise defect(file, place, f"no {key}", kind.expected)
    for key, value in table.items():
        if not kinds[key].fits(value):
            raise defect(file, place, f"{key} {shown(value)}", kinds[key].expected)


def place_of(name: str, index: int, entry: dict) -> str:
    """"[[pin]] heater_o", or "[[pin]] number 3" of one without a name."""
    return f"[[{name}]] {shown(entry['name'])}" if isinstance(entry.get("name"), str) else f"[[{name}]] number {index + 1}"


def check_list(file: str, name: str, entries: object, shape: Shape) -> None:
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise SpecError(f"{file}: found {name} that is no list of entries, expected one or more [[{name}]]")
    for index, entry in enumerate(entries):
        check_table(file, place_of(name, index, entry), entry, shape)
    for key in shape.differ:
        known = {}
        for index, entry in enumerate(entries):
            value = camel(entry[key]) if key == "name" else entry[key]  # HeaterFb and HeaterFB would be one word
            if value in known:
                raise defect(file, place_of(name, index, entry), f"{key} {shown(entry[key])} twice, as of number {known[value] + 1} too", f"each {key} once")
            known[value] = index


def check_shapes(file: str, spec: dict) -> None:
    """Each table and entry of a file has the keys that are read, and values that each reader takes."""
    tables, lists = TABLES[file], LISTS[file]
    for name in spec:
        if name not in tables and name not in lists:
            raise SpecError(f"{file}: found {shown(name)}, which nothing reads, expected one of {', '.join([*tables, *lists])}")
    for name, shape in tables.items():
        if not isinstance(spec.get(name), dict):
            raise SpecError(f"{file}: found no [{name}], expected it with {', '.join(shape.wanted)}")
        check_table(file, f"[{name}]", spec[name], shape)
    for name, shape in lists.items():
        if name not in spec:
            raise SpecError(f"{file}: found no [[{name}]], expected one or more with {', '.join(shape.wanted)}")
        check_list(file, name, spec[name], shape)


def check_order(file: str, name: str, key: str, entries: list[dict], first: int) -> None:
    """A table in C++ has them by their place."""
    for index, entry in enumerate(entries):
        if entry[key] != first + index:
            raise defect(file, place_of(name, index, entry), f"{key} {entry[key]} as number {index + 1}", f"{first + index}: they stand in the order of {key}")


def check_known(place: str, key: str, names: list[str], known: list[str], of: str) -> None:
    for name in names:
        if name not in known:
            raise defect("chip.toml", place, f"{key} {shown(name)}", f"names of {of}")
        if names.count(name) > 1:
            raise defect("chip.toml", place, f"{key} {shown(name)} twice", "each name once")


def check_presets(presets: list[dict]) -> None:
    check_order("presets.toml", "preset", "code", presets, 1)
    for index, preset in enumerate(presets):
        place = place_of("preset", index, preset)
        if preset["lsb"] + preset["width"] > preset["length"]:
            raise defect("presets.toml", place, f"lsb {preset['lsb']} and width {preset['width']}", f"a field within the length of {preset['length']}")
        if preset["check_value"] & ~preset["check_mask"]:
            raise defect("presets.toml", place, f"check_value {preset['check_value']:#x}", f"bits of check_mask {preset['check_mask']:#x} alone, as no frame shows others")


def check_pins(spec: dict) -> None:
    """Names differ in C++, too, and an output of the model has one bit."""
    members = {}
    for name in ("pin", "test_pin"):
        for index, pin in enumerate(spec[name]):
            place, member = place_of(name, index, pin), member_of(pin["name"])
            width = spec["chip"].get(pin.get("width"), pin.get("width", 1))
            if pin.get("idle", 0) >= 1 << width:
                raise defect("chip.toml", place, f"idle {pin['idle']}", f"a level of {width} bits")
            modelled = name == "pin" or pin.get("modelled", False)
            for language, words in RESERVED.items():
                if modelled and member in words:
                    raise defect("chip.toml", place, f"name {pin['name']}, of which {member} is a word of {language}", "another name")
            if modelled and member in members:
                raise defect("chip.toml", place, f"name {pin['name']}, which C++ calls {member} as {members[member]}", "another name")
            if modelled:
                members[member] = pin["name"]
            if modelled and pin["name"].endswith("o") and width != 1:
                raise defect("chip.toml", place, f"width {shown(pin['width'])}", "1: an output of the model has one bit")
            if modelled and width > 8:
                raise defect("chip.toml", place, f"width {shown(pin['width'])}", "at most 8 bits of a pin of the model")


def member_of(pin: str) -> str:
    """Its name in C++: uart_rx_i -> uart_rx, fault_no -> fault_n."""
    stem, suffix = pin.rsplit("_", 1)
    return stem + ("_n" if suffix.startswith("n") else "")


def check_states(states: list[dict]) -> None:
    names = [state["name"] for state in states]
    for index, state in enumerate(states):
        place = place_of("state", index, state)
        check_known(place, "to", state["to"], names, "states")
        for other in states[:index]:
            if bin(state["code"] ^ other["code"]).count("1") < 2:
                raise defect("chip.toml", place, f"code {state['code']:05b} one bit from {other['code']:05b} of {other['name']}", "two bits between any two")


def check_characters(characters: list[dict]) -> None:
    """A table has them by the word of the field, which is masked and no more."""
    check_order("chip.toml", "character", "code", characters, 0)
    if len(characters) != 4:
        raise SpecError(f"chip.toml: found {len(characters)} [[character]], expected 4: FORMAT has two bits for them")


def check_faults(spec: dict) -> None:
    """Of a spec whose registers are known."""
    check_order("chip.toml", "fault", "bit", spec["fault"], 0)
    for index, fault in enumerate(spec["fault"]):
        place = place_of("fault", index, fault)
        check_known(place, "measured", fault["measured"], [reg["name"] for reg in spec["input"]], "input registers")
        check_known(place, "limits", fault["limits"], [reg["name"] for reg in spec["holding"]], "holding registers")


def check_counts(spec: dict) -> None:
    """Numbers of one table that bound each other. Of a spec whose registers are known."""
    if spec["chip"]["telemetry_words"] > len(spec["input"]):
        raise defect("chip.toml", "[chip]", f"telemetry_words {spec['chip']['telemetry_words']}", f"at most {len(spec['input'])}, the input registers")
    cycles = spec["autotune"]["adapt_cycles"] + spec["autotune"]["measure_cycles"]
    if cycles > 7:
        raise defect("chip.toml", "[autotune]", f"{cycles} adapt_cycles and measure_cycles in all", "at most 7: ATUNE counts them in 3 bits")
