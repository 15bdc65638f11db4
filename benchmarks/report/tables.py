"""Tables of measured figures, as plain text and as Markdown."""

from typing import NamedTuple

Cell = str | float | None


class Table(NamedTuple):
    """Figures with a title.

    Attributes:
        name: key in benchmarks/results.json.
        title: one line above the table.
        columns: names of the columns.
        rows: cells; a cell is text, a number, or None where nothing can be measured.
    """

    name: str
    title: str
    columns: list[str]
    rows: list[list[Cell]]

    def without(self, column: str) -> "Table":
        """The same table without a column."""
        kept = [i for i, name in enumerate(self.columns) if name != column]
        rows = [[row[i] for i in kept] for row in self.rows]
        return self._replace(columns=[self.columns[i] for i in kept], rows=rows)

    def column(self, name: str) -> list[Cell]:
        """The cells of a column, from the first row to the last.

        Raises:
            ValueError: The table has no such column.
        """
        index = self.columns.index(name)
        return [row[index] for row in self.rows]


def cell_text(cell: Cell) -> str:
    """A cell as text; numbers have three significant digits."""
    if cell is None:
        return "–"
    if isinstance(cell, str):
        return cell
    if cell != 0.0 and not 1e-3 <= abs(cell) < 1e9:
        return f"{cell:.1e}"
    rounded = float(f"{cell:.3g}")
    return f"{rounded:,.0f}" if abs(rounded) >= 100 else f"{rounded:g}"


def plain(table: Table) -> str:
    """A table in columns, for a terminal."""
    cells = [table.columns, *([cell_text(c) for c in row] for row in table.rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = ["  ".join([r[0].ljust(widths[0]), *map(str.rjust, r[1:], widths[1:])]) for r in cells]
    return "\n".join([table.title, lines[0], "-" * len(lines[0]), *lines[1:]])


def markdown(table: Table) -> str:
    """A table in Markdown, without its title."""
    cells = [table.columns, ["---", *["---:"] * (len(table.columns) - 1)]]
    cells += [[cell_text(c) for c in row] for row in table.rows]
    return "\n".join("| " + " | ".join(row) + " |" for row in cells)
