# SPDX-License-Identifier: Apache-2.0
"""The drawings that no run gives: blocks, states, and a circuit around the chip."""
from drawing import BLUE, GREEN, INK, PALE, VERMILION, Drawing


def box(drawing: Drawing, x: float, y: float, width: float, height: float, name: str, *lines: str, fill: str = PALE) -> None:
    drawing.rect(x, y, width, height, fill, INK, 3)
    first = y + height / 2 + 3.5 - 6 * len(lines)
    drawing.text(x + width / 2, first, name, size=10.5, bold=True)
    for i, line in enumerate(lines):
        drawing.text(x + width / 2, first + 12 * (i + 1), line, size=8.5)


def pins_on(drawing: Drawing, x: float, edge: float, names: list[tuple[str, float]], output: bool) -> None:
    """Names of pins at the border `x`, each with its height, and an arrow between border and `edge` of a block."""
    for name, y in names:
        drawing.arrow([(edge, y), (x, y)] if output else [(x, y), (edge, y)], INK)
        right = x > edge
        drawing.text(x + (5 if right else -5), y + 3, name, "start" if right else "end", 9)


def blocks() -> str:
    """Names of pins and of blocks as in rtl/tc_top.sv."""
    drawing = Drawing(640, 328, "Functional block diagram: host port, state machine, parameters, sensor, control law, detectors, PWM")
    drawing.rect(84, 6, 472, 316, "none", INK)
    box(drawing, 104, 30, 104, 62, "UARTC", "Modbus RTU slave", "telemetry")
    box(drawing, 248, 30, 104, 62, "PARAMC", "judges commands", "answers reads")
    box(drawing, 412, 30, 120, 62, "MEM", "two sets of", "parameters, coded")
    box(drawing, 248, 112, 104, 50, "SYSCTRL", "states, control tick")
    box(drawing, 104, 182, 104, 50, "SENSC", "SPI master, decoder")
    box(drawing, 248, 182, 104, 50, "ALGOR", "segmented PID")
    box(drawing, 412, 182, 120, 50, "PWMC", "pulse width")
    box(drawing, 104, 258, 104, 40, "QUALITY", "figures of the loop")
    box(drawing, 248, 258, 104, 40, "ATUNE", "relay, self-tuning")
    box(drawing, 412, 258, 120, 40, "GUARD", "detectors, permission", fill="#fdeee2")
    pins_on(drawing, 84, 104, [("uart_rx_i", 40), ("addr_strap_i", 82)], output=False)
    pins_on(drawing, 84, 104, [("uart_tx_o", 54), ("uart_de_o", 68)], output=True)
    drawing.arrow([(156, 30), (156, 18), (556, 18)])
    drawing.text(561, 21, "tlm_tx_o", "start", 9)
    pins_on(drawing, 84, 104, [("spi_sclk_o", 190), ("spi_cs_no", 203), ("spi_mosi_o", 216)], output=True)
    pins_on(drawing, 84, 104, [("spi_miso_i", 229)], output=False)
    pins_on(drawing, 556, 532, [("heater_o", 262), ("safe_en_o", 273), ("fault_no", 284), ("at_temp_o", 295)], output=True)
    pins_on(drawing, 556, 548, [("inhibit_i", 206), ("heater_fb_i", 222)], output=False)
    drawing.polyline([(548, 206), (542, 206), (542, 244), (500, 244)])
    drawing.polyline([(548, 222), (542, 222)])
    drawing.arrow([(500, 244), (500, 258)])
    pins_on(drawing, 556, 548, [("clk_i", 120), ("rst_ni", 134), ("drop_i", 148)], output=False)
    drawing.arrow([(208, 55), (248, 55)], both=True)
    drawing.arrow([(352, 61), (412, 61)], both=True)
    drawing.arrow([(300, 92), (300, 112)], both=True)
    drawing.arrow([(472, 92), (472, 137), (396, 137)], BLUE)
    drawing.text(466, 132, "parameters", "end", 8.5, BLUE)
    drawing.text(466, 148, "to all blocks", "end", 8.5, BLUE)
    drawing.arrow([(248, 137), (156, 137), (156, 182)])
    drawing.text(200, 132, "start", size=8.5)
    drawing.arrow([(300, 162), (300, 182)])
    drawing.arrow([(352, 207), (412, 207)])
    drawing.text(382, 202, "duty", size=8.5)
    drawing.arrow([(440, 232), (440, 258)])
    drawing.arrow([(300, 258), (300, 232)], both=True)
    drawing.arrow([(180, 232), (180, 245), (396, 245), (396, 268), (412, 268)], VERMILION)
    drawing.text(186, 242, "reading", "start", 8.5, VERMILION)
    # the temperature that GUARD accepts
    drawing.polyline([(472, 298), (472, 310), (156, 310)], GREEN)
    drawing.arrow([(156, 310), (156, 298)], GREEN)
    drawing.arrow([(300, 310), (300, 298)], GREEN)
    drawing.arrow([(232, 310), (232, 214), (248, 214)], GREEN)
    drawing.text(466, 307, "accepted temperature", "end", 8.5, GREEN)
    return drawing.svg()


