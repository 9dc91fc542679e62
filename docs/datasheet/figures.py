# SPDX-License-Identifier: Apache-2.0
"""The sheet's figures, and the numbers beside them: all from runs."""
import csv
import dataclasses
import pathlib

import diagrams
import measured
from chart import Curve, chart
from drawing import BLUE, GREEN, INK, VERMILION
from timing_diagram import TimingDiagram
from waves import Waves

SET_POINT = 110.0
BAND = 0.02 * SET_POINT   # as docs/chip/control.md judges settling
LOAD_BEGIN, LOAD_END = 600.0, 900.0
SLIP = 400.0
TUNE = 300.0
# Moments of scenarios/timing.txt, s.
PULSED, ASKED, STOPPED, OPENED = 1.15, 1.2, 1.5, 2.35


@dataclasses.dataclass
class Length:
    symbol: str
    begin: str
    end: str
    clocks: int


class Timing:
    """Of the pins of scenarios/timing.txt."""

    def __init__(self, waves: Waves, spec: dict, registers: dict[str, dict]) -> None:
        self.waves, self.registers = waves, registers
        self.preset = spec["preset"][registers["SENS_TYPE"]["reset"] - 1]
        at = waves.clock_at
        self.spi = measured.spi_read(waves, at(ASKED))
        self.uart = measured.exchange(waves, at(ASKED), registers["BAUD"]["reset"] * 100)
        self.pulses = measured.pulses(waves, at(PULSED))
        self.stop = measured.emergency_stop(waves, at(STOPPED))
        self.opens = measured.sensor_opens(waves, at(OPENED), registers["BAD_MAX"]["reset"])

    def lengths(self) -> list[Length]:
        spi, uart, pulses, stop, opens = self.spi, self.uart, self.pulses, self.stop, self.opens
        answer = uart.answer[0].start
        last_read = opens.reads[-1].end
        return [
            Length("t_lead", "spi_cs_no falls", "spi_sclk_o rises", spi.lead),
            Length("t_high", "spi_sclk_o rises", "spi_sclk_o falls", spi.half),
            Length("t_sclk", "spi_sclk_o rises", "spi_sclk_o rises", spi.period),
            Length("t_tail", "last fall of spi_sclk_o", "spi_cs_no rises", spi.tail),
            Length("t_read", "spi_cs_no falls", "spi_cs_no rises", spi.end - spi.begin),
            Length("t_turn", "end of the request's last stop bit", "first start bit of the answer", round(answer - uart.request_end)),
            Length("t_de_on", "uart_de_o rises", "first start bit of the answer", answer - uart.driver_on),
            Length("t_de_off", "end of the answer's last stop bit", "uart_de_o falls", round(uart.driver_off - uart.answer_end)),
            Length("t_pwm", "heater_o rises", "heater_o rises", pulses.period),
            Length("t_on", "heater_o rises", "heater_o falls, duty 30 %", pulses.high),
            Length("t_enable", "safe_en_o changes", "safe_en_o changes", pulses.enable),
            Length("t_stop", "inhibit_i rises", "heater_o falls", stop.heater_off - stop.inhibit),
            Length("t_latch", "inhibit_i rises", "fault_no falls", stop.fault - stop.inhibit),
            Length("t_off", "spi_cs_no rises after the last bad frame", "heater_o falls", opens.heater_off - last_read),
            Length("t_fault", "spi_cs_no rises after the last bad frame", "fault_no falls", opens.fault - last_read),
        ]

    def degc(self, word: int) -> float:
        """Of a frame of the sensor, by its preset."""
        field = word >> self.preset["lsb"] & (1 << self.preset["width"]) - 1
        if self.preset["signed"] and field >> self.preset["width"] - 1:
            field -= 1 << self.preset["width"]
        return (field * self.preset["scale"] // 256 + self.preset["offset"]) / 64

    def context(self) -> dict:
        answer = [character.byte for character in self.uart.answer]
        tenths = int.from_bytes(bytes(answer[3:5]), "big", signed=True)
        return {"lengths": self.lengths(), "pulses": self.pulses, "spi": self.spi, "spi_part": self.preset["name"], "spi_degc": f"{self.degc(self.spi.word):.2f}",
                "uart_degc": f"{tenths * self.registers['PV']['scale_value']:.1f}"}

    def drawn(self) -> dict[str, str]:
        return {"spi": self.draw_spi(), "spi_start": self.draw_spi_start(), "uart": self.draw_uart(), "pwm": self.draw_pwm(), "stop": self.draw_stop(),
                "opens": self.draw_opens(), "opens_end": self.draw_opens_end()}

    def diagram(self, begin: float, end: float, zero: float, unit: str, label: str) -> TimingDiagram:
        clocks = self.waves.clock_hz / {"ms": 1e3, "µs": 1e6}[unit]
        return TimingDiagram(self.waves, begin, end, zero, (unit, clocks), label)

    def bits(self) -> list[tuple[float, float, str]]:
        """Each bit of the frame where it is on the line."""
        rises, word, count = self.spi.rises, self.spi.word, len(self.spi.rises)
        return [(rise - self.spi.period / 2, rise + self.spi.period / 2, str(word >> count - 1 - i & 1)) for i, rise in enumerate(rises)]

    def draw_spi(self) -> str:
        spi = self.spi
        diagram = self.diagram(spi.begin - 14, spi.end + 22, spi.begin, "µs", "Read of the sensor, whole frame")
        diagram.lengths((spi.begin, spi.end, f"t_read {spi.end - spi.begin} clocks")).pin("spi_cs_no").pin("spi_sclk_o").pin("spi_miso_i")
        return diagram.cells("bit", self.bits()).pin("spi_mosi_o").svg()

    def draw_spi_start(self) -> str:
        spi = self.spi
        diagram = self.diagram(spi.begin - 20, spi.rises[6] + 3, spi.begin, "µs", "Read of the sensor, first bits")
        diagram.lengths((spi.begin, spi.rises[0], f"t_lead {spi.lead}"), (spi.rises[3], spi.rises[3] + spi.half, f"t_high {spi.half}"))
        diagram.pin("spi_cs_no").pin("spi_sclk_o").lengths((spi.rises[1], spi.rises[2], f"t_sclk {spi.period} clocks"))
        return diagram.pin("spi_miso_i").svg()

    def draw_uart(self) -> str:
        uart = self.uart
        first, end = uart.request[0].start, uart.driver_off
        width = measured.CHARACTER_BITS * uart.bit

        def bytes_of(characters: list[measured.Character]) -> list[tuple[float, float, str]]:
            return [(c.start, c.start + width, f"{c.byte:02X}") for c in characters]

        answer = uart.answer[0].start
        turn, lead = round(answer - uart.request_end), answer - uart.driver_on
        diagram = self.diagram(first - 500, end + 900, first, "ms", "Request and answer on the serial line")
        diagram.cells("request", bytes_of(uart.request)).pin("uart_rx_i").lengths((uart.request_end, answer, f"t_turn {turn} clocks"))
        diagram.pin("uart_de_o").lengths((uart.driver_on, answer, f"t_de_on {lead} clocks")).pin("uart_tx_o")
        return diagram.cells("answer", bytes_of(uart.answer)).svg()

    def draw_pwm(self) -> str:
        pulses = self.pulses
        begin = pulses.begin
        toggles = [clock for clock, _ in self.waves.edges("safe_en_o", begin + pulses.period, begin + 3 * pulses.period)]
        diagram = self.diagram(begin - 900, begin + 2 * pulses.period + 5000, begin, "ms", "Pulses of the heater and the safe enable")
        diagram.lengths((begin, begin + pulses.period, f"t_pwm {pulses.period} clocks")).pin("heater_o")
        diagram.lengths((begin, begin + pulses.high, f"t_on {pulses.high} clocks"), (toggles[4], toggles[5], f"t_enable {pulses.enable} clocks"))
        return diagram.pin("safe_en_o").svg()

    def draw_stop(self) -> str:
        stop = self.stop
        diagram = self.diagram(stop.inhibit - 12, stop.inhibit + 22, stop.inhibit, "µs", "Emergency stop")
        diagram.pin("inhibit_i").lengths((stop.inhibit, stop.heater_off, f"t_stop {stop.heater_off - stop.inhibit} clocks")).pin("heater_o")
        return diagram.lengths((stop.inhibit, stop.fault, f"t_latch {stop.fault - stop.inhibit} clocks")).pin("fault_no").svg()

    def draw_opens(self) -> str:
        opens = self.opens
        first, tick = opens.reads[0].begin, opens.reads[1].begin - opens.reads[0].begin
        diagram = self.diagram(first - tick * 0.6, opens.fault + tick * 0.5, first, "ms", "Sensor opens, heater off")
        reads = [(read.begin - tick * 0.2, read.begin + tick * 0.2, f"refused {i + 1}") for i, read in enumerate(opens.reads)]
        return diagram.pin("spi_cs_no").cells("sample", reads).pin("heater_o").pin("safe_en_o").pin("fault_no").svg()

    def draw_opens_end(self) -> str:
        opens = self.opens
        end = opens.reads[-1].end
        diagram = self.diagram(opens.reads[-1].rises[-3] - 8, end + 22, end, "µs", "End of the last refused read")
        diagram.pin("spi_sclk_o").pin("spi_cs_no").lengths((end, opens.heater_off, f"t_off {opens.heater_off - end} clocks"))
        return diagram.pin("heater_o").pin("fault_no").svg()


class Curves:
    """Of the traces of the other scenarios."""

    def __init__(self, runs: pathlib.Path, faults: list[dict]) -> None:
        self.faults = faults
        self.rise, self.announced, self.slips, self.tune = (read_trace(runs / f"{name}.csv") for name in ("rise", "announced", "slips", "tune"))

    def numbers(self) -> dict[str, str]:
        before = [row for row in self.rise if row["time_s"] < LOAD_BEGIN]
        outside = [row["time_s"] for row in before if abs(row["block_degc"] - SET_POINT) > BAND]
        fault = next((row for row in self.slips if row["faults"]), None)
        if fault is None or not outside:
            raise ValueError("runs/slips.csv, runs/rise.csv: found no fault or no heat-up, expected them: another scenario?")
        return {
            "settled": f"{outside[-1]:.0f}", "highest": f"{max(row['block_degc'] for row in before):.2f}",
            "hold_duty": f"{mean(before[-600:], 'duty_percent'):.1f}",
            "dip": dip(self.rise), "dip_announced": dip(self.announced),
            "slip_after": f"{fault['time_s'] - SLIP:.1f}", "slip_fault": self.faults[(int(fault["faults"]) & -int(fault["faults"])).bit_length() - 1]["name"],
            "slip_peak": f"{max(row['block_degc'] for row in self.slips if row['time_s'] > SLIP):.1f}",
        }

    def drawn(self) -> dict[str, str]:
        def of(rows: list[dict], key: str) -> list[tuple[float, float]]:
            return [(row["time_s"], row[key]) for row in rows if row[key] is not None]
        seconds, degrees = "time, s", "temperature, °C"
        set_point = Curve("set-point", [(5.0 * i, SET_POINT) for i in range(241)], INK, "5 3")
        return {
            "rise": chart("Heat-up from cold to 110 degrees", seconds, degrees,
                          [Curve("block", of(self.rise, "block_degc"), BLUE), Curve("heater element", of(self.rise, "heater_degc"), VERMILION, "2 2"), set_point],
                          (0, 600), (20, 180)),
            "duty": chart("Duty in the same run", seconds, "duty, %", [Curve("duty", of(self.rise, "duty_percent"), BLUE)], (0, 600), (0, 105), 150),
            "load": chart("A load by droplets with and without its announcement", seconds, degrees,
                          [Curve("feedback alone", of(self.rise, "block_degc"), VERMILION, "4 2"), Curve("with FF_EXT", of(self.announced, "block_degc"), BLUE), set_point],
                          (550, 1150), (108.5, 111.5), marks=((LOAD_BEGIN, "load on"), (LOAD_END, "load off"))),
            "slips": chart("Sensor slips out of its seat", seconds, degrees,
                           [Curve("reading", of(self.slips, "reading_degc"), VERMILION), Curve("block", of(self.slips, "block_degc"), BLUE),
                            Curve("heater element", of(self.slips, "heater_degc"), GREEN, "2 2")],
                           (380, 440), (20, 150), marks=((SLIP, "slips"),)),
            "tune": chart("Self-tuning", seconds, degrees, [Curve("block", of(self.tune, "block_degc"), BLUE), set_point], (250, 1000), (106, 114),
                          150, marks=((TUNE, "Tune"),)),
        }


def still(spec: dict) -> dict[str, str]:
    return {"blocks": diagrams.blocks(), "states": diagrams.states(spec["state"]), "application": diagrams.application()}


def read_trace(path: pathlib.Path) -> list[dict]:
    with path.open(encoding="ascii", newline="") as file:
        return [{key: (float(text) if text else None) if key not in ("state", "pins_hash") else text for key, text in row.items()}
                for row in csv.DictReader(file)]


def mean(rows: list[dict], key: str) -> float:
    return sum(row[key] for row in rows) / len(rows)


def dip(rows: list[dict]) -> str:
    return f"{SET_POINT - min(row['block_degc'] for row in rows if LOAD_BEGIN <= row['time_s'] <= LOAD_END):.2f}"
