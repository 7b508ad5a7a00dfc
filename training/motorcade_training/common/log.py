"""Log of a training: one CSV row per interval, curves as SVG."""

import csv
import os
from pathlib import Path

COLOURS = ("#4477aa", "#cc6677", "#228833", "#aa8800", "#66ccee", "#aa3377")


class CsvLog:
    """Appends rows; columns are those of the first row. A resumed training drops the rows after its step."""

    def __init__(self, path: Path, from_step: int = 0):
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        kept = [row for row in read(path) if int(row["step"]) <= from_step] if path.is_file() and from_step else []
        self.columns = list(kept[0]) if kept else None
        with path.open("w", newline="") as file:
            if self.columns:
                writer = csv.DictWriter(file, self.columns)
                writer.writeheader()
                writer.writerows(kept)

    def write(self, **row: float) -> None:
        """One row; needs `step`."""
        with self.path.open("a", newline="") as file:
            first = self.columns is None
            self.columns = self.columns or list(row)
            writer = csv.DictWriter(file, self.columns)
            if first:
                writer.writeheader()
            writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})


def read(path: Path) -> list[dict[str, str]]:
    """Rows of a log."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def draw(log: Path, svg: Path, columns: list[str], x: str = "step") -> None:
    """Curves of `columns` over `x`, each scaled to its own largest value, which the legend names."""
    rows = read(log)
    width, height, margin = 720, 320, 40
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        f'<path d="M{margin} {margin}V{height - margin}H{width - margin}" fill="none" stroke="#444"/>',
    ]
    last = max((float(row[x]) for row in rows), default=1.0) or 1.0
    for index, column in enumerate(columns):
        points = [(float(row[x]), float(row[column])) for row in rows if row.get(column) not in (None, "", "nan")]
        if not points:
            continue
        top = max(value for _, value in points) or 1.0
        place = [
            f"{margin + (width - 2 * margin) * a / last:.1f},{height - margin - (height - 2 * margin) * b / top:.1f}"
            for a, b in points
        ]
        colour = COLOURS[index % len(COLOURS)]
        lines.append(f'<polyline points="{" ".join(place)}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        label = f"{column}: 0 to {top:.3g}, last {points[-1][1]:.3g}"
        lines.append(f'<text x="{width - margin}" y="{margin + 16 * index}" text-anchor="end" fill="{colour}">{label}</text>')
    lines.append(f'<text x="{width / 2}" y="{height - 10}" text-anchor="middle">{x}, 0 to {last:.0f}</text></svg>')
    beside = svg.with_suffix(".tmp")
    beside.write_text("\n".join(lines) + "\n")
    os.replace(beside, svg)