# Where each state stands; the arcs are those of spec/chip.toml.
PLACES = {"Idle": (70, 40), "CmdDecode": (230, 40), "ExtrParam": (400, 40), "WrParam": (560, 40),
          "CmdReady": (230, 130), "ReadTemp": (70, 220), "TempDisplay": (230, 220), "InitAlgor": (400, 220), "CfgPwm": (560, 220)}
# Corners on the way of an arc that does not run straight from box to box.
WAYS = {("WrParam", "ExtrParam"): [(560, 54), (560, 78), (400, 78), (400, 54)],
        ("WrParam", "CmdReady"): [(578, 54), (578, 124), (284, 124)],
        ("CmdReady", "CmdDecode"): [(216, 116), (216, 54)],
        ("CmdDecode", "CmdReady"): [(244, 54), (244, 116)],
        ("CmdReady", "ReadTemp"): [(176, 130), (70, 130), (70, 206)],
        ("CfgPwm", "CmdDecode"): [(614, 220), (628, 220), (628, 12), (230, 12), (230, 26)],
        ("CfgPwm", "ReadTemp"): [(560, 234), (560, 262), (70, 262), (70, 234)]}


def states(entries: list[dict]) -> str:
    """The main state machine; a state or arc of the specification that has no place here is an error, and so is one too many."""
    drawing = Drawing(640, 272, "Main state machine")
    left = set(WAYS)
    for state in entries:
        for target in state["to"]:
            arc = (state["name"], target)
            if arc in WAYS:
                drawing.arrow([(float(x), float(y)) for x, y in WAYS[arc]], BLUE)
                left.discard(arc)
                continue
            (x1, y1), (x2, y2) = PLACES[arc[0]], PLACES[arc[1]]
            if y1 != y2 or abs(x1 - x2) > 200:  # not side by side
                raise ValueError(f"diagrams.py: {arc[0]} to {arc[1]}: found no way for this arc, expected one in WAYS")
            side = 54 if x2 > x1 else -54
            drawing.arrow([(x1 + side, y1), (x2 - side, y2)], BLUE)
    if left or {state["name"] for state in entries} != set(PLACES):
        raise ValueError(f"diagrams.py: found PLACES and WAYS of other states than spec/chip.toml has, expected the same: {left}")
    for state in entries:
        x, y = PLACES[state["name"]]
        drawing.rect(x - 54, y - 14, 108, 28, PALE, INK, 12)
        drawing.text(x, y, state["name"], size=10, bold=True)
        drawing.text(x, y + 10.5, f"{state['code']:05b}", size=8.5)
    return drawing.svg()


def resistor(drawing: Drawing, x: float, y: float, upright: bool, name: str) -> None:
    width, height = (9, 24) if upright else (24, 9)
    drawing.rect(x - width / 2, y - height / 2, width, height)
    drawing.text(x + 8 if upright else x, y + 3 if upright else y - 7, name, "start" if upright else "middle", 8.5)


