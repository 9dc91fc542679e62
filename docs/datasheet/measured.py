# SPDX-License-Identifier: Apache-2.0
"""What the timing diagrams say in numbers, each read from the pins of a run. Lengths are clocks."""
import dataclasses

from waves import Waves

CHARACTER_BITS = 11  # 8E1, the format of reset


@dataclasses.dataclass
class SpiRead:
    begin: int           # chip select falls
    end: int             # and rises
    rises: list[int]     # of the clock
    word: int            # as it stands on spi_miso_i at these
    lead: int            # chip select low to the first rise
    half: int            # of a period of the clock: high
    tail: int            # last fall of the clock to chip select high

    @property
    def period(self) -> int:
        return self.rises[1] - self.rises[0]


def spi_read(waves: Waves, after: int) -> SpiRead:
    begin = waves.next_edge("spi_cs_no", after, 0)
    end = waves.next_edge("spi_cs_no", begin, 1)
    edges = waves.edges("spi_sclk_o", begin, end)
    rises = [clock for clock, level in edges if level]
    word = 0
    for clock in rises:
        word = word << 1 | waves.level("spi_miso_i", clock)
    return SpiRead(begin, end, rises, word, rises[0] - begin, edges[1][0] - edges[0][0], end - edges[-1][0])


@dataclasses.dataclass
class Character:
    start: int  # of its start bit
    byte: int


@dataclasses.dataclass
class Exchange:
    """A request of the host and the chip's answer."""

    bit: float                  # clocks
    request: list[Character]
    answer: list[Character]
    driver_on: int
    driver_off: int

    @property
    def request_end(self) -> float:
        return self.request[-1].start + CHARACTER_BITS * self.bit

    @property
    def answer_end(self) -> float:
        return self.answer[-1].start + CHARACTER_BITS * self.bit


def characters(waves: Waves, pin: str, begin: int, end: int, bit: float) -> list[Character]:
    """What stands on a serial line, by the middle of each bit. A stop bit that is low or wrong parity is no character."""
    found = []
    clock = begin
    while True:
        starts = [at for at, level in waves.edges(pin, clock, end) if level == 0]
        if not starts:
            return found
        bits = [waves.level(pin, round(starts[0] + (i + 0.5) * bit)) for i in range(CHARACTER_BITS)]
        if bits[0] or not bits[10] or sum(bits[1:10]) % 2:
            raise ValueError(f"{pin}: found no character of 8E1 at clock {starts[0]}, expected one")
        found.append(Character(starts[0], sum(level << i for i, level in enumerate(bits[1:9]))))
        clock = round(starts[0] + (CHARACTER_BITS - 0.5) * bit)


def exchange(waves: Waves, after: int, baud: int) -> Exchange:
    bit = waves.clock_hz / baud
    driver_on = waves.next_edge("uart_de_o", after, 1)
    driver_off = waves.next_edge("uart_de_o", driver_on, 0)
    return Exchange(bit, characters(waves, "uart_rx_i", after, driver_on, bit), characters(waves, "uart_tx_o", driver_on, driver_off, bit),
                    driver_on, driver_off)


@dataclasses.dataclass
class Pulses:
    """The heater's PWM and the safe enable beside it."""

    begin: int    # a period's first clock
    period: int
    high: int
    enable: int   # clocks between two changes of safe_en_o


def pulses(waves: Waves, after: int) -> Pulses:
    begin = waves.next_edge("heater_o", after, 1)
    low = waves.next_edge("heater_o", begin, 0)
    toggles = [clock for clock, _ in waves.edges("safe_en_o", begin, low)]
    return Pulses(begin, waves.next_edge("heater_o", low, 1) - begin, low - begin, toggles[1] - toggles[0])


@dataclasses.dataclass
class SensorOpens:
    reads: list[SpiRead]  # those refused
    heater_off: int
    enable_stops: int     # last change of safe_en_o
    fault: int            # fault_no falls


def sensor_opens(waves: Waves, after: int, bad_max: int) -> SensorOpens:
    fault = waves.next_edge("fault_no", after, 0)
    reads, clock = [], after
    for _ in range(bad_max):
        reads.append(spi_read(waves, clock))
        clock = reads[-1].end
    heater_off = waves.next_edge("heater_o", clock, 0)
    stops = max(waves.last_edge("safe_en_o", fault + waves.clock_hz, level) for level in (0, 1))
    return SensorOpens(reads, heater_off, stops, fault)


@dataclasses.dataclass
class Stop:
    """The emergency stop."""

    inhibit: int
    heater_off: int
    fault: int


def emergency_stop(waves: Waves, after: int) -> Stop:
    inhibit = waves.next_edge("inhibit_i", after, 1)
    return Stop(inhibit, waves.next_edge("heater_o", inhibit, 0), waves.next_edge("fault_no", inhibit, 0))
