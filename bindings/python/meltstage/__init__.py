# SPDX-License-Identifier: Apache-2.0
"""Meltstage: the model of a print-head temperature controller, its bench, recordings of its pins, and motion.

`Run` and `play()` heat the chip on a simulated head, `Chip` is the bare model, `read_bumps()`, `plan_tour()` and the
other `plan_...` move a stage, `read_recording()` reads pins and replays them. A name has its unit behind it. What the
caller can put right is a `UserError`, a value of a wrong type a TypeError, each with a message of one line.
"""

from ._core import __version__
from .chip import Chip, Flops, Inputs, Outputs
from .errors import Refused, UserError
from .motion import (
    AxesMotion,
    Bumps,
    Limits,
    LimitsOfAxes,
    Motion,
    Profile,
    Segments,
    State,
    Tour,
    plan_arrival,
    plan_line,
    plan_scurve,
    plan_stop,
    plan_through,
    plan_to_speed,
    plan_to_state,
    plan_together,
    plan_tour,
    read_bumps,
)
from .recording import Changes, Mismatch, Recording, Replay, Signal, read_recording
from .run import EVENTS, LogEntry, Run, play
from .spec import CLOCK_HZ, COMMANDS, FAULTS, PINS, REGISTERS, STATES, Pin, Register

__all__ = [
    "AxesMotion",
    "Bumps",
    "CLOCK_HZ",
    "COMMANDS",
    "Changes",
    "Chip",
    "EVENTS",
    "FAULTS",
    "Flops",
    "Inputs",
    "Limits",
    "LimitsOfAxes",
    "LogEntry",
    "Mismatch",
    "Motion",
    "Outputs",
    "PINS",
    "Pin",
    "Profile",
    "REGISTERS",
    "Recording",
    "Refused",
    "Register",
    "Replay",
    "Run",
    "STATES",
    "Segments",
    "Signal",
    "State",
    "Tour",
    "UserError",
    "__version__",
    "plan_arrival",
    "plan_line",
    "plan_scurve",
    "plan_stop",
    "plan_through",
    "plan_to_speed",
    "plan_to_state",
    "plan_together",
    "plan_tour",
    "play",
    "read_bumps",
    "read_recording",
]
