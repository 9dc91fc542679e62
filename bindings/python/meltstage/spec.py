# SPDX-License-Identifier: Apache-2.0
"""What the chip is: pins, registers, flops, states and faults by name."""

from __future__ import annotations

import difflib
from types import MappingProxyType
from typing import Iterable, Mapping, NamedTuple

from . import _core
from ._check import text
from .errors import UserError


class Pin(NamedTuple):
    """A pin of the chip."""

    name: str
    width: int  # bits
    output: bool


class Register(NamedTuple):
    """A register of the chip; docs/chip/registers.md says what it does."""

    name: str
    unit: str  # empty: a plain number, or bits
    address: int  # of Modbus (PDU)
    scale: float  # one step of the register, in the unit
    is_signed: bool
    readable: bool
    writable: bool
    least: float  # in the unit; both 0 for a register that is only read
    greatest: float


def _register(
    name: str, unit: str, address: int, scale: float, is_signed: bool, readable: bool, writable: bool, least: int, greatest: int
) -> Register:
    return Register(name, unit, address, scale, is_signed, readable, writable, least * scale, greatest * scale)


CLOCK_HZ: int = _core.CLOCK_HZ
"""The chip's clock, in Hz."""
PINS: Mapping[str, Pin] = MappingProxyType({pin[0]: Pin(*pin) for pin in _core.PINS})
"""The chip's pins by name: inputs, then outputs."""
REGISTERS: Mapping[str, Register] = MappingProxyType({reg[0]: _register(*reg) for reg in _core.REGISTERS})
"""The chip's registers by name."""
STATES: Mapping[int, str] = MappingProxyType(_core.STATES)
"""Names of the states of the main state machine by their codes."""
COMMANDS: Mapping[str, int] = MappingProxyType(_core.COMMANDS)
"""What register CMD takes, by the words of a scenario: "run", "stop" and so on."""
FAULTS: Mapping[str, str] = MappingProxyType(dict(_core.FAULTS))
"""The faults in the order of their bits in FAULT and CAUSE, and what each one says."""


def near(word: object, known: Iterable[str]) -> str:
    """Names that the word may have meant, for a message."""
    if not isinstance(word, str):
        word = ""
    names = list(known)
    close = difflib.get_close_matches(word.lower(), [name.lower() for name in names], 3, 0.5)
    found = [name for name in names if name.lower() in close] or names[:3] + ["..."]
    return ", ".join(found)


def find_register(name: object) -> Register:
    """The register of that name, in capitals or not. Raises UserError that names near ones."""
    word = text("register", name)
    register = REGISTERS.get(word.upper())
    if register is None:
        raise UserError(f"register: found {word[:60]!r}, expected a name such as {near(word, REGISTERS)}")
    return register
