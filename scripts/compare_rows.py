"""Compares the result columns of the rows that two studies share, bit by bit.

    python -m venv /tmp/compare && /tmp/compare/bin/pip install polars
    /tmp/compare/bin/python scripts/compare_rows.py results/quick results/other/quick

Exits with 1 when a bit differs or no row is shared. Which columns are results is read from report/columns.md of the first study.
"""

import struct
import sys
from pathlib import Path

import polars as pl


def roles(study):
    """The role (key, result, measurement) of each column."""
    lines = (study / "report" / "columns.md").read_text().splitlines()
    cells = [[cell.strip() for cell in line.split("|")] for line in lines]
    return {line[1]: line[3] for line in cells if len(line) > 4}


def bits(value):
    return struct.pack("<d", value) if isinstance(value, float) else value


def main():
    first, second = (Path(argument) for argument in sys.argv[1:3])
    role = roles(first)
    keys = [name for name, kind in role.items() if kind == "key"]
    results = [name for name, kind in role.items() if kind == "result"]
    a, b = (pl.read_parquet(study / "registrations.parquet") for study in (first, second))
    shared = a.join(b, on=keys, how="inner", suffix="_other")
    different = [
        (name, row)
        for name in results
        for row, pair in enumerate(zip(shared[name], shared[f"{name}_other"]))
        if bits(pair[0]) != bits(pair[1])
    ]
    print(f"{len(shared)} shared rows, {len(results)} result columns, {len(different)} values differ")
    for name, row in different[:20]:
        print(f"  {name}: {dict(shared.select(keys).row(row, named=True))}")
    return 1 if different or not len(shared) else 0


if __name__ == "__main__":
    sys.exit(main())
