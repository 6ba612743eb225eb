"""Rows of the tables: one line of text from named columns."""

from __future__ import annotations

Columns = tuple[tuple[str, str], ...]


def line(row: dict[str, object], columns: Columns) -> str:
    """The row in its columns, a dash where it has no figure, and why something went wrong."""
    cells = []
    for name, form in columns:
        width = form.split(":")[1].strip(">}").split(".")[0].rstrip("dsfe%")
        cells.append(form.format(row[name]) if row.get(name) is not None else "-".rjust(int(width)))
    return " ".join(cells) + (f"  {row['why']}" if row.get("why") else "")
