# SPDX-License-Identifier: Apache-2.0
"""Arguments of a caller: right ones in the type that the C++ side takes, wrong ones as an exception of one line.

A value of a wrong type is a TypeError, a wrong value a UserError.
"""

from __future__ import annotations

import math
import operator
import os
import reprlib
from typing import Any, Collection

import numpy as np
import numpy.typing as npt

from .errors import UserError

MOST_CLOCKS = 2**62


def shown(value: object) -> str:
    """The value in a message: one line, short, whatever its repr is."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype}, shape {value.shape}"
    try:
        text = reprlib.repr(value)
    except Exception:  # a repr of somebody else
        text = f"a {type(value).__name__}"
    text = " ".join(text.split())
    return text if len(text) <= 80 else text[:77] + "..."


def wrong_type(name: str, value: object, expected: str) -> TypeError:
    return TypeError(f"{name}: found {shown(value)}, expected {expected}")


def wrong_value(name: str, value: object, expected: str) -> UserError:
    return refused(name, shown(value), expected)


def refused(name: str, found: str, expected: str) -> UserError:
    error = UserError(f"{name}: found {found}, expected {expected}")
    error.found = found
    error.expected = expected
    return error


def whole(name: str, value: Any, least: int, most: int) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        raise wrong_type(name, value, "a whole number") from None
    if not least <= number <= most:
        raise wrong_value(name, number, f"{least} to {most}")
    return number


def clocks(name: str, value: Any) -> int:
    return whole(name, value, 0, MOST_CLOCKS)


def number(name: str, value: Any, least: float = -math.inf, most: float = math.inf) -> float:
    """A finite number of the range; no text, no array of several."""
    if isinstance(value, (str, bytes, bytearray)) or value is np.ma.masked:
        raise wrong_type(name, value, "a number")
    try:
        found = float(value)
    except (TypeError, ValueError):
        raise wrong_type(name, value, "a number") from None
    except OverflowError:
        raise wrong_value(name, value, "a number that a double holds") from None
    if not math.isfinite(found):
        raise wrong_value(name, found, "a finite number")
    if not least <= found <= most:
        raise wrong_value(name, found, f"{least:g} to {most:g}")
    return found


def flag(name: str, value: object) -> bool:
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise wrong_type(name, value, "True or False")


def text(name: str, value: object) -> str:
    if not isinstance(value, str):
        raise wrong_type(name, value, "a str")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise wrong_value(name, value, "text that UTF-8 can hold") from None
    return value


def one_of(name: str, value: object, known: Collection[str]) -> str:
    word = text(name, value)
    if word not in known:
        raise wrong_value(name, value, f"one of {', '.join(known)}")
    return word


def path(name: str, value: Any) -> bytes:
    try:
        found = os.fsencode(value)
    except TypeError:
        raise wrong_type(name, value, "a path") from None
    except UnicodeEncodeError:
        raise wrong_value(name, value, "a path that the file system can hold") from None
    if not found or b"\0" in found:
        raise wrong_value(name, value, "a path")
    return found


def _array(name: str, value: npt.ArrayLike, expected: str) -> npt.NDArray[Any]:
    if np.ma.is_masked(value):  # type: ignore[no-untyped-call]  # np.asarray would take what the mask hides
        raise refused(name, "masked elements", "none; leave them out, or fill them")
    try:
        return np.asarray(value)
    except ValueError:
        raise wrong_type(name, value, expected) from None


def numbers(name: str, value: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Finite numbers in an array of any shape, in C order."""
    array = _array(name, value, "an array of numbers, all rows of one length")
    if array.size == 0 and array.dtype.kind in "fiu":
        return np.zeros(array.shape)
    if array.dtype.kind not in "fiu":
        raise wrong_type(name, value, "an array of numbers")
    found = np.ascontiguousarray(array, dtype=np.float64).reshape(array.shape)
    if not np.isfinite(found).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(found))[0])
        raise refused(f"{name}[{', '.join(map(str, place))}]", str(found[place]), "a finite number")
    return found


def vector(name: str, value: npt.ArrayLike, length: int) -> list[float]:
    found = numbers(name, value)
    if found.shape != (length,):
        raise refused(name, f"shape {found.shape}", f"{length} numbers")
    return [float(x) for x in found]


def points(name: str, value: npt.ArrayLike, columns: int) -> npt.NDArray[np.float64]:
    """Points, a row each."""
    found = numbers(name, value)
    if found.ndim != 2 or found.shape[1] != columns:
        raise refused(name, f"shape {found.shape}", f"shape (n, {columns})")
    return found


def cycles(name: str, value: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Whole numbers from 0 on, in an array of any shape."""
    array = _array(name, value, "an array of whole numbers")
    if array.dtype.kind not in "iu":
        raise wrong_type(name, value, "an array of whole numbers")
    if array.size and (array.min() < 0 or array.max() > MOST_CLOCKS):
        worst = int(array.min()) if array.min() < 0 else int(array.max())
        raise wrong_value(name, worst, f"cycles of 0 to {MOST_CLOCKS}")
    return array.astype(np.int64)


def levels(name: str, value: npt.ArrayLike, width: int) -> npt.NDArray[np.uint8]:
    """Levels of a pin of `width` bits, one a clock."""
    array = _array(name, value, "an array of levels")
    if array.dtype.kind not in "iub":
        raise wrong_type(name, value, "an array of whole numbers or bools")
    if array.ndim != 1:
        raise refused(name, f"shape {array.shape}", "a level a clock, shape (n,)")
    if array.size and (array.min() < 0 or array.max() >= 1 << width):
        worst = int(array.min()) if array.min() < 0 else int(array.max())
        raise wrong_value(name, worst, f"levels of 0 to {(1 << width) - 1}")
    return array.astype(np.uint8)
