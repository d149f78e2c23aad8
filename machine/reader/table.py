"""Table: the rows of a reader as they come, in columns that a kernel can write to."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.gcode.modes import E_AXIS
from mdp.mesh import Floats

REMARK_COLUMNS = 6  # columns of remark_rows: part, layer, type, width, height, acceleration
ROOM = 1024  # remarks


class Columns(NamedTuple):
    """Room for rows, one an entry. places: (room + 1, 5), row k ends at k + 1; starts: (room, 5) begins of rows, (0, 5) as long
    as each begins at the end of the one before it, as nearly always; remark_rows: (k, REMARK_COLUMNS) room for remarks.
    """

    line: NDArray[np.int32]
    e_mm: Floats
    feed: Floats
    remark: NDArray[np.int32]
    places: Floats
    starts: Floats
    remark_rows: Floats


class Table:
    """The rows so far, and what comments and M204 say of them: rows that follow each other often share a remark."""

    def __init__(self, room: int) -> None:
        self.rows = self.remarks = 0
        self.columns = Columns(
            np.empty(room, np.int32), np.empty(room), np.empty(room), np.empty(room, np.int32),
            np.empty((room + 1, E_AXIS)), np.empty((0, E_AXIS)), np.empty((ROOM, REMARK_COLUMNS)),
        )  # fmt: skip

    def begin(self, place: list[float], rows: int) -> None:
        """Have room for so many more rows, the first of which begins at a place (X Y Z tilt turn, then anything)."""
        count, columns, room = self.rows, self.columns, len(self.columns.places) - 1
        if count + rows > room:
            fixed = ("remark_rows",) if len(columns.starts) else ("remark_rows", "starts")
            longer = {
                name: _longer(column, 2 * (count + rows) + 1) for name, column in columns._asdict().items() if name not in fixed
            }
            columns = columns._replace(**longer)
        if self.remarks == len(columns.remark_rows):
            columns = columns._replace(remark_rows=_longer(columns.remark_rows, 2 * self.remarks))
        if count == 0:
            columns.places[0] = place[:E_AXIS]
        elif not len(columns.starts) and columns.places[count].tolist() != place[:E_AXIS]:
            columns = columns._replace(starts=_longer(columns.places[:count], len(columns.line)))
        self.columns = columns

    def add(self, line: int, before: list[float], after: list[float], feed: float, remark: tuple[float, ...]) -> None:
        """A row from a place to another, X Y Z tilt turn E."""
        self.begin(before, 1)
        columns, row = self.columns, self.rows
        if not self.remarks or columns.remark_rows[self.remarks - 1].tolist() != list(remark):
            columns.remark_rows[self.remarks] = remark
            self.remarks += 1
        columns.line[row], columns.feed[row], columns.remark[row] = line, feed, self.remarks - 1
        columns.e_mm[row] = after[E_AXIS] - before[E_AXIS]
        columns.places[row + 1] = after[:E_AXIS]
        if len(columns.starts):
            columns.starts[row] = before[:E_AXIS]
        self.rows += 1


def _longer(column: NDArray[Any], length: int) -> NDArray[Any]:
    """An array with room for more."""
    longer = np.empty((length, *column.shape[1:]), column.dtype)
    longer[: len(column)] = column
    return longer
