# SPDX-License-Identifier: Apache-2.0
"""What goes wrong, as exceptions."""

from __future__ import annotations


class UserError(ValueError):
    """Something that the caller can put right: a wrong value, file or scenario.

    The message is one line: what, where, found, expected. Where they are known, the parts are there as well:
    `line` and `column` (from 1) of a scenario or file, `found` and `expected`; otherwise they are None.
    """

    line: int | None = None
    column: int | None = None
    found: str | None = None
    expected: str | None = None


class Refused(RuntimeError):
    """The chip answered a host's request with an exception code of Modbus, which is `code`."""

    code: int = 0


for _error in (UserError, Refused):
    _error.__module__ = "meltstage"
