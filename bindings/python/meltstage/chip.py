# SPDX-License-Identifier: Apache-2.0
"""The bit-accurate model of the chip."""

from __future__ import annotations

import math
from typing import Any, Iterator, Mapping

import numpy as np
import numpy.typing as npt

from . import _core
from . import _check as check
from .errors import UserError
from .spec import COMMANDS, PINS, STATES, Register, find_register, near

_NUMBERS = {name: number for number, name in enumerate(PINS)}
_INPUTS = [name for name, pin in PINS.items() if not pin.output]
_OUTPUTS = [name for name, pin in PINS.items() if pin.output]
_OUTPUT_ROW = np.dtype([(name, np.uint8) for name in _OUTPUTS])
_FLOPS = {name: (place, changeable) for name, place, changeable in _core.FLOPS}
_NO_READING = _core.PV_NONE  # PV before the first sample


def _unknown_pin(name: str, known: list[str]) -> AttributeError:
    return AttributeError(f"pin: found {name!r}, expected one of {', '.join(known)}")


class Outputs:
    """Levels of a chip's output pins now, as attributes by the names of `PINS`: `chip.outputs.heater_o`."""

    __slots__ = ("_chip",)
    _chip: _core.Chip

    def __init__(self, chip: _core.Chip) -> None:
        object.__setattr__(self, "_chip", chip)

    def __getattr__(self, name: str) -> int:
        if name not in _OUTPUTS:
            raise _unknown_pin(name, _OUTPUTS)
        return self._chip.pin(_NUMBERS[name])

    def __setattr__(self, name: str, level: Any) -> None:
        raise AttributeError(f"pin: found a level for {name!r}, expected one for an input; the chip drives its outputs")

    def __dir__(self) -> list[str]:
        return list(_OUTPUTS)

    def __repr__(self) -> str:
        return f"Outputs({', '.join(f'{name}={getattr(self, name)}' for name in _OUTPUTS)})"


class Inputs:
    """Levels that stand at a chip's input pins, as attributes to read and set: `chip.inputs.inhibit_i = 1`.

    Names and widths are those of `PINS`. Setting a pin moves no clock; the chip sees it at its next one.
    """

    __slots__ = ("_chip",)
    _chip: _core.Chip

    def __init__(self, chip: _core.Chip) -> None:
        object.__setattr__(self, "_chip", chip)

    def __getattr__(self, name: str) -> int:
        if name not in _INPUTS:
            raise _unknown_pin(name, _INPUTS)
        return self._chip.pin(_NUMBERS[name])

    def __setattr__(self, name: str, level: Any) -> None:
        if name not in _INPUTS:
            raise _unknown_pin(name, _INPUTS)
        self._chip.set_pin(_NUMBERS[name], check.whole(name, level, 0, (1 << PINS[name].width) - 1))

    def __dir__(self) -> list[str]:
        return list(_INPUTS)

    def __repr__(self) -> str:
        return f"Inputs({', '.join(f'{name}={getattr(self, name)}' for name in _INPUTS)})"


class Flops(Mapping[str, int]):
    """A chip's flops by name, as numbers without sign: `chip.flops["guard.run_q"]`.

    Setting one is what a particle does: nothing else moves. A value with a bit that is no flop is a UserError.
    """

    __slots__ = ("_chip",)

    def __init__(self, chip: _core.Chip) -> None:
        self._chip = chip

    def __getitem__(self, name: str) -> int:
        return self._chip.flop(self._find(name)[0])

    def __setitem__(self, name: str, value: int) -> None:
        place, changeable = self._find(name)
        bits = check.whole(name, value, 0, 2**64 - 1)
        if bits & ~changeable:
            raise check.refused(name, hex(bits), f"bits of {changeable:#x} alone")
        self._chip.set_flops([(place, bits)])

    def __iter__(self) -> Iterator[str]:
        return iter(_FLOPS)

    def __len__(self) -> int:
        return len(_FLOPS)

    def __repr__(self) -> str:
        return f"<{len(self)} flops>"

    @staticmethod
    def _find(name: object) -> tuple[int, int]:
        found = _FLOPS.get(name) if isinstance(name, str) else None
        if found is None:
            raise KeyError(f"flop: found {check.shown(name)}, expected a name such as {near(name, _FLOPS)}")
        return found