def ground(drawing: Drawing, x: float, y: float) -> None:
    for i, half in enumerate((8, 5, 2)):
        drawing.line(x - half, y + 3 * i, x + half, y + 3 * i, INK, 1.4)


def mosfet(drawing: Drawing, x: float, y: float, name: str) -> None:
    """Gate at (x, y); drain above and source below, at x + 18."""
    drawing.line(x, y, x + 6, y)
    drawing.line(x + 6, y - 10, x + 6, y + 10, INK, 1.6)
    for at in (-9, 0, 9):
        drawing.line(x + 10, y + at - 3, x + 10, y + at + 3, INK, 1.6)
    drawing.polyline([(x + 10, y - 9), (x + 18, y - 9), (x + 18, y - 20)])
    drawing.polyline([(x + 10, y + 9), (x + 18, y + 9), (x + 18, y + 20)])
    drawing.polyline([(x + 10, y), (x + 18, y), (x + 18, y + 9)])
    drawing.text(x + 24, y + 4, name, "start", 9, bold=True)


def application() -> str:
    drawing = Drawing(640, 404, "Application circuit: host line, sensor, clock, reset, stop contact, heater with two switches and a cut-out")
    # the chip
    drawing.rect(222, 30, 150, 320, PALE, INK)
    drawing.text(297, 122, "TC1", size=15, bold=True)
    left = {"uart_rx_i": 60, "uart_tx_o": 76, "uart_de_o": 92, "spi_cs_no": 150, "spi_sclk_o": 166, "spi_miso_i": 182, "spi_mosi_o": 198,
            "clk_i": 242, "rst_ni": 274, "addr_strap_i": 298, "test inputs": 322}
    right = {"safe_en_o": 66, "heater_fb_i": 150, "heater_o": 232, "inhibit_i": 276, "drop_i": 300, "fault_no": 318, "at_temp_o": 334}
    for name, y in left.items():
        drawing.line(206, y, 222, y)
        drawing.text(227, y + 3, name, "start", 9)
    for name, y in right.items():
        drawing.line(372, y, 388, y)
        drawing.text(367, y + 3, name, "end", 9)
    # host
    box(drawing, 96, 44, 88, 64, "Line driver", "RS-485, or", "USB UART", fill="white")
    for y in (60, 76, 92):
        drawing.line(184, y, 206, y)
    drawing.arrow([(96, 76), (54, 76)], both=True)
    drawing.text(50, 72, "host", "end", 9.5)
    drawing.text(50, 84, "A, B", "end", 8.5)
    drawing.text(140, 124, "USB UART: leave uart_de_o open", size=8.5)
    # sensor
    box(drawing, 96, 142, 88, 66, "Sensor IC", "MAX31855", "at 3.3 V", fill="white")
    for y in (150, 166, 182):
        drawing.line(184, y, 206, y)
    drawing.text(202, 220, "not MAX31855", "end", 8.5)
    drawing.polyline([(96, 160), (60, 160), (48, 175)])
    drawing.polyline([(96, 190), (60, 190), (48, 175)])
    drawing.circle(48, 175, 3, VERMILION, VERMILION)
    drawing.text(40, 172, "K", "end", 9)
    drawing.text(40, 184, "on head", "end", 8.5)
    # clock, reset, straps
    box(drawing, 120, 232, 64, 20, "12 MHz", fill="white")
    drawing.line(184, 242, 206, 242)
    box(drawing, 104, 260, 80, 28, "Supervisor", "of the supply", fill="white")
    drawing.line(184, 274, 206, 274)
    drawing.polyline([(206, 298), (190, 298), (190, 338)])
    drawing.polyline([(206, 322), (190, 322)])
    ground(drawing, 190, 338)
    # second switch: charge pump on safe_en_o
    drawing.line(388, 66, 402, 66)
    drawing.line(402, 57, 402, 75, INK, 1.6)
    drawing.line(406, 57, 406, 75, INK, 1.6)
    drawing.text(404, 51, "C1", size=8.5)
    drawing.line(406, 66, 420, 66)
    box(drawing, 420, 50, 84, 32, "Charge pump", fill="white")
    drawing.text(462, 96, "holds Q2 for about 1 ms", size=8.5)
    drawing.line(504, 66, 536, 66)
    drawing.line(554, 20, 554, 46)
    mosfet(drawing, 536, 66, "Q2")
    # supply, fuse, cut-out
    drawing.line(554, 20, 540, 20)
    drawing.rect(516, 15, 24, 10)
    drawing.text(528, 10, "fuse", size=8.5)
    drawing.line(516, 20, 484, 20)
    drawing.text(480, 23, "heater supply", "end", 9)
    drawing.line(554, 86, 554, 104)
    drawing.rect(547, 104, 14, 22)
    drawing.text(566, 112, "thermal cut-out", "start", 8.5, VERMILION)
    drawing.text(566, 123, "of its own", "start", 8.5, VERMILION)
    drawing.line(554, 126, 554, 138)
    # heater and its feedback
    drawing.rect(546, 138, 16, 44, "#fdeee2")
    drawing.text(568, 163, "heater", "start", 9)
    drawing.line(554, 182, 554, 212)
    drawing.circle(554, 133, 2)
    drawing.circle(554, 190, 2)
    box(drawing, 440, 138, 66, 44, "Opto-", "coupler", fill="white")
    drawing.polyline([(554, 133), (532, 133), (532, 148), (506, 148)])
    resistor(drawing, 519, 148, False, "R1")
    drawing.polyline([(506, 174), (532, 174), (532, 190), (554, 190)])
    drawing.line(388, 150, 440, 150)
    drawing.line(412, 150, 412, 162)
    drawing.circle(412, 150, 2)
    resistor(drawing, 412, 174, True, "10 k")
    drawing.line(412, 186, 412, 194)
    ground(drawing, 412, 194)
    drawing.text(440, 131, "3.3 V", "end", 8.5)
    drawing.polyline([(444, 128), (456, 128), (456, 138)])
    # first switch
    drawing.line(388, 232, 440, 232)
    resistor(drawing, 452, 232, False, "100")
    drawing.line(464, 232, 536, 232)
    mosfet(drawing, 536, 232, "Q1")
    drawing.line(554, 252, 554, 262)
    ground(drawing, 554, 262)
    drawing.circle(500, 232, 2)
    drawing.line(500, 232, 500, 238)
    resistor(drawing, 500, 250, True, "10 k")
    drawing.line(500, 262, 500, 266)
    ground(drawing, 500, 266)
    # stop contact, open when pressed
    drawing.line(388, 276, 434, 276)
    drawing.circle(410, 276, 2)
    drawing.circle(436, 276, 2, "white")
    drawing.circle(458, 276, 2, "white")
    drawing.line(438, 275, 456, 275, GREEN, 1.6)
    drawing.line(460, 276, 472, 276)
    ground(drawing, 472, 276)
    drawing.text(447, 292, "stop contact", size=8.5)
    drawing.line(410, 276, 410, 262)
    resistor(drawing, 410, 252, True, "")
    drawing.text(420, 258, "10 k", "start", 8.5)
    drawing.line(410, 240, 410, 238)
    drawing.text(400, 247, "3.3 V", "end", 8.5)
    drawing.arrow([(440, 300), (388, 300)])
    drawing.text(445, 303, "droplet trigger, or ground", "start", 8.5)
    drawing.arrow([(388, 318), (440, 318)])
    drawing.text(445, 321, "lamp, or the machine's controller", "start", 8.5)
    drawing.arrow([(388, 334), (440, 334)])
    drawing.text(445, 337, "the same: the print may begin", "start", 8.5)
    drawing.text(20, 376, "Ground of chip, sensor, line driver and heater is one. Close to each supply pin: 100 nF. Values are for pins of 3.3 V", "start", 9)
    drawing.text(20, 390, "and a heater of up to 60 W; the switch, its gate resistors and the pump follow from your heater.", "start", 9)
    return drawing.svg()