class Chip:
    """The whole chip, exact at every clock: the same pins, flops and timing as the RTL.

    A new chip has its flops in reset and its pins at rest, reset released: after some clocks it runs. Threads
    may step chips of their own at the same time; one chip is used by one thread at a time, and a second one gets
    a RuntimeError. `copy.copy()`, `pickle` and `==` take the whole state: flops, input pins and `cycle`.
    """

    __slots__ = ("_chip",)

    def __init__(self) -> None:
        self._chip = _core.Chip()

    # ---- clocks ----

    def step(self, clocks: int = 1) -> None:
        """Clocks the chip, one clock after the other, with the input pins as they stand.

        The interpreter is free for other threads meanwhile, and Ctrl-C ends it between two clocks.
        """
        self._chip.step(check.clocks("clocks", clocks))

    def advance(self, clocks: int) -> None:
        """Like `step()`, with the same state at the end, in a fraction of its time.

        The model leaves out clocks in which it only counts.
        """
        self._chip.advance(check.clocks("clocks", clocks))

    def drive(self, **levels: npt.ArrayLike) -> npt.NDArray[np.void]:
        """Clocks the chip with a level a clock for each pin that is named: `drive(uart_rx_i=[1, 1, 0])`.

        The arrays are all of one length n, of whole numbers or bools. Pins that aren't named stand. Returns a
        structured array of n rows, a field each output pin: its level behind that clock. Afterwards the inputs
        stay as the last row left them.
        """
        if not levels:
            raise UserError("drive: found no pin, expected a level a clock for one at least")
        columns = []
        for name, given in levels.items():
            if name not in _INPUTS:
                raise UserError(f"pin: found {name!r}, expected one of {', '.join(_INPUTS)}")
            columns.append(check.levels(name, given, PINS[name].width))
        lengths = {column.size for column in columns}
        if len(lengths) != 1:
            raise UserError(f"drive: found arrays of {sorted(lengths)} clocks, expected all of one length")
        made = self._chip.drive([_NUMBERS[name] for name in levels], np.ascontiguousarray(np.stack(columns, axis=1)))
        rows: npt.NDArray[np.void] = made.view(_OUTPUT_ROW)[:, 0] if made.size else np.zeros(0, _OUTPUT_ROW)
        return rows

    @property
    def cycle(self) -> int:
        """Clocks since the chip was made."""
        return self._chip.cycle

    # ---- pins ----

    @property
    def inputs(self) -> Inputs:
        """The input pins, to read and set."""
        return Inputs(self._chip)

    @property
    def outputs(self) -> Outputs:
        """The output pins."""
        return Outputs(self._chip)

    # ---- registers ----

    def peek(self, register: str) -> float:
        """The register's value in its unit, looked at without being a host: nothing in the chip moves.

        NaN for PV before the first sample. Raises UserError for a name that isn't one of `REGISTERS`.
        """
        reg = find_register(register)
        if not reg.readable:
            raise UserError(f"register: found {reg.name}, expected one that can be read")
        return _value(reg, self._chip.peek(reg.address))

    def read(self, register: str) -> float:
        """As `peek()`, but as a host on the serial line does it: it counts as a message and feeds the host watchdog.

        Raises `Refused` while the chip is in reset.
        """
        reg = find_register(register)
        if not reg.readable:
            raise UserError(f"register: found {reg.name}, expected one that can be read")
        return _value(reg, self._chip.host_read(reg.address, f"read {reg.name}"))

    def write(self, register: str, value: float) -> None:
        """Writes a value, in the register's unit and to its nearest step, as a host on the serial line does it.

        Raises UserError for a value that the register can't hold, and `Refused` when the chip does. What is
        written acts at the chip's next clock, a setting at its next control tick.
        """
        reg = find_register(register)
        given = check.number(reg.name, value)
        if not reg.writable:
            raise UserError(f"register: found {reg.name}, expected one that can be written")
        word, expected = _core.register_word(reg.address, given)
        if expected:
            raise check.wrong_value(reg.name, given, expected)
        self._chip.host_write(reg.address, word, f"write {reg.name}")

    def command(self, word: str) -> None:
        """Writes a command to register CMD: one of `COMMANDS`, "run" or "stop" for example. Raises as `write()`."""
        self.write("CMD", COMMANDS[check.one_of("command", word, COMMANDS)])

    # ---- inside ----

    @property
    def state(self) -> str:
        """Name of the main state machine's state; "illegal" for a code that none has."""
        return STATES.get(self._chip.state, "illegal")

    @property
    def fault(self) -> str:
        """The fault that latched first: what was measured, the limit, what to do next. Empty without a fault."""
        return self._chip.fault()

    @property
    def flops(self) -> Flops:
        """Every flop by name, to read and set."""
        return Flops(self._chip)

    def differences(self, other: Chip) -> dict[str, tuple[int, int]]:
        """The flops in which this chip and another one differ, with the value of each."""
        if not isinstance(other, Chip):
            raise check.wrong_type("other", other, "a Chip")
        if other._chip is self._chip:
            return {}
        return {name: (one, two) for name, one, two in self._chip.differences(other._chip)}

    # ---- the whole state ----

    def __copy__(self) -> Chip:
        return Chip._of(self._chip.copy())

    def __deepcopy__(self, memo: dict[int, Any]) -> Chip:
        return self.__copy__()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Chip):
            return NotImplemented
        return self.cycle == other.cycle and _levels(self) == _levels(other) and not self.differences(other)

    __hash__ = None  # type: ignore[assignment]

    def __getstate__(self) -> dict[str, Any]:
        return {"flops": dict(self.flops), "inputs": _levels(self), "cycle": self.cycle}

    def __setstate__(self, state: dict[str, Any]) -> None:
        flops, inputs = (state.get(part) if isinstance(state, dict) else None for part in ("flops", "inputs"))
        if not isinstance(flops, dict) or not isinstance(inputs, dict) or set(flops) != set(_FLOPS) or set(inputs) != set(_INPUTS):
            raise UserError("pickle: found a damaged chip or one of another version, expected one with the flops and pins of this one")
        self._chip = _core.Chip()
        values = {name: check.whole(f"pickle: {name}", value, 0, 2**64 - 1) for name, value in flops.items()}
        self._chip.set_flops([(_FLOPS[name][0], value) for name, value in values.items()])
        for name, level in inputs.items():
            setattr(self.inputs, name, level)
        self._chip.cycle = check.clocks("pickle: cycle", state.get("cycle"))
        for name, value in values.items():
            if self.flops[name] != value:
                raise UserError(f"pickle: {name}: found {value}, expected a number that the flop can hold")

    def __repr__(self) -> str:
        return f"<Chip: cycle {self.cycle}, {self.state}>"

    @staticmethod
    def _of(core: _core.Chip) -> Chip:
        made = Chip.__new__(Chip)
        made._chip = core
        return made


def _levels(chip: Chip) -> dict[str, int]:
    return {name: getattr(chip.inputs, name) for name in _INPUTS}


def _value(register: Register, word: int) -> float:
    if register.name == "PV" and word == _NO_READING:
        return math.nan
    return (word - 0x10000 if register.is_signed and word >= 0x8000 else word) * register.scale
